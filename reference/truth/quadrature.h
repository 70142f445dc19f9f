// Converged integrals for truth: Gauss-Legendre on an interval, products of it on the hemisphere.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace gnomon::truth {

/// Nodes in [-1, 1] and weights that integrate polynomials of degree 2n - 1 exactly.
struct GaussLegendre {
  explicit GaussLegendre(std::size_t n);
  std::vector<double> nodes, weights;

  /// Integral of f over [a, b].
  double operator()(double a, double b, const std::function<double(double)>& f) const;
};

/// Integral of f(theta, phi) sin(theta) over the upper hemisphere, theta in [0, pi/2]. The
/// substitution tan(theta) = scale * u / (1 - u) puts half of the nodes within tan(theta) < scale,
/// so a lobe of that width is resolved: give alpha for GGX, 1 for something broad.
double hemisphere(const std::function<double(double theta, double phi)>& f, double scale,
                  std::size_t nodes);

}  // namespace gnomon::truth
