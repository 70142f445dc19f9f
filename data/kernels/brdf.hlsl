// Cook-Torrance as an HLSL compute shader: structured buffers, a constant buffer, and an entry
// point that is not called main.
struct Point {
  float3 normal;
  float roughness;
  float3 view;
  float metallic;
  float3 light;
  float3 albedo;
  float3 irradiance;
};
struct Lit {
  float D;
  float G;
  float3 F;
  float3 ambientF;
  float3 diffuse;
  float3 specular;
  float3 radiance;
};

[[vk::binding(0, 0)]] StructuredBuffer<Point> points;
[[vk::binding(1, 0)]] RWStructuredBuffer<Lit> lit;
[[vk::binding(2, 0)]] cbuffer Dispatch { uint count; };

static const float kPi = 3.14159265358979;

bool finite(float x) { return (asuint(x) & 0x7f800000u) != 0x7f800000u; }
float orZero(float x) { return finite(x) ? x : 0.0; }
float3 orZero3(float3 x) { return float3(orZero(x.x), orZero(x.y), orZero(x.z)); }
float largest(float3 x) { return max(max(abs(x.x), abs(x.y)), abs(x.z)); }
float3 unitOrZero(float3 x) {
  const float3 u = clamp(orZero3(x), -1.0, 1.0);
  return largest(u) >= 0.5 ? u : float3(0, 0, 0);
}
float pow5(float x) { return x * x * (x * x) * x; }
float schlick(float x, float k) { return x / (x * (1.0 - k) + k); }

[numthreads(64, 1, 1)] void CSMain(uint3 id : SV_DispatchThreadID) {
  const uint i = id.x;
  if (i >= count) return;
  const Point p = points[i];
  const float3 n = unitOrZero(p.normal), v = unitOrZero(p.view), l = unitOrZero(p.light);
  const float3 between = v + l;
  Lit o = (Lit)0;
  if (any(n != 0.0) && any(v != 0.0) && any(l != 0.0) && largest(between) >= 1.52587890625e-5) {
    const float r = clamp(orZero(p.roughness), 0.045, 1.0), a2 = r * r * (r * r);
    const float metallic = clamp(orZero(p.metallic), 0.0, 1.0);
    const float3 albedo = clamp(orZero3(p.albedo), 0.0, 1.0);
    const float3 irradiance = clamp(orZero3(p.irradiance), 0.0, 1e6);
    const float scale = rsqrt(dot(between, between));
    const float3 c = cross(n, between) * scale;
    const float NoH = dot(n, between) * scale;
    const float NoV = max(saturate(dot(n, v)), 1e-4), NoL = saturate(dot(n, l));
    const float VoH = saturate(dot(v, between) * scale);
    const float3 F0 = lerp(float3(0.04, 0.04, 0.04), albedo, metallic);
    const float d = dot(c, c) + NoH * NoH * a2, k = (r + 1.0) * (r + 1.0) * 0.125;
    o.D = a2 / (kPi * d * d);
    o.G = schlick(NoV, k) * schlick(NoL, k);
    o.F = F0 + (1.0 - F0) * pow5(1.0 - VoH);
    o.ambientF = F0 + (max((1.0 - r).xxx, F0) - F0) * pow5(1.0 - NoV);
    o.diffuse = (1.0 - o.F) * (1.0 - metallic) * albedo / kPi;
    o.specular = o.F * (o.D * o.G / max(4.0 * NoV * NoL, 1e-4));
    o.radiance = (o.diffuse + o.specular) * NoL * irradiance;
  }
  lit[i] = o;
}
