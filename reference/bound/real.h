// The built-ins of a shader for plain double, under the names that Bounded has them by, so that a
// model is one template. Definitions: GLSL 4.60 specification, chapter 8.
#ifndef GNOMON_REFERENCE_BOUND_REAL_H
#define GNOMON_REFERENCE_BOUND_REAL_H

#include <algorithm>
#include <cmath>

namespace gnomon {

inline double abs(double x) noexcept { return std::abs(x); }
inline double floor(double x) noexcept { return std::floor(x); }
inline double ceil(double x) noexcept { return std::ceil(x); }
inline double trunc(double x) noexcept { return std::trunc(x); }
inline double round(double x) noexcept { return std::round(x); }
inline double roundEven(double x) noexcept { return std::nearbyint(x); }
inline double fract(double x) noexcept { return x - std::floor(x); }
inline double mod(double x, double y) noexcept { return x - y * std::floor(x / y); }
inline double sign(double x) noexcept { return x > 0 ? 1 : x < 0 ? -1 : x; }
inline double square(double x) noexcept { return x * x; }

inline double min(double a, double b) noexcept { return b < a ? b : a; }
inline double max(double a, double b) noexcept { return a < b ? b : a; }
inline double clamp(double x, double lo, double hi) noexcept { return min(max(x, lo), hi); }
inline double select(bool condition, double a, double b) noexcept { return condition ? a : b; }
inline double mix(double x, double y, double a) noexcept { return x * (1 - a) + y * a; }
inline double step(double edge, double x) noexcept { return x < edge ? 0 : 1; }
inline double fma(double a, double b, double c) noexcept { return std::fma(a, b, c); }
inline double smoothstep(double edge0, double edge1, double x) noexcept {
  const double t = clamp((x - edge0) / (edge1 - edge0), 0, 1);
  return t * t * (3 - 2 * t);
}

inline double sqrt(double x) noexcept { return std::sqrt(x); }
inline double inversesqrt(double x) noexcept { return 1 / std::sqrt(x); }
inline double exp(double x) noexcept { return std::exp(x); }
inline double exp2(double x) noexcept { return std::exp2(x); }
inline double log(double x) noexcept { return std::log(x); }
inline double log2(double x) noexcept { return std::log2(x); }
inline double pow(double x, double y) noexcept { return std::pow(x, y); }
inline double sin(double x) noexcept { return std::sin(x); }
inline double cos(double x) noexcept { return std::cos(x); }
inline double tan(double x) noexcept { return std::tan(x); }
inline double asin(double x) noexcept { return std::asin(x); }
inline double acos(double x) noexcept { return std::acos(x); }
inline double atan(double x) noexcept { return std::atan(x); }
inline double atan2(double y, double x) noexcept { return std::atan2(y, x); }

inline bool isFinite(double x) noexcept { return std::isfinite(x); }
inline bool isInf(double x) noexcept { return std::isinf(x); }
inline bool isNan(double x) noexcept { return std::isnan(x); }

}  // namespace gnomon

#endif
