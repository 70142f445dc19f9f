// Tone curves and transfer functions. Arguments are linear and not negative; curves may exceed 1.
#ifndef GNOMON_TONEMAP_GLSL
#define GNOMON_TONEMAP_GLSL

// Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. 3.
float reinhard(float x) { return x / (1.0 + x); }

// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
float narkowicz(float x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

// Hill 2016, in BakingLab's ACES.hlsl: sRGB to AP1 with the RRT's desaturation, the fit of RRT and
// ODT, and back. Matrices by columns.
vec3 hill(vec3 colour) {
  const mat3 toRrt = mat3(0.59719, 0.07600, 0.02840,  //
                          0.35458, 0.90834, 0.13383,  //
                          0.04823, 0.01566, 0.83777);
  const mat3 fromOdt = mat3(1.60475, -0.10208, -0.00327,  //
                            -0.53108, 1.10813, -0.07276,  //
                            -0.07367, -0.00605, 1.07602);
  const vec3 v = toRrt * colour;
  const vec3 a = v * (v + 0.0245786) - 0.000090537;
  const vec3 b = v * (0.983729 * v + 0.4329510) + 0.238081;
  return fromOdt * (a / b);
}

// A pure power. 0 has no logarithm, and a driver may neither flush a denormal nor take its
// logarithm well (Mesa 22.3's software device is off by 58 % here), so both bypass it.
float encodeGamma(float x) { return x >= 1.17549435e-38 ? pow(x, 1.0 / 2.2) : 0.0; }

// IEC 61966-2-1.
float encodeSrgb(float x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }

#endif
