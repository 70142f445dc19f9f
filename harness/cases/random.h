// Random stimulus that is the same with every compiler and standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "kernels/contract.h"

namespace gnomon {

/// Uniform numbers from std::mt19937_64, whose sequence the standard fixes (its distributions'
/// sequences it does not).
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine(seed) {}

  /// In [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(engine() >> 11) * 0x1p-53; }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  /// Uniform in the logarithm; lo, hi > 0.
  double logUniform(double lo, double hi) { return lo * std::pow(hi / lo, uniform()); }
  std::uint64_t below(std::uint64_t n) { return engine() % n; }
  bool chance(double p) { return uniform() < p; }

  /// Uniform on the unit sphere (Archimedes: z is uniform).
  glm::dvec3 direction() {
    const double z = uniform(-1, 1), phi = uniform(0, 2 * std::numbers::pi);
    const double s = std::sqrt(1 - z * z);
    return {s * std::cos(phi), s * std::sin(phi), z};
  }

 private:
  std::mt19937_64 engine;
};

/// Two unit vectors that complete the unit vector n to a right-handed frame (t, b, n).
/// Duff et al. 2017, "Building an orthonormal basis, revisited".
inline void frameAround(const glm::dvec3& n, glm::dvec3& t, glm::dvec3& b) {
  const double sign = std::copysign(1.0, n.z), a = -1 / (sign + n.z), c = n.x * n.y * a;
  t = {1 + sign * n.x * n.x * a, sign * c, -sign * n.x};
  b = {c, sign + n.y * n.y * a, -n.y};
}

/// The direction at polar angle theta and azimuth phi about the unit vector n.
inline glm::dvec3 around(const glm::dvec3& n, double theta, double phi) {
  glm::dvec3 t, b;
  frameAround(n, t, b);
  return std::sin(theta) * (std::cos(phi) * t + std::sin(phi) * b) + std::cos(theta) * n;
}

}  // namespace gnomon
