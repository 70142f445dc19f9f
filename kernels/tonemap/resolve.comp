// Bloom, exposure, tone curve and transfer function: one pixel a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#include "tonemap.h"
#include "../lib/safe.glsl"
#include "../lib/tonemap.glsl"

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Resolve push; };
layout(set = 0, binding = kHdr) uniform texture2D hdr;
layout(set = 0, binding = kBloom) uniform texture2D bloom;
layout(set = 0, binding = kTarget) writeonly uniform image2D target;

float safe(float x) {
  if (isFinite(x)) return clamp(x, -kMaxScene, kMaxScene);
  return isPositiveInfinity(x) ? kMaxScene : 0.0;
}

vec3 safe(vec3 v) { return vec3(safe(v.x), safe(v.y), safe(v.z)); }

vec3 bloomTexel(ivec2 at) {
  const ivec2 last = textureSize(bloom, 0) - 1;
  return safe(texelFetch(bloom, clamp(at, ivec2(0), last), 0).rgb);
}

// Bilinear between texel centres. The centre of pixel x stands at ((2 x + 1) b - w) / (2 w) texels
// from the first centre, for w pixels over b texels: whole texels and the rest in integers, so that
// the only rounding is one division.
vec3 bloomAt(ivec2 pixel) {
  const ivec2 twice = 2 * ivec2(push.size);
  const ivec2 shifted = (2 * pixel + 1) * textureSize(bloom, 0) + ivec2(push.size);  // + 1 texel
  const ivec2 whole = shifted / twice - 1;
  const vec2 part = vec2(shifted % twice) / vec2(twice);
  const vec3 upper = mix(bloomTexel(whole), bloomTexel(whole + ivec2(1, 0)), part.x);
  const vec3 lower = mix(bloomTexel(whole + ivec2(0, 1)), bloomTexel(whole + ivec2(1, 1)), part.x);
  return mix(upper, lower, part.y);
}

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
  if (any(greaterThanEqual(at, push.size))) return;
  const ivec2 pixel = ivec2(at);
  const vec3 scene = safe(texelFetch(hdr, pixel, 0).rgb) + bloomAt(pixel) * push.bloomIntensity;
  const vec3 exposed = clamp(scene * push.exposure, 0.0, kMaxScene);
  const vec3 display = clamp(curve(exposed), 0.0, 1.0);
  imageStore(target, pixel,
             vec4(transfer(display.r), transfer(display.g), transfer(display.b), 1.0));
}
