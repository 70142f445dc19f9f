// A tone mapper as older engines have it: rows from below, samplers and images in one, an sRGB-less
// RGBA8 target with its format written out, and curve and gamma fixed.
#version 450

layout(local_size_x = 16, local_size_y = 4) in;
layout(binding = 0) uniform sampler2D sceneColour;
layout(binding = 1) uniform sampler2D glow;
layout(binding = 2, rgba8) uniform writeonly image2D frame;
layout(binding = 3, std140) uniform Display {
  uvec2 resolution;
  float exposure;
  float glowStrength;
  float gamma;
}
display;

float usable(float x) {
  uint bits = floatBitsToUint(x);
  if ((bits & 0x7f800000u) != 0x7f800000u) return clamp(x, -4292870144.0, 4292870144.0);
  return bits == 0x7f800000u ? 4292870144.0 : 0.0;
}
vec3 usable(vec3 c) { return vec3(usable(c.r), usable(c.g), usable(c.b)); }

vec3 glowTexel(ivec2 at) {
  return usable(texelFetch(glow, clamp(at, ivec2(0), textureSize(glow, 0) - 1), 0).rgb);
}

vec3 glowAt(ivec2 pixel) {
  ivec2 twice = 2 * ivec2(display.resolution);
  ivec2 shifted = (2 * pixel + 1) * textureSize(glow, 0) + ivec2(display.resolution);
  ivec2 at = shifted / twice - 1;
  vec2 f = vec2(shifted % twice) / vec2(twice);
  return mix(mix(glowTexel(at), glowTexel(at + ivec2(1, 0)), f.x),
             mix(glowTexel(at + ivec2(0, 1)), glowTexel(at + ivec2(1, 1)), f.x), f.y);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(gl_GlobalInvocationID.xy, display.resolution))) return;
  vec3 hdr = usable(texelFetch(sceneColour, pixel, 0).rgb) + glowAt(pixel) * display.glowStrength;
  vec3 x = clamp(hdr * display.exposure, 0.0, 4292870144.0);
  vec3 mapped = x / (x + 1.0);  // Reinhard
  vec3 encoded = pow(max(mapped, 1.17549435e-38), vec3(1.0 / display.gamma));
  imageStore(frame, pixel, vec4(mix(vec3(0.0), encoded, greaterThan(mapped, vec3(1.17e-38))), 1.0));
}
