#include "reference/brdf/evaluate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reference/bound/altered.h"
#include "reference/bound/bounded.h"

namespace gnomon::brdf {
namespace {

template <class T>
T pi() {
  return T(std::numbers::pi_v<float>);
}

float finiteOrZero(float x) { return std::isfinite(x) ? x : 0.0f; }

vec3 finiteOrZero(const vec3& v) {
  return {finiteOrZero(v.x), finiteOrZero(v.y), finiteOrZero(v.z)};
}

template <class T>
Vec3<T> zero() {
  return {T(0), T(0), T(0)};
}

template <class T>
Vec3<T> splat(const T& x) {
  return {x, x, x};
}

template <class T>
T largestComponent(const Vec3<T>& v) {
  return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

template <class T>
auto isZero(const Vec3<T>& v) {
  return v.x == T(0) && v.y == T(0) && v.z == T(0);
}

/// The vector itself, or zero if it is too short to be a unit vector.
template <class T>
Vec3<T> unitOrZero(const vec3& v) {
  const Vec3<T> u = clamp(input<T>(finiteOrZero(v)), T(-1), T(1));
  return select(largestComponent(u) >= T(kShortestUnit), u, zero<T>());
}

template <class T>
T cosine(const T& x) {
  return clamp(x, T(0), T(1));
}

template <class T>
T limited(float x, float lo, float hi) {
  return clamp(input<T>(finiteOrZero(x)), T(lo), T(hi));
}

template <class T>
Vec3<T> limited(const vec3& v, float hi) {
  return {limited<T>(v.x, 0, hi), limited<T>(v.y, 0, hi), limited<T>(v.z, 0, hi)};
}

template <class T>
T pow5(const T& x) {
  const T x2 = x * x;
  return x2 * x2 * x;
}

}  // namespace

template <class T>
T D_GGX(const Vec3<T>& nxh, const T& NoH, const T& alpha) {
  const T alpha2 = alpha * alpha;
  const T sin2 = alsoAs(dot(nxh, nxh), T(1) - NoH * NoH);
  const T d = sin2 + NoH * NoH * alpha2;
  return alpha2 / (pi<T>() * d * d);
}

template <class T>
T kDirect(const T& r) {
  return (r + T(1)) * (r + T(1)) * T(0.125f);
}

template <class T>
T G1_Schlick(const T& NoX, const T& k) {
  return NoX / (NoX * (T(1) - k) + k);
}

template <class T>
Vec3<T> F_Schlick(const T& VoH, const Vec3<T>& F0) {
  return F0 + (splat(T(1)) - F0) * pow5(T(1) - VoH);
}

template <class T>
Vec3<T> F_SchlickRoughness(const T& NoV, const Vec3<T>& F0, const T& r) {
  return F0 + (max(splat(T(1) - r), F0) - F0) * pow5(T(1) - NoV);
}

template <class T>
ShadedOf<T> evaluate(const Sample& s) {
  const Vec3<T> n = reported(unitOrZero<T>(s.normal), "n");
  const Vec3<T> v = reported(unitOrZero<T>(s.view), "v");
  const Vec3<T> l = reported(unitOrZero<T>(s.light), "l");
  const Vec3<T> halfway = reported(v + l, "halfway");
  if (isZero(n) || isZero(v) || isZero(l) || largestComponent(halfway) < T(kShortestHalf))
    return {T(0), T(0), zero<T>(), zero<T>(), zero<T>(), zero<T>(), zero<T>()};

  const T r = reported(limited<T>(s.roughness, kMinRoughness, 1), "r");
  const T metallic = reported(limited<T>(s.metallic, 0, 1), "metallic");
  const Vec3<T> albedo = reported(limited<T>(s.albedo, 1), "albedo");
  const Vec3<T> irradiance = reported(limited<T>(s.irradiance, kMaxIrradiance), "irradiance");
  const T scale = inversesqrt(dot(halfway, halfway));
  const Vec3<T> nxh = reported(cross(n, halfway) * scale, "nxh");
  const T NoV = named(max(cosine(dot(n, v)), T(kMinNoV)), "NoV");
  const T NoL = named(cosine(dot(n, l)), "NoL");
  const T VoH = named(cosine(dot(v, halfway) * scale), "VoH");
  const Vec3<T> F0 = named(mix(splat(T(kDielectricF0)), albedo, metallic), "F0");
  const T k = kDirect(r);

  ShadedOf<T> o;
  o.D = named(D_GGX(nxh, named(dot(n, halfway) * scale, "NoH"), r * r), "D");
  o.G = named(G1_Schlick(NoV, k) * G1_Schlick(NoL, k), "G");
  o.F = named(F_Schlick(VoH, F0), "F");
  o.ambientF = named(F_SchlickRoughness(NoV, F0, r), "ambientF");
  o.diffuse = (splat(T(1)) - o.F) * (T(1) - metallic) * albedo / pi<T>();
  o.specular =
      o.F * (o.D * o.G / reported(max(T(4) * NoV * NoL, T(kMinDenominator)), "denominator"));
  o.radiance = (o.diffuse + o.specular) * NoL * irradiance;
  return o;
}

template double D_GGX(const Vec3<double>&, const double&, const double&);
template double kDirect(const double&);
template double G1_Schlick(const double&, const double&);
template Vec3<double> F_Schlick(const double&, const Vec3<double>&);
template Vec3<double> F_SchlickRoughness(const double&, const Vec3<double>&, const double&);
template ShadedOf<double> evaluate(const Sample&);
template ShadedOf<Bounded> evaluate(const Sample&);
template Altered D_GGX(const Vec3<Altered>&, const Altered&, const Altered&);
template Altered kDirect(const Altered&);
template Altered G1_Schlick(const Altered&, const Altered&);
template Vec3<Altered> F_Schlick(const Altered&, const Vec3<Altered>&);
template Vec3<Altered> F_SchlickRoughness(const Altered&, const Vec3<Altered>&, const Altered&);
template ShadedOf<Altered> evaluate(const Sample&);

}  // namespace gnomon::brdf
