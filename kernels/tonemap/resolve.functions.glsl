// The entry point around somebody's tone curve or transfer function: `functions` of an adapter are
// expressions of the vec3 x, linear and not negative. Bloom, exposure, saturation and bad input are
// dealt with as the contract says.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#include "tonemap.h"
#include "../lib/safe.glsl"
#include "FUNCTIONS"
#ifndef GNOMON_curve
#define GNOMON_curve (x)
#endif
#ifndef GNOMON_transfer
#define GNOMON_transfer (x)
#endif

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Resolve push; };
layout(set = 0, binding = kHdr) uniform texture2D hdr;
layout(set = 0, binding = kBloom) uniform texture2D bloom;
layout(set = 0, binding = kTarget) writeonly uniform image2D target;

#include "bloom_at.glsl"

vec3 gnomonCurve(vec3 x) { return GNOMON_curve; }
vec3 gnomonTransfer(vec3 x) { return GNOMON_transfer; }

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(at, push.size))) return;
  const ivec2 pixel = ivec2(at);
  const vec3 scene =
      safeScene(texelFetch(hdr, pixel, 0).rgb) + bloomAt(pixel) * push.bloomIntensity;
  const vec3 exposed = clamp(scene * push.exposure, 0.0, kMaxScene);
  const vec3 display = clamp(gnomonCurve(exposed), 0.0, 1.0);
  imageStore(target, pixel, vec4(gnomonTransfer(display), 1.0));
}
