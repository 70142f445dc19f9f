// What the random tests of bounds share: exact reals (MPFR), arguments of all kinds, roundings.
#ifndef GNOMON_TESTS_REFERENCE_BOUND_RANDOM_H
#define GNOMON_TESTS_REFERENCE_BOUND_RANDOM_H

#include <gtest/gtest.h>
#include <mpfr.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "reference/bound/builtins.h"

namespace gnomon::test {

inline constexpr float kMax = std::numeric_limits<float>::max();
inline constexpr float kMin = std::numeric_limits<float>::min();
inline constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
inline constexpr float kInf = std::numeric_limits<float>::infinity();

// Random arguments of an operation. Sanitizers look at the code, not at the numbers.
#ifdef GNOMON_SANITIZE
inline constexpr int kRandomArguments = 20'000;
#else
inline constexpr int kRandomArguments = 1'000'000;
#endif

// 700 bits hold a * b + c for any floats: exponents from 2 * -149 to 256, and 48 + 24 bits more.
class Real {
 public:
  explicit Real(mpfr_prec_t bits = 700) { mpfr_init2(x_, bits); }
  Real(const Real&) = delete;
  Real& operator=(const Real&) = delete;
  ~Real() { mpfr_clear(x_); }
  operator mpfr_ptr() { return x_; }

 private:
  mpfr_t x_;
};

struct Floats {
  float low, high;
};

// Arguments of all kinds: any bits, everyday magnitudes, small integers, denormals, ends of range.
class Arguments {
 public:
  explicit Arguments(unsigned seed) : random_(seed) {}

  unsigned below(unsigned n) { return static_cast<unsigned>(random_() % n); }

  float any() {
    constexpr float kSpecial[] = {0.0f, -0.0f, 1.0f, -1.0f, kMax, -kMax, kMin, kDenormal, 0x1p126f};
    switch (below(8)) {
      case 0:
        return kSpecial[below(std::size(kSpecial))];
      case 1:
        return static_cast<float>(static_cast<int>(below(2001)) - 1000) * 0.25f;
      case 2:
        return fromBits(static_cast<std::uint32_t>(random_()) & 0x807fffffU);
      case 3:
      case 4:
        return finiteBits();
      default:
        return std::ldexp(signedUnit(), static_cast<int>(below(40)) - 20);
    }
  }

  // Of the other's size, so that sums cancel and products round near a neighbour.
  float near(float x) {
    const float ulps = static_cast<float>(static_cast<int>(below(9)) - 4);
    const float close = x * (1 + ulps * 0x1p-23f) * (below(2) != 0 ? 1.0f : -1.0f);
    return std::isfinite(close) ? close : x;
  }

  float within(float lo, float hi) {
    const double t = static_cast<double>(below(1U << 30)) * 0x1p-30;
    return std::clamp(static_cast<float>(lo + t * (static_cast<double>(hi) - lo)), lo, hi);
  }

  float signedUnit() { return within(-1, 1); }

 private:
  static float fromBits(std::uint32_t bits) {
    float x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
  }
  float finiteBits() {
    for (;;)
      if (const float x = fromBits(static_cast<std::uint32_t>(random_())); std::isfinite(x))
        return x;
  }

  std::mt19937_64 random_;
};

inline bool isDenormal(float x) { return x != 0 && std::abs(x) < kMin; }

// ulp(x) by the specification's definition: the smallest distance of floats a <= x <= b, a != b.
inline double specifiedUlp(mpfr_ptr z) {
  const float below = mpfr_get_flt(z, MPFR_RNDD), above = mpfr_get_flt(z, MPFR_RNDU);
  if (below != above)
    return std::isinf(above) || std::isinf(below) ? 0x1p104 : static_cast<double>(above) - below;
  return std::min(static_cast<double>(below) - std::nextafter(below, -kInf),
                  static_cast<double>(std::nextafter(below, kInf)) - below);
}

class EachRounding : public testing::TestWithParam<Rounding> {
 protected:
  const Rules rules_ = Rules::specification(GetParam());
  const UseRules use_{rules_};
};
inline std::string roundingName(const testing::TestParamInfo<Rounding>& tested) {
  return tested.param == Rounding::nearestEven ? "NearestEven" : "EitherNeighbour";
}
inline const auto kBothRoundings =
    testing::Values(Rounding::eitherNeighbour, Rounding::nearestEven);

}  // namespace gnomon::test

#endif
