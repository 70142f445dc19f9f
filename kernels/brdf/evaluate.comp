// Cook-Torrance with Lambert diffuse, one sample a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "brdf.h"
#include "../lib/brdf.glsl"
#include "../lib/probe.glsl"
#include "../lib/safe.glsl"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Evaluate push; };
layout(set = 0, binding = kSamples, scalar) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Results { Shaded results[]; };
GNOMON_PROBE_BUFFER(EvaluateProbes)

vec3 unitOrZero(vec3 v) {
  const vec3 u = clamp(finiteOrZero(v), -1.0, 1.0);
  return largestComponent(u) >= kShortestUnit ? u : vec3(0.0);
}

bool isZero(vec3 v) { return v == vec3(0.0); }

float cosine(float x) { return clamp(x, 0.0, 1.0); }

Shaded evaluate(Sample s) {
  const vec3 n = unitOrZero(s.normal);
  const vec3 v = unitOrZero(s.view);
  const vec3 l = unitOrZero(s.light);
  const vec3 halfway = v + l;
  GNOMON_PROBE(n, n);
  GNOMON_PROBE(v, v);
  GNOMON_PROBE(l, l);
  GNOMON_PROBE(halfway, halfway);
  if (isZero(n) || isZero(v) || isZero(l) || largestComponent(halfway) < kShortestHalf) {
    const vec3 zero = vec3(0.0);
    return Shaded(0.0, 0.0, zero, zero, zero, zero, zero);
  }

  const float r = clamp(finiteOrZero(s.roughness), kMinRoughness, 1.0);
  const float metallic = clamp(finiteOrZero(s.metallic), 0.0, 1.0);
  const vec3 albedo = clamp(finiteOrZero(s.albedo), 0.0, 1.0);
  const vec3 irradiance = clamp(finiteOrZero(s.irradiance), 0.0, kMaxIrradiance);
  GNOMON_PROBE(r, r);
  GNOMON_PROBE(metallic, metallic);
  GNOMON_PROBE(albedo, albedo);
  GNOMON_PROBE(irradiance, irradiance);

  // Scaled last: the rounding of h would be as large as n x h inside a narrow lobe.
  const float scale = inversesqrt(dot(halfway, halfway));
  const vec3 nxh = cross(n, halfway) * scale;
  const float NoV = max(cosine(dot(n, v)), kMinNoV);
  const float NoL = cosine(dot(n, l));
  const float VoH = cosine(dot(v, halfway) * scale);
  const vec3 F0 = mix(vec3(kDielectricF0), albedo, metallic);
  GNOMON_PROBE(nxh, nxh);
  GNOMON_PROBE(NoV, NoV);
  GNOMON_PROBE(NoL, NoL);
  GNOMON_PROBE(VoH, VoH);
  GNOMON_PROBE(F0, F0);

  Shaded o;
  o.D = D_GGX(nxh, GNOMON_PROBED(NoH, dot(n, halfway) * scale), r * r);
  o.G = G_SchlickDirect(NoV, NoL, r);
  o.F = F_Schlick(VoH, F0);
  o.ambientF = F_SchlickRoughness(NoV, F0, r);
  GNOMON_PROBE(D, o.D);
  GNOMON_PROBE(G, o.G);
  GNOMON_PROBE(F, o.F);
  GNOMON_PROBE(ambientF, o.ambientF);
  o.diffuse = (1.0 - o.F) * (1.0 - metallic) * albedo / kPi;
  o.specular =
      o.F * (o.D * o.G / GNOMON_PROBED(denominator, max(4.0 * NoV * NoL, kMinDenominator)));
  o.radiance = (o.diffuse + o.specular) * NoL * irradiance;
  return o;
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  GNOMON_PROBE_ELEMENT(i, push.count);
  if (i >= push.count) return;
  results[i] = evaluate(samples[i]);
}
