#include "reference/truth/quadrature.h"

#include <cmath>
#include <numbers>

namespace gnomon::truth {

// Newton's method on the Legendre polynomial P_n from the Chebyshev guess (Abramowitz & Stegun
// 1964, 25.4.29-30); P_n by its three-term recurrence, P_n' = n (x P_n - P_{n-1}) / (x^2 - 1).
GaussLegendre::GaussLegendre(std::size_t n) : nodes(n), weights(n) {
  const auto degree = static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / (degree + 0.5));
    double slope = 0;
    for (int step = 0; step < 100; ++step) {
      double p = 1, previous = 0;
      for (std::size_t k = 1; k <= n; ++k) {
        const auto j = static_cast<double>(k);
        const double next = ((2 * j - 1) * x * p - (j - 1) * previous) / j;
        previous = p;
        p = next;
      }
      slope = degree * (x * p - previous) / (x * x - 1);
      const double move = p / slope;
      x -= move;
      if (std::abs(move) < 1e-16) break;
    }
    nodes[i] = x;
    weights[i] = 2 / ((1 - x * x) * slope * slope);
  }
}

double GaussLegendre::operator()(double a, double b, const std::function<double(double)>& f) const {
  const double half = (b - a) / 2, middle = (a + b) / 2;
  double sum = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) sum += weights[i] * f(middle + half * nodes[i]);
  return half * sum;
}

double hemisphere(const std::function<double(double, double)>& f, double scale, std::size_t nodes) {
  const GaussLegendre rule(nodes);
  return rule(0, 1, [&](double u) {
    const double tangent = scale * u / (1 - u);
    const double theta = std::atan(tangent);
    const double dTheta = scale / ((1 - u) * (1 - u)) / (1 + tangent * tangent);
    // The integrand is periodic in phi: equally spaced points converge faster than any power.
    double ring = 0;
    for (std::size_t k = 0; k < nodes; ++k)
      ring += f(theta, 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(nodes));
    return ring * 2 * std::numbers::pi / static_cast<double>(nodes) * std::sin(theta) * dTheta;
  });
}

}  // namespace gnomon::truth
