// Contract of stage brdf: one record in, one record out, for every thread.
// Linear light throughout; scalar layout; read by GLSL and by C++.
#ifndef GNOMON_BRDF_H
#define GNOMON_BRDF_H

#include "../contract.h"

GNOMON_CONTRACT(brdf)

// What is evaluated. Bad input is part of the contract: a component that is NaN or infinite counts
// as 0, ranges are enforced by clamping, and a vector counts as zero if it is too short to be a
// unit vector (kShortestUnit). A zero vector makes every output 0; so does a light so nearly
// opposite to the view that the half vector would be rounding noise (kShortestHalf). Ranges of
// outputs hold to a few roundings.
struct Sample {
  vec3 normal;      // n, unit; components clamped to [-1, 1]
  float roughness;  // perceptual r, clamped to [kMinRoughness, 1]
  vec3 view;        // v, towards the eye, unit; clamped likewise
  float metallic;   // clamped to [0, 1]
  vec3 light;       // l, towards the light, unit; clamped likewise
  vec3 albedo;      // base colour, clamped to [0, 1]
  vec3 irradiance;  // of the light at normal incidence, W/m^2, clamped to [0, kMaxIrradiance]
};

struct Shaded {
  float D;        // GGX normal distribution, 1/sr; mirrored where NoH < 0
  float G;        // Smith shadowing-masking, Schlick-GGX with k for direct light, [0, 1]
  vec3 F;         // Schlick reflectance at VoH, [0, 1]
  vec3 ambientF;  // Schlick reflectance at NoV, limited by 1 - r, [0, 1]
  vec3 diffuse;   // Lambert lobe, (1 - F)(1 - metallic) albedo / pi, 1/sr
  vec3 specular;  // Cook-Torrance lobe, D G F / max(4 NoV NoL, kMinDenominator), 1/sr
  vec3 radiance;  // (diffuse + specular) NoL irradiance, W/(m^2 sr)
};

// What a kernel may name on its way, in the order of computation; ranges hold to a few roundings.
struct EvaluateProbes {
  vec3 n, v, l;     // unit vectors as they count, or zero
  vec3 halfway;     // v + l, of any length
  float r;          // perceptual roughness, [kMinRoughness, 1]
  float metallic;   // [0, 1]
  vec3 albedo;      // [0, 1]
  vec3 irradiance;  // W/m^2, [0, kMaxIrradiance]
  vec3 nxh;         // n x h of the unit half vector h
  float NoV;        // [kMinNoV, 1]
  float NoL;        // [0, 1]
  float VoH;        // [0, 1]
  vec3 F0;          // reflectance at normal incidence, [0, 1]
  float NoH;        // [-1, 1]: not clamped, D is even in it
  float D;          // from here on as in Shaded
  float G;
  vec3 F;
  vec3 ambientF;
  float denominator;  // of the specular lobe, [kMinDenominator, 4]
};

struct Evaluate {  // push constants
  uint count;      // samples; results beyond are not touched
};

const float kMinRoughness = 0.045f;
const float kMinNoV = 1e-4f;
const float kMinDenominator = 1e-4f;
const float kDielectricF0 = 0.04f;
const float kMaxIrradiance = 1e6f;
const float kShortestUnit = 0.5f;               // largest component; a unit vector has 0.577
const float kShortestHalf = 1.52587890625e-5f;  // largest component of v + l, 2^-16

const uint kSamples = 0;  // binding numbers, set 0
const uint kResults = 1;
const uint kGroupSize = 64;

GNOMON_CONTRACT_END

#endif
