// The entry point around somebody's functions: `functions` of an adapter are expressions over what
// is declared here, each defined as a macro of its slot. Bad input has been dealt with as the
// contract says.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "brdf.h"
#include "../lib/safe.glsl"
#include "FUNCTIONS"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Evaluate push; };
layout(set = 0, binding = kSamples, scalar) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Results { Shaded results[]; };

vec3 gnomonUnit(vec3 v) {
  const vec3 u = clamp(finiteOrZero(v), -1.0, 1.0);
  return largestComponent(u) >= kShortestUnit ? u : vec3(0.0);
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  const vec3 n = gnomonUnit(samples[i].normal);  // unit vectors: normal, view, light, half
  const vec3 v = gnomonUnit(samples[i].view);
  const vec3 l = gnomonUnit(samples[i].light);
  const vec3 between = v + l;
  const bool dark = n == vec3(0.0) || v == vec3(0.0) || l == vec3(0.0) ||
                    largestComponent(between) < kShortestHalf;
  const vec3 towards = between * inversesqrt(max(dot(between, between), 1e-12));
  const vec3 h = dot(n, towards) < 0.0 ? -towards : towards;   // D is even in NoH
  const float NoV = max(clamp(dot(n, v), 0.0, 1.0), kMinNoV);  // clamped cosines
  const float NoL = clamp(dot(n, l), 0.0, 1.0);
  const float NoH = clamp(dot(n, h), 0.0, 1.0);
  const float VoH = clamp(dot(v, towards), 0.0, 1.0);
  const float roughness = clamp(finiteOrZero(samples[i].roughness), kMinRoughness, 1.0);
  const float alpha = roughness * roughness;
  const float metallic = clamp(finiteOrZero(samples[i].metallic), 0.0, 1.0);
  const vec3 albedo = clamp(finiteOrZero(samples[i].albedo), 0.0, 1.0);
  const vec3 irradiance = clamp(finiteOrZero(samples[i].irradiance), 0.0, kMaxIrradiance);
  const vec3 F0 = mix(vec3(kDielectricF0), albedo, metallic);
#ifdef GNOMON_D
  results[i].D = dark ? 0.0 : GNOMON_D;
#endif
#ifdef GNOMON_G
  results[i].G = dark ? 0.0 : GNOMON_G;
#endif
#ifdef GNOMON_F
  results[i].F = dark ? vec3(0.0) : GNOMON_F;
#endif
#ifdef GNOMON_ambientF
  results[i].ambientF = dark ? vec3(0.0) : GNOMON_ambientF;
#endif
#ifdef GNOMON_diffuse
  results[i].diffuse = dark ? vec3(0.0) : GNOMON_diffuse;
#endif
#ifdef GNOMON_specular
  results[i].specular = dark ? vec3(0.0) : GNOMON_specular;
#endif
#ifdef GNOMON_radiance
  results[i].radiance = dark ? vec3(0.0) : GNOMON_radiance;
#endif
}
