// Debug views of the G-buffer: one pixel a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#include "post.h"
#include "../lib/depth.glsl"
#include "../lib/probe.glsl"
#include "../lib/safe.glsl"

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Views push; };
layout(set = 0, binding = kAlbedoImage) uniform texture2D albedo;
layout(set = 0, binding = kNormalImage) uniform texture2D normal;
layout(set = 0, binding = kDepthImage) uniform texture2D depth;
layout(set = 0, binding = kTarget) writeonly uniform image2D target;
GNOMON_PROBE_BUFFER(ViewsProbes)

const vec3 kCascadeColours[4] =
    vec3[](kCascadeColour0, kCascadeColour1, kCascadeColour2, kCascadeColour3);

vec3 cascades(float distance, vec3 scene) {
  uint cascade = 0;
  float begin = push.near;
  for (; cascade < 3 && distance > push.splits[cascade]; ++cascade) begin = push.splits[cascade];
  const float end = push.splits[cascade];
  const bool blends =
      cascade < 3 && distance > GNOMON_PROBED(blendStart, end - kCascadeBlend * (end - begin));
  const vec3 shown = kCascadeTint * kCascadeColours[cascade] + kCascadeDim * scene;
  GNOMON_PROBE(cascade, cascade);
  GNOMON_PROBE(tinted, shown);
  return blends ? kBlendBrighter * shown : shown;
}

vec3 view(ivec2 pixel) {
  const float d = clamp(finiteOrZero(texelFetch(depth, pixel, 0).r), 0.0, 1.0);
  GNOMON_PROBE(depth, d);
  if (d == 0.0) return vec3(0.0);  // sky
  const vec3 scene = clamp(finiteOrZero(texelFetch(albedo, pixel, 0).rgb), 0.0, 1.0);
  GNOMON_PROBE(albedo, scene);
  switch (push.mode) {
    case kNormal:
      return finiteOrZero(texelFetch(normal, pixel, 0).rgb);
    case kDepth:
      return vec3(GNOMON_PROBED(distance, linearDepth(d, push.near, push.far)) / push.far);
    case kCascades:
      return cascades(GNOMON_PROBED(distance, linearDepth(d, push.near, push.far)), scene);
    default:
      return scene;
  }
}

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  GNOMON_PROBE_PIXEL(at, push.size);
  if (any(greaterThanEqual(at, push.size))) return;
  imageStore(target, ivec2(at), vec4(clamp(GNOMON_PROBED(shown, view(ivec2(at))), 0.0, 1.0), 1.0));
}
