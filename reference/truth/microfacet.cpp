#include "reference/truth/microfacet.h"

#include <cmath>
#include <numbers>

#include "reference/truth/quadrature.h"

namespace gnomon::truth {

double ggx(double theta, double alpha) {
  const double c = std::cos(theta), t = std::tan(theta), a2 = alpha * alpha;
  return a2 / (std::numbers::pi * c * c * c * c * (a2 + t * t) * (a2 + t * t));
}

double smithG1(double cosTheta, double alpha) {
  const double tan2 = (1 - cosTheta * cosTheta) / (cosTheta * cosTheta);
  return 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
}

std::array<double, 2> sampleGgx(double u1, double u2, double alpha) {
  return {std::atan(alpha * std::sqrt(u1 / (1 - u1))), 2 * std::numbers::pi * u2};
}

// With h drawn as (xi, phi) by sampleGgx the density D NoH cancels D: the integrand becomes
// weight VoH / (NoV NoH). sin theta = alpha sqrt(xi / (1 + (alpha^2 - 1) xi)).
double specularAlbedo(double NoV, double alpha, const Weight& weight, unsigned nodes) {
  const double vx = std::sqrt(1 - NoV * NoV), vz = NoV;
  const GaussLegendre rule(nodes);
  return rule(0, 1, [&](double xi) {
    const double theta = sampleGgx(xi, 0, alpha)[0];
    const double hx0 = std::sin(theta), hz = std::cos(theta);
    return rule(0, 1, [&](double turn) {
      const double hx = hx0 * std::cos(std::numbers::pi * turn);  // symmetric in phi
      const double VoH = vx * hx + vz * hz;
      const double NoL = 2 * VoH * hz - vz;
      if (VoH <= 0 || NoL <= 0) return 0.0;
      return weight(NoL, VoH) * VoH / (NoV * hz);
    });
  });
}

}  // namespace gnomon::truth
