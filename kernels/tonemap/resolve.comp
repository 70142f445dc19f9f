// Bloom, exposure, tone curve and transfer function: one pixel a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#include "tonemap.h"
#include "../lib/probe.glsl"
#include "../lib/safe.glsl"
#include "../lib/tonemap.glsl"

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Resolve push; };
layout(set = 0, binding = kHdr) uniform texture2D hdr;
layout(set = 0, binding = kBloom) uniform texture2D bloom;
layout(set = 0, binding = kTarget) writeonly uniform image2D target;
GNOMON_PROBE_BUFFER(ResolveProbes)

#include "bloom_at.glsl"

vec3 curve(vec3 x) {
  switch (push.curve) {
    case kReinhard:
      return vec3(reinhard(x.r), reinhard(x.g), reinhard(x.b));
    case kNarkowicz:
      return vec3(narkowicz(x.r), narkowicz(x.g), narkowicz(x.b));
    case kHill:
      return hill(x);
    default:
      return x;
  }
}

float transfer(float x) {
  switch (push.transfer) {
    case kGamma:
      return encodeGamma(x);
    case kSrgb:
      return encodeSrgb(x);
    default:
      return x;
  }
}

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  GNOMON_PROBE_PIXEL(at, push.size);
  if (any(greaterThanEqual(at, push.size))) return;
  const ivec2 pixel = ivec2(at);
  const vec3 scene = GNOMON_PROBED(hdr, safeScene(texelFetch(hdr, pixel, 0).rgb)) +
                     GNOMON_PROBED(bloom, bloomAt(pixel)) * push.bloomIntensity;
  const vec3 exposed = clamp(scene * push.exposure, 0.0, kMaxScene);
  const vec3 display = clamp(GNOMON_PROBED(curved, curve(exposed)), 0.0, 1.0);
  GNOMON_PROBE(scene, scene);
  GNOMON_PROBE(exposed, exposed);
  GNOMON_PROBE(display, display);
  imageStore(target, pixel,
             vec4(transfer(display.r), transfer(display.g), transfer(display.b), 1.0));
}
