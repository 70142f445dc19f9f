// CPU model of brdf/evaluate: Cook-Torrance with GGX, Smith by Schlick, Schlick's Fresnel, Lambert.
//
// Every function is a template over the number type: double for the value, Bounded for all results
// that a conforming device may return. Cosines are clamped to [0, 1]; r is perceptual roughness in
// [kMinRoughness, 1], alpha = r^2.
#pragma once

#include <tuple>

#include "kernels/brdf/brdf.h"
#include "reference/bound/vec.h"

namespace gnomon::brdf {

/// GGX normal distribution in 1/sr: Walter et al. 2007, eq. 33, of n x h and n . h for unit n and
/// h. With tan^2 = sin^2 / cos^2 the equation is alpha^2 / (pi (sin^2 + alpha^2 cos^2)^2); sin^2 is
/// taken as |n x h|^2, which keeps its digits inside the lobe. (The usual NoH^2 (alpha^2 - 1) + 1
/// cancels there: at r < 0.2 its interval is 1.5e-2 wide, this one's 6.5e-5.) Even in NoH.
template <class T>
T D_GGX(const Vec3<T>& nxh, const T& NoH, const T& alpha);

/// k of Schlick's fit for punctual light: Karis 2013, p. 3, (r + 1)^2 / 8.
template <class T>
T kDirect(const T& r);

/// One factor of Smith's shadowing-masking, in [0, 1]: Schlick 1994, eq. 19.
template <class T>
T G1_Schlick(const T& NoX, const T& k);

/// Reflectance of a smooth surface: Schlick 1994, eq. 15, F0 + (1 - F0)(1 - VoH)^5.
template <class T>
Vec3<T> F_Schlick(const T& VoH, const Vec3<T>& F0);

/// Reflectance for ambient light: Lagarde 2011, "Adopting a physically based shading model";
/// grazing reflectance is max(1 - r, F0) instead of 1.
template <class T>
Vec3<T> F_SchlickRoughness(const T& NoV, const Vec3<T>& F0, const T& r);

/// What the contract's Shaded holds, in its order and units.
template <class T>
struct ShadedOf {
  T D, G;
  Vec3<T> F, ambientF, diffuse, specular, radiance;

  auto scalars() { return std::tie(D, G, F, ambientF, diffuse, specular, radiance); }
};

/// The whole sample, bad input included; see the contract for what counts as what.
template <class T>
ShadedOf<T> evaluate(const Sample& sample);

}  // namespace gnomon::brdf
