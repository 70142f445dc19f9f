// What enters the tone curve, for both entries of this stage; after the bindings that it reads.
#ifndef GNOMON_BLOOM_AT_GLSL
#define GNOMON_BLOOM_AT_GLSL

float safeScene(float x) {
  if (isFinite(x)) return clamp(x, -kMaxScene, kMaxScene);
  return isPositiveInfinity(x) ? kMaxScene : 0.0;
}

vec3 safeScene(vec3 v) { return vec3(safeScene(v.x), safeScene(v.y), safeScene(v.z)); }

vec3 bloomTexel(ivec2 at) {
  const ivec2 last = textureSize(bloom, 0) - 1;
  return safeScene(texelFetch(bloom, clamp(at, ivec2(0), last), 0).rgb);
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

#endif
