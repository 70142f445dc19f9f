// Floats seen from double: neighbours and spacing, without touching the CPU's rounding mode.
#ifndef GNOMON_REFERENCE_BOUND_FLOAT_H
#define GNOMON_REFERENCE_BOUND_FLOAT_H

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#if defined(__FAST_MATH__)
#error "bounds need IEEE arithmetic: build without -ffast-math"
#endif
static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);

namespace gnomon {

inline constexpr double kMinDenormal = 0x1p-149;
inline constexpr double kMinNormal = 0x1p-126;
inline constexpr double kMaxFloat = 0x1.fffffep127;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// head + tail, unevaluated, with |tail| at most half a unit in the last place of head.
struct Exact {
  double head, tail;
};

// Knuth, The Art of Computer Programming 2, 4.2.2 theorem B: a + b = head + tail exactly.
inline Exact twoSum(double a, double b) noexcept {
  const double sum = a + b;
  const double partOfB = sum - a;
  return {sum, (a - (sum - partOfB)) + (b - partOfB)};
}

// std::min and std::max return references, which costs a branch; these compile to one instruction.
inline double least(double a, double b) noexcept { return a < b ? a : b; }
inline double most(double a, double b) noexcept { return a > b ? a : b; }

// The largest float <= x, -infinity below all of them; written so that no branch is needed. The
// conversion rounds to nearest, so only the float it yields and the one below come into question,
// and it is so close to head that their difference is exact (Sterbenz). A zero that has to step
// down is -0, since the conversion keeps the sign: its bits step to the negative denormal.
inline double floorToFloat(Exact x) noexcept {
  const float nearest = static_cast<float>(x.head);
  const bool tooHigh = nearest - x.head > x.tail;
  const auto bits = std::bit_cast<std::int32_t>(nearest);
  const std::int32_t down = -(1 | (bits >> 31)), mask = -static_cast<std::int32_t>(tooHigh);
  return std::bit_cast<float>(bits + (down & mask));
}
inline double floorToFloat(double x) noexcept { return floorToFloat(Exact{x, 0}); }
inline double ceilToFloat(Exact x) noexcept { return -floorToFloat(Exact{-x.head, -x.tail}); }
inline double ceilToFloat(double x) noexcept { return -floorToFloat(-x); }
inline double nearestFloat(double x) noexcept { return static_cast<float>(x); }

// Distance between the floats around a |x| that is not a power of two; above it where it is one.
inline double spacing(double x) noexcept {
  constexpr std::uint64_t kBias = 1023;
  const std::uint64_t exponent = (std::bit_cast<std::uint64_t>(x) >> 52) & 0x7ff;
  const std::uint64_t inRange = std::clamp(exponent, kBias - 126, kBias + 127);
  return std::bit_cast<double>((inRange - 23) << 52);
}

// The specification's ulp(x): the smallest distance of two floats a <= x <= b, a != b. At a power
// of two that is the distance *below* it, half the spacing above.
inline double ulp(double x) noexcept {
  const bool powerOfTwo = (std::bit_cast<std::uint64_t>(x) << 12) == 0;
  if (powerOfTwo && std::abs(x) > kMinNormal && std::abs(x) <= kMaxFloat) return spacing(x) / 2;
  return spacing(x);
}

// The floats next to the float x; the infinities are their own neighbours.
inline double nextFloatDown(double x) noexcept {
  if (x == 0) return -kMinDenormal;
  return std::abs(x) == kInfinity ? x : floorToFloat(Exact{x, -kMinDenormal});
}
inline double nextFloatUp(double x) noexcept { return -nextFloatDown(-x); }

}  // namespace gnomon

#endif
