// Cook-Torrance with Lambert diffuse, one sample a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "brdf.h"
#include "../lib/brdf.glsl"
#include "../lib/safe.glsl"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Evaluate push; };
layout(set = 0, binding = kSamples, scalar) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Results { Shaded results[]; };

bool isZero(vec3 v) { return v == vec3(0.0); }

vec3 direction(vec3 v) { return unitOrZero(finiteOrZero(v), kShortestVector, kLongestVector); }

float cosine(vec3 a, vec3 b) { return clamp(dot(a, b), 0.0, 1.0); }

Shaded evaluate(Sample s) {
  const vec3 n = direction(s.normal);
  const vec3 v = direction(s.view);
  const vec3 l = direction(s.light);
  const vec3 h = unitOrZero(v + l, kShortestHalf, kLongestVector);
  if (isZero(n) || isZero(v) || isZero(l) || isZero(h)) {
    const vec3 zero = vec3(0.0);
    return Shaded(0.0, 0.0, zero, zero, zero, zero, zero);
  }

  const float r = clamp(finiteOrZero(s.roughness), kMinRoughness, 1.0);
  const float metallic = clamp(finiteOrZero(s.metallic), 0.0, 1.0);
  const vec3 albedo = clamp(finiteOrZero(s.albedo), 0.0, 1.0);
  const vec3 irradiance = clamp(finiteOrZero(s.irradiance), 0.0, kMaxIrradiance);

  const float NoV = max(cosine(n, v), kMinNoV);
  const float NoL = cosine(n, l);
  const float NoH = cosine(n, h);
  const float VoH = cosine(v, h);
  const vec3 F0 = mix(vec3(kDielectricF0), albedo, metallic);

  Shaded o;
  o.D = D_GGX(n, h, NoH, r * r);
  o.G = G_SchlickDirect(NoV, NoL, r);
  o.F = F_Schlick(VoH, F0);
  o.ambientF = F_SchlickRoughness(NoV, F0, r);
  o.diffuse = (1.0 - o.F) * (1.0 - metallic) * albedo / kPi;
  o.specular = o.F * (o.D * o.G / max(4.0 * NoV * NoL, kMinDenominator));
  o.radiance = (o.diffuse + o.specular) * NoL * irradiance;
  return o;
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  results[i] = evaluate(samples[i]);
}
