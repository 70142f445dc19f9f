// An engine's own dispatch: one buffer of records in std430, results in two buffers, parameters in
// a uniform block, alpha instead of roughness, 32 threads a group.
#version 450

struct SurfacePoint {
  vec4 n;  // w unused
  vec4 v;
  vec4 l;
  vec4 albedoAlpha;    // w: alpha = r^2
  vec4 lightMetallic;  // w: metallic
};

layout(local_size_x = 32) in;
layout(set = 1, binding = 3, std140) uniform Params {
  uint pointCount;
  float f0Dielectric;
}
params;
layout(set = 1, binding = 4, std430) readonly buffer Points { SurfacePoint points[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Terms { vec2 dg[]; };

const float PI = 3.141592653589793;

bool bad(float x) { return (floatBitsToUint(x) & 0x7f800000u) == 0x7f800000u; }
vec3 finite(vec3 x) {
  return vec3(bad(x.x) ? 0.0 : x.x, bad(x.y) ? 0.0 : x.y, bad(x.z) ? 0.0 : x.z);
}
vec3 direction(vec3 x) {
  vec3 u = clamp(finite(x), -1.0, 1.0);
  return max(max(abs(u.x), abs(u.y)), abs(u.z)) < 0.5 ? vec3(0.0) : u;
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= params.pointCount) return;
  SurfacePoint p = points[i];
  vec3 n = direction(p.n.xyz), v = direction(p.v.xyz), l = direction(p.l.xyz), s = v + l;
  if (n == vec3(0) || v == vec3(0) || l == vec3(0) ||
      max(max(abs(s.x), abs(s.y)), abs(s.z)) < 1.52587890625e-5) {
    radiance[i] = vec4(0);
    dg[i] = vec2(0);
    return;
  }
  float alpha = clamp(bad(p.albedoAlpha.w) ? 0.0 : p.albedoAlpha.w, 0.045 * 0.045, 1.0);
  float r = sqrt(alpha);
  float metallic = clamp(bad(p.lightMetallic.w) ? 0.0 : p.lightMetallic.w, 0.0, 1.0);
  vec3 albedo = clamp(finite(p.albedoAlpha.rgb), 0.0, 1.0);
  vec3 light = clamp(finite(p.lightMetallic.rgb), 0.0, 1e6);
  float invLength = inversesqrt(dot(s, s));
  float nv = max(clamp(dot(n, v), 0.0, 1.0), 1e-4), nl = clamp(dot(n, l), 0.0, 1.0);
  float vh = clamp(dot(v, s) * invLength, 0.0, 1.0), nh = dot(n, s) * invLength;
  vec3 c = cross(n, s) * invLength;
  float d = dot(c, c) + nh * nh * alpha * alpha;
  float D = alpha * alpha / (PI * d * d);
  float k = (r + 1.0) * (r + 1.0) / 8.0;
  float G = nv / (nv * (1.0 - k) + k) * (nl / (nl * (1.0 - k) + k));
  vec3 f0 = mix(vec3(params.f0Dielectric), albedo, metallic);
  float m = 1.0 - vh, m2 = m * m;
  vec3 F = f0 + (1.0 - f0) * (m2 * m2 * m);
  vec3 diffuse = (1.0 - F) * (1.0 - metallic) * albedo / PI;
  vec3 specular = F * (D * G / max(4.0 * nv * nl, 1e-4));
  radiance[i] = vec4((diffuse + specular) * nl * light, 1.0);
  dg[i] = vec2(D, G);
}
