// Tone curves of non-negative linear light, and display encodings of [0, 1].
#ifndef GNOMON_TONEMAP_GLSL
#define GNOMON_TONEMAP_GLSL

vec3 reinhard(vec3 x) { return x / (1.0 + x); }

// Narkowicz 2015, "ACES filmic tone mapping curve", divided by x above 1, so that x^2 of a large x
// neither overflows nor loses the quotient's digits.
float narkowicz(float x) {
  if (x <= 1.0) return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  const float t = 1.0 / x;
  return (2.51 + 0.03 * t) / (2.43 + (0.59 + 0.14 * t) * t);
}

// Hill 2016, "ACES" in BakingLab: sRGB to the RRT's space, a fit of RRT and ODT, and back to sRGB.
const mat3 kAcesInput = mat3(0.59719, 0.07600, 0.02840,  // columns
                             0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
const mat3 kAcesOutput =
    mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);

float rrtAndOdtFit(float x) {
  if (x <= 1.0)
    return (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081);
  const float t = 1.0 / x;
  return (1.0 + (0.0245786 - 0.000090537 * t) * t) / (0.983729 + (0.4329510 + 0.238081 * t) * t);
}

vec3 hill(vec3 colour) {
  const vec3 x = kAcesInput * colour;
  return kAcesOutput * vec3(rrtAndOdtFit(x.r), rrtAndOdtFit(x.g), rrtAndOdtFit(x.b));
}

float encodeGamma(float x) { return x > 0.0 ? pow(x, 1.0 / 2.2) : 0.0; }

// IEC 61966-2-1: linear up to 0.0031308.
float encodeSrgb(float x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }

#endif
