// Cook-Torrance terms. Every argument is a clamped cosine or in [0, 1]; a = alpha = r^2.
#ifndef GNOMON_BRDF_GLSL
#define GNOMON_BRDF_GLSL

const float kPi = 3.14159265358979;

// GGX. Walter et al. 2007, eq. 33, of the sine and cosine of the angle between n and h. The usual
// denominator NoH^2 (a^2 - 1) + 1 cancels inside the lobe; with sin^2 = |n x h|^2 this one does
// not.
float D_GGX(vec3 nxh, float NoH, float a) {
  const float a2 = a * a;
  const float d = dot(nxh, nxh) + NoH * NoH * a2;
  return a2 / (kPi * d * d);
}

// Schlick's fit of one Smith factor. Schlick 1994, eq. 19.
float G1_Schlick(float NoX, float k) { return NoX / (NoX * (1.0 - k) + k); }

// Karis 2013, "Real Shading in Unreal Engine 4", p. 3: k for direct light. 1/8 is exact.
float G_SchlickDirect(float NoV, float NoL, float r) {
  const float k = (r + 1.0) * (r + 1.0) * 0.125;
  return G1_Schlick(NoV, k) * G1_Schlick(NoL, k);
}

float pow5(float x) {
  const float x2 = x * x;
  return x2 * x2 * x;
}

// Schlick 1994, eq. 15.
vec3 F_Schlick(float VoH, vec3 F0) { return F0 + (1.0 - F0) * pow5(1.0 - VoH); }

// The same for ambient light, where a rough surface has no single half vector. Lagarde 2011.
vec3 F_SchlickRoughness(float NoV, vec3 F0, float r) {
  return F0 + (max(vec3(1.0 - r), F0) - F0) * pow5(1.0 - NoV);
}

#endif
