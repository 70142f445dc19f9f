// Microfacet theory from other papers and in other letters than the model: what tests it.
#pragma once

#include <array>
#include <functional>

namespace gnomon::truth {

/// GGX in the form printed by Walter et al. 2007, eq. 33, of the angle theta, in double:
/// alpha^2 / (pi cos^4 (alpha^2 + tan^2)^2), 1/sr.
double ggx(double theta, double alpha);

/// Smith's exact masking for GGX: Walter et al. 2007, eq. 34, 2 / (1 + sqrt(1 + alpha^2 tan^2)).
double smithG1(double cosTheta, double alpha);

/// A half vector drawn from D(h) NoH: Walter et al. 2007, eqs. 35, 36; u in [0, 1)^2. (theta, phi).
std::array<double, 2> sampleGgx(double u1, double u2, double alpha);

/// Directional albedo of a specular lobe: the integral of D weight / (4 NoV NoL) NoL over light
/// directions, where the weight is F G. By quadrature over half vectors drawn from D NoH, with
/// dl = 4 VoH dh, so that narrow lobes converge; to about 1e-4 with 200 nodes, the weight's kink at
/// the horizon being what is left.
using Weight = std::function<double(double NoL, double VoH)>;
double specularAlbedo(double NoV, double alpha, const Weight& weight, unsigned nodes);

}  // namespace gnomon::truth
