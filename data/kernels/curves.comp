// The source of curves.spv: a tone mapper whose group, curve and gamma are specialisation
// constants.
//     glslangValidator -V --target-env vulkan1.1 -o curves.spv curves.comp
#version 450
layout(local_size_x_id = 0, local_size_y_id = 1) in;
layout(constant_id = 2) const int curve = 0;
layout(constant_id = 3) const float inverseGamma = 1.0;
layout(set = 0, binding = 0) uniform sampler2D scene;
layout(set = 0, binding = 1) uniform sampler2D halo;
layout(set = 0, binding = 2, rgba8) uniform writeonly image2D result;
layout(push_constant) uniform Settings {
  ivec2 extent;
  float stops;  // 2^EV
  float strength;
}
settings;

float fixUp(float x) {
  uint bits = floatBitsToUint(x);
  if ((bits & 0x7f800000u) == 0x7f800000u) return bits == 0x7f800000u ? 4292870144.0 : 0.0;
  return clamp(x, -4292870144.0, 4292870144.0);
}
vec3 fixUp(vec3 c) { return vec3(fixUp(c.r), fixUp(c.g), fixUp(c.b)); }

vec3 haloAt(ivec2 p) {
  ivec2 size = textureSize(halo, 0);
  ivec2 at = (2 * p + 1) * size + settings.extent;
  ivec2 base = at / (2 * settings.extent) - 1;
  vec2 f = vec2(at % (2 * settings.extent)) / vec2(2 * settings.extent);
  vec3 rows[2];
  for (int y = 0; y < 2; ++y) {
    ivec2 left = clamp(base + ivec2(0, y), ivec2(0), size - 1);
    ivec2 right = clamp(base + ivec2(1, y), ivec2(0), size - 1);
    rows[y] = mix(fixUp(texelFetch(halo, left, 0).rgb), fixUp(texelFetch(halo, right, 0).rgb), f.x);
  }
  return mix(rows[0], rows[1], f.y);
}

vec3 mapped(vec3 x) {
  if (curve == 2) return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  return curve == 1 ? x / (1.0 + x) : x;
}

void main() {
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (p.x >= settings.extent.x || p.y >= settings.extent.y) return;
  vec3 light = fixUp(texelFetch(scene, p, 0).rgb) + haloAt(p) * settings.strength;
  vec3 shown = clamp(mapped(clamp(light * settings.stops, 0.0, 4292870144.0)), 0.0, 1.0);
  vec3 encoded = vec3(0.0);
  for (int c = 0; c < 3; ++c)
    if (shown[c] >= 1.17549435e-38) encoded[c] = pow(shown[c], inverseGamma);
  imageStore(result, p, vec4(encoded, 1.0));
}
