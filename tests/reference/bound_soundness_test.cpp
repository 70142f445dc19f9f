// Bounds of single operations against MPFR, on seeded random arguments.
//
// Covered: + - * / fma, conversions of integers, the built-ins with an error in ULP or absolute,
// those inherited from a formula (the formula is evaluated with every part at its worst), on points
// and on intervals, under both roundings. Sound: every permitted result is inside. Tight: for most
// points nothing else is, and never more than a small multiple.
// Not covered here: exact built-ins and special values (bound_builtins_test), sums
// (bound_sum_test).
#include <gtest/gtest.h>
#include <mpfr.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "reference/bound/builtins.h"

namespace {

using gnomon::Bounded;
using gnomon::Rounding;
using gnomon::Rules;
using gnomon::UseRules;

constexpr float kMax = std::numeric_limits<float>::max();
constexpr float kMin = std::numeric_limits<float>::min();
constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
constexpr float kInf = std::numeric_limits<float>::infinity();

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

bool isDenormal(float x) { return x != 0 && std::abs(x) < kMin; }

// "Correctly rounded": the two floats around z, or the nearest even one.
Floats roundings(mpfr_ptr z, Rounding rounding) {
  if (rounding == Rounding::nearestEven) {
    const float nearest = mpfr_get_flt(z, MPFR_RNDN);
    return {nearest, nearest};
  }
  return {mpfr_get_flt(z, MPFR_RNDD), mpfr_get_flt(z, MPFR_RNDU)};
}

bool inDenormalRange(mpfr_ptr z) {
  return mpfr_zero_p(z) == 0 && mpfr_cmpabs(z, [] {
                                  static thread_local Real least(24);
                                  mpfr_set_flt(least, kMin, MPFR_RNDN);
                                  return static_cast<mpfr_ptr>(least);
                                }()) < 0;
}

using ExactOperation = void (*)(mpfr_ptr, float, float, float);
using BoundedOperation = Bounded (*)(const Bounded&, const Bounded&, const Bounded&);

void exactSum(mpfr_ptr z, float a, float b, float) {
  mpfr_set_flt(z, a, MPFR_RNDN);
  mpfr_add_d(z, z, b, MPFR_RNDN);
}
void exactDifference(mpfr_ptr z, float a, float b, float) { exactSum(z, a, -b, 0); }
void exactProduct(mpfr_ptr z, float a, float b, float) {
  mpfr_set_flt(z, a, MPFR_RNDN);
  mpfr_mul_d(z, z, b, MPFR_RNDN);
}

struct RoundedOperation {
  const char* name;
  ExactOperation exact;
  BoundedOperation bound;
};
const RoundedOperation kRoundedOperations[] = {
    {"sum", exactSum, [](auto& a, auto& b, auto&) { return a + b; }},
    {"difference", exactDifference, [](auto& a, auto& b, auto&) { return a - b; }},
    {"product", exactProduct, [](auto& a, auto& b, auto&) { return a * b; }},
};

class EachRounding : public testing::TestWithParam<Rounding> {
 protected:
  const Rules rules_ = Rules::specification(GetParam());
  const UseRules use_{rules_};
};
INSTANTIATE_TEST_SUITE_P(Bound, EachRounding,
                         testing::Values(Rounding::eitherNeighbour, Rounding::nearestEven),
                         [](const auto& tested) {
                           return tested.param == Rounding::nearestEven ? "NearestEven"
                                                                        : "EitherNeighbour";
                         });

// The bound of two points is exactly what MPFR's roundings and the permission to flush leave.
TEST_P(EachRounding, SumDifferenceAndProductOfPointsAreExactlyTheRoundingsOfTheExactResult) {
  for (const auto& [name, exact, bound] : kRoundedOperations) {
    Arguments arguments(1);
    Real z;
    for (int i = 0; i < 1000000; ++i) {
      const float a = arguments.any(), b = i % 4 == 0 ? arguments.near(a) : arguments.any();
      const Bounded got = bound(a, b, a);
      exact(z, a, b, a);
      const Floats expected = roundings(z, GetParam());
      const double low = inDenormalRange(z) ? std::min(expected.low, 0.0f) : expected.low;
      const double high = inDenormalRange(z) ? std::max(expected.high, 0.0f) : expected.high;
      const bool inside = got.lo <= low && high <= got.hi;
      const bool tight = isDenormal(a) || isDenormal(b) || (got.lo == low && got.hi == high);
      ASSERT_TRUE(inside && tight) << name << ' ' << a << ' ' << b << ": " << got << ", MPFR ["
                                   << low << ", " << high << ']';
    }
  }
}

// Whatever floats are in the operands, flushed or not, their roundings are in the result.
TEST_P(EachRounding, SumDifferenceAndProductOfIntervalsHoldAllResults) {
  for (const auto& [name, exact, bound] : kRoundedOperations) {
    Arguments arguments(2);
    Real z;
    for (int i = 0; i < 250000; ++i) {
      const auto [a0, a1] = std::minmax({arguments.any(), arguments.any()});
      const float near = arguments.near(a0);
      const auto [b0, b1] =
          std::minmax({near, i % 2 == 0 ? arguments.near(near) : arguments.any()});
      const Bounded got = bound(Bounded::between(a0, a1), Bounded::between(b0, b1), 0);
      for (int sample = 0; sample < 4; ++sample) {
        const float a = arguments.within(a0, a1), b = arguments.within(b0, b1);
        exact(z, a, b, 0);
        const Floats expected = roundings(z, GetParam());
        ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi)
            << name << ' ' << a << ' ' << b << ": " << got;
        exact(z, isDenormal(a) ? 0 : a, isDenormal(b) ? 0 : b, 0);
        if (!inDenormalRange(z)) continue;
        ASSERT_TRUE(got.lo <= 0 && 0 <= got.hi) << name << ' ' << a << ' ' << b << ": " << got;
      }
    }
  }
}

// fma is inherited from a product and a sum: the fused result and the one rounded twice, and
// nothing farther from the exact result than gamma_2 (|a b| + |c|) and a float.
TEST_P(EachRounding, FmaHoldsFusedAndSeparateResultsAndLittleElse) {
  Arguments arguments(3);
  Real exact, twice;
  for (int i = 0; i < 500000; ++i) {
    const float a = arguments.any(), b = arguments.any();
    const float c = i % 2 == 0 ? arguments.any() : arguments.near(a * b);
    const Bounded got = gnomon::fma(Bounded(a), b, c);
    if (!std::isfinite(c) || got.mayBeNan()) continue;
    exactProduct(exact, a, b, 0);
    const Floats products = roundings(exact, GetParam());
    mpfr_add_d(exact, exact, c, MPFR_RNDN);
    const Floats fused = roundings(exact, GetParam());
    ASSERT_TRUE(got.lo <= fused.low && fused.high <= got.hi) << a << ' ' << b << ' ' << c << got;
    for (const float product : {products.low, products.high}) {
      if (!std::isfinite(product)) continue;
      exactSum(twice, product, c, 0);
      const Floats separate = roundings(twice, GetParam());
      ASSERT_TRUE(got.lo <= separate.low && separate.high <= got.hi)
          << a << ' ' << b << ' ' << c << ": " << got;
    }
    const double terms = std::abs(static_cast<double>(a) * b) + std::abs(static_cast<double>(c));
    if (isDenormal(a) || isDenormal(b) || !(terms > 0x1p-100 && terms < 0x1p100)) continue;
    const double allowed = 2 * gnomon::rules().gamma(2) * terms * (1 + 0x1p-19);
    ASSERT_LE(got.hi - got.lo, allowed + 0x1p-120) << a << ' ' << b << ' ' << c << ": " << got;
  }
}

TEST_P(EachRounding, IntegersConvertToTheFloatsAroundThem) {
  Arguments arguments(4);
  Real z;
  for (int i = 0; i < 100000; ++i) {
    const auto x = static_cast<std::int32_t>(arguments.below(0xffffffffU)) >> arguments.below(31);
    mpfr_set_si(z, x, MPFR_RNDN);
    const Floats expected = roundings(z, GetParam());
    const Bounded got = x;
    ASSERT_TRUE(got.lo == expected.low && got.hi == expected.high) << x << ": " << got;
  }
}

// ---- errors in ULP and absolute ----

// ulp(x) by the specification's definition: the smallest distance of floats a <= x <= b, a != b.
double specifiedUlp(mpfr_ptr z) {
  const float below = mpfr_get_flt(z, MPFR_RNDD), above = mpfr_get_flt(z, MPFR_RNDU);
  if (below != above)
    return std::isinf(above) || std::isinf(below) ? 0x1p104 : static_cast<double>(above) - below;
  return std::min(static_cast<double>(below) - std::nextafter(below, -kInf),
                  static_cast<double>(std::nextafter(below, kInf)) - below);
}

// The floats within max(ulp * ulp(z), absolute) of z; the largest float's neighbour is infinity,
// and no error in ULP changes a sign (an assumed exception, see rules.h).
Floats permitted(mpfr_ptr z, double ulp, double absolute) {
  static thread_local Real end;
  const double error = std::max(ulp * specifiedUlp(z), absolute);
  mpfr_sub_d(end, z, error, MPFR_RNDN);
  float low =
      mpfr_cmp_d(end, -static_cast<double>(kMax)) < 0 ? -kInf : mpfr_get_flt(end, MPFR_RNDU);
  mpfr_add_d(end, z, error, MPFR_RNDN);
  float high = mpfr_cmp_d(end, kMax) > 0 ? kInf : mpfr_get_flt(end, MPFR_RNDD);
  if (low == kInf) low = kMax;
  if (high == -kInf) high = -kMax;
  if (absolute == 0 && mpfr_sgn(z) >= 0) low = std::max(low, 0.0f);
  if (absolute == 0 && mpfr_sgn(z) <= 0) high = std::min(high, 0.0f);
  return {low, high};
}

struct Specified {
  double ulp, absolute;
};
struct Function {
  const char* name;
  Bounded (*bound)(const Bounded&);
  int (*exact)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
  float lo, hi;     // arguments, spread evenly
  bool magnitudes;  // ... or by magnitude
  Specified (*error)(double x);
};

int arcTangent(mpfr_ptr z, mpfr_srcptr x, mpfr_rnd_t mode) { return mpfr_atan(z, x, mode); }
Specified expError(double x) { return {3 + 2 * std::abs(x), 0}; }
Specified logError(double x) {
  return x >= 0.5 && x <= 2 ? Specified{0, 0x1p-21} : Specified{3, 0};
}
Specified sineError(double) { return {0, 0x1p-11}; }

// Domains: exp and exp2 from where they vanish to where they overflow, ln(2^128) = 88.7; the float
// below pi.
const Function kFunctions[] = {
    {"inversesqrt", gnomon::inversesqrt, mpfr_rec_sqrt, kMin, kMax, true,
     [](double) {
       return Specified{2, 0};
     }},
    {"exp", gnomon::exp, mpfr_exp, -110, 90, false, expError},
    {"exp2", gnomon::exp2, mpfr_exp2, -155, 130, false, expError},
    {"log", gnomon::log, mpfr_log, kMin, kMax, true, logError},
    {"log near 1", gnomon::log, mpfr_log, 0.25f, 4, false, logError},
    {"log2", gnomon::log2, mpfr_log2, kMin, kMax, true, logError},
    {"log2 near 1", gnomon::log2, mpfr_log2, 0.25f, 4, false, logError},
    {"sin", gnomon::sin, mpfr_sin, -3.14159250f, 3.14159250f, false, sineError},
    {"cos", gnomon::cos, mpfr_cos, -3.14159250f, 3.14159250f, false, sineError},
    {"atan", gnomon::atan, arcTangent, kMin, kMax, true,
     [](double) {
       return Specified{4096, 0};
     }},
};

// Every eighth argument is an integer or a power of two, where results are exact.
float argumentOf(const Function& f, Arguments& arguments) {
  const double lo = std::log2(f.lo), hi = std::log2(f.hi);
  const float x = f.magnitudes ? static_cast<float>(std::exp2(arguments.within(
                                     static_cast<float>(lo), static_cast<float>(hi))))
                               : arguments.within(f.lo, f.hi);
  if (arguments.below(8) != 0) return std::clamp(x, f.lo, f.hi);
  const float round = f.magnitudes ? std::exp2(std::round(std::log2(x))) : std::round(x);
  return std::clamp(round, f.lo, f.hi);
}

// 160 bits: 24 of a float, 100 more than any function here comes near a midpoint, and the error.
constexpr mpfr_prec_t kBits = 160;

TEST(BoundFunctions, OfPointsHoldThePermittedResultsAndMostlyNothingElse) {
  constexpr int kCount = 150000;
  for (const Function& f : kFunctions) {
    Arguments arguments(5);
    Real x(24), z(kBits);
    int tightly = 0;
    double worst = 0;
    for (int i = 0; i < kCount; ++i) {
      const float at = argumentOf(f, arguments);
      mpfr_set_flt(x, at, MPFR_RNDN);
      f.exact(z, x, MPFR_RNDN);
      const auto [ulp, absolute] = f.error(at);
      const Floats expected = permitted(z, ulp, absolute);
      const Bounded got = f.bound(at);
      ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi)
          << f.name << '(' << at << "): " << got << ", permitted [" << expected.low << ", "
          << expected.high << ']';
      // One float more where the permitted end is a float to within double's own error; denormals
      // may be flushed besides.
      const bool tight =
          (got.lo >= std::nextafter(expected.low, -kInf) || isDenormal(expected.low)) &&
          (got.hi <= std::nextafter(expected.high, kInf) || isDenormal(expected.high));
      tightly += tight;
      const double size = static_cast<double>(expected.high) - expected.low;
      if (size > kMin && size < kMax) worst = std::max(worst, (got.hi - got.lo) / size);
    }
    // Next to a power of two double cannot tell which ulp applies and takes the larger: twice the
    // width. An eighth of the arguments is there for atan, since atan(x) is nearly x.
    EXPECT_GE(tightly, kCount * 0.87) << f.name;
    EXPECT_LE(worst, 2.01) << f.name;
  }
}

TEST(BoundFunctions, OfIntervalsHoldThePermittedResultsOfEveryPointInside) {
  for (const Function& f : kFunctions) {
    Arguments arguments(6);
    Real x(24), z(kBits);
    for (int i = 0; i < 30000; ++i) {
      const float first = argumentOf(f, arguments);
      const float near = std::clamp(arguments.near(first), f.lo, f.hi);
      const auto [lo, hi] = std::minmax({first, i % 2 == 0 ? near : argumentOf(f, arguments)});
      const Bounded got = f.bound(Bounded::between(lo, hi));
      for (const float at : {lo, arguments.within(lo, hi), arguments.within(lo, hi)}) {
        mpfr_set_flt(x, at, MPFR_RNDN);
        f.exact(z, x, MPFR_RNDN);
        const auto [ulp, absolute] = f.error(at);
        const Floats expected = permitted(z, ulp, absolute);
        ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi)
            << f.name << '(' << at << ") in [" << lo << ", " << hi << "]: " << got;
      }
    }
  }
}

float divisorOf(Arguments& arguments) {
  for (;;)
    if (const float b = arguments.any(); std::abs(b) >= kMin && std::abs(b) <= 0x1p126f) return b;
}

TEST(BoundDivision, OfPointsHoldsThePermittedResultsAndAlmostAlwaysNothingElse) {
  constexpr int kCount = 1000000;
  Arguments arguments(7);
  Real z(kBits);
  int exactlyPermitted = 0;
  for (int i = 0; i < kCount; ++i) {
    const float b = divisorOf(arguments), a = i % 4 == 0 ? arguments.near(b) : arguments.any();
    mpfr_set_flt(z, a, MPFR_RNDN);
    mpfr_div_d(z, z, b, MPFR_RNDN);
    const Floats expected = permitted(z, 2.5, 0);
    const Bounded got = Bounded(a) / b;
    ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi)
        << a << " / " << b << ": " << got;
    const bool denormal = isDenormal(a) || isDenormal(expected.low) || isDenormal(expected.high);
    exactlyPermitted += denormal || (got.lo == expected.low && got.hi == expected.high);
  }
  EXPECT_GE(exactlyPermitted, kCount * 0.999);
}

TEST(BoundDivision, OfIntervalsHoldsThePermittedResultsOfEveryPointInside) {
  Arguments arguments(8);
  Real z(kBits);
  for (int i = 0; i < 200000; ++i) {
    const float b0 = divisorOf(arguments);
    const auto [lo, hi] = std::minmax({b0, std::abs(arguments.near(b0)) * (b0 < 0 ? -1 : 1)});
    if (std::abs(lo) < kMin || std::abs(hi) < kMin || std::abs(lo) > 0x1p126f || hi > 0x1p126f)
      continue;
    const auto [a0, a1] = std::minmax({arguments.any(), arguments.any()});
    const Bounded got = Bounded::between(a0, a1) / Bounded::between(lo, hi);
    for (int sample = 0; sample < 4; ++sample) {
      const float a = arguments.within(a0, a1), b = arguments.within(lo, hi);
      mpfr_set_flt(z, a, MPFR_RNDN);
      mpfr_div_d(z, z, b, MPFR_RNDN);
      const Floats expected = permitted(z, 2.5, 0);
      ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi)
          << a << " / " << b << ": " << got;
    }
  }
}

TEST(BoundAtan2, HoldsThePermittedResultsInEveryQuadrant) {
  Arguments arguments(9);
  Real z(kBits), x(24);
  for (int i = 0; i < 100000; ++i) {
    const float b = divisorOf(arguments), a = i % 2 == 0 ? arguments.near(b) : divisorOf(arguments);
    if (isDenormal(a)) continue;
    mpfr_set_flt(z, a, MPFR_RNDN);
    mpfr_set_flt(x, b, MPFR_RNDN);
    mpfr_atan2(z, z, x, MPFR_RNDN);
    const Floats expected = permitted(z, 4096, 0);
    const Bounded got = gnomon::atan2(Bounded(a), b);
    ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi) << a << ' ' << b << ": " << got;
    ASSERT_LE(got.hi - got.lo, 2.01 * (static_cast<double>(expected.high) - expected.low) + kMin);
  }
}

// ---- inherited formulas, with each part as bad as it may be ----

// Parts are evaluated in double, whose own error (2^-53) is far below a float's; a part's result is
// one of the floats its rule permits.
class Formula {
 public:
  explicit Formula(Arguments& arguments) : arguments_(arguments) {}

  double rounded(double x) { return pick(x, 0, 0); }
  double ulps(double x, double n) { return pick(x, n, 0); }
  double absolute(double x, double e) { return pick(x, 0, e); }
  double either(double a, double b) { return arguments_.below(2) == 0 ? a : b; }

 private:
  // The lowest, the highest or the nearest float that is permitted.
  double pick(double x, double n, double e) {
    if (n == 0 && e == 0 && gnomon::rules().rounding == Rounding::nearestEven)
      return static_cast<float>(x);
    const double error = std::max(n * ulp(x), e);
    switch (arguments_.below(3)) {
      case 0:
        return error == 0 ? gnomon::floorToFloat(x) : gnomon::ceilToFloat(x - error);
      case 1:
        return error == 0 ? gnomon::ceilToFloat(x) : gnomon::floorToFloat(x + error);
      default:
        return static_cast<float>(x);
    }
  }
  static double ulp(double x) {
    static thread_local Real z(53);
    mpfr_set_d(z, x, MPFR_RNDN);
    return specifiedUlp(z);
  }
  Arguments& arguments_;
};

struct Inherited {
  const char* name;
  Bounded (*bound)(const Bounded&, const Bounded&);
  double (*exact)(double, double);
  double (*formula)(Formula&, double, double);
  float loX, hiX, loY, hiY;
  double terms;      // how much of |x| + |y| the formula adds up, where that exceeds its result
  double looseness;  // the widest bound allowed, in units of the worst that was seen
};

double formulaSqrt(Formula& f, double x) {
  return x == 0 ? 0 : f.ulps(1 / f.ulps(1 / std::sqrt(x), 2), 2.5);
}
double formulaComplement(Formula& f, double x) {
  return formulaSqrt(f, f.rounded(1 - f.rounded(x * x)));
}

// Samples do not find the worst of all parts together, and a bound relative to the result is up to
// twice the ULP it stands for; hence a looseness of 2.5, 4 where three or more parts meet, and 8
// for smoothstep, which near its lower edge squares what t has lost.
const Inherited kInherited[] = {
    {"sqrt", [](auto& x, auto&) { return gnomon::sqrt(x); },
     [](double x, double) { return std::sqrt(x); },
     [](Formula& f, double x, double) { return formulaSqrt(f, x); }, 1e-30f, 1e30f, 0, 1, 0, 2.5},
    {"pow", [](auto& x, auto& y) { return gnomon::pow(x, y); },
     [](double x, double y) { return std::pow(x, y); },
     [](Formula& f, double x, double y) {
       const double log =
           x < 0.5 || x > 2 ? f.ulps(std::log2(x), 3) : f.absolute(std::log2(x), 0x1p-21);
       const double p = f.rounded(y * log);
       return f.ulps(std::exp2(p), 3 + 2 * std::abs(p));
     },
     0.01f, 100, -5, 5, 0, 4},
    {"tan", [](auto& x, auto&) { return gnomon::tan(x); },
     [](double x, double) { return std::tan(x); },
     [](Formula& f, double x, double) {
       return f.ulps(f.absolute(std::sin(x), 0x1p-11) / f.absolute(std::cos(x), 0x1p-11), 2.5);
     },
     -1.5f, 1.5f, 0, 1, 0, 2.5},
    {"asin", [](auto& x, auto&) { return gnomon::asin(x); },
     [](double x, double) { return std::asin(x); },
     [](Formula& f, double x, double) {
       return f.ulps(std::atan2(x, formulaComplement(f, x)), 4096);
     },
     -1, 1, 0, 1, 0, 4},
    {"acos", [](auto& x, auto&) { return gnomon::acos(x); },
     [](double x, double) { return std::acos(x); },
     [](Formula& f, double x, double) {
       return f.ulps(std::atan2(formulaComplement(f, x), x), 4096);
     },
     -1, 1, 0, 1, 0, 4},
    {"mix", [](auto& x, auto& y) { return gnomon::mix(x, y, 0.3f); },
     [](double x, double y) { return x + (y - x) * 0.3f; },
     [](Formula& f, double x, double y) {
       const double a = 0.3f;
       return f.rounded(f.rounded(x * f.rounded(1 - a)) + f.rounded(y * a));
     },
     -2, 2, -2, 2, 1, 4},
    {"mix, distributed", [](auto& x, auto& y) { return gnomon::mix(x, y, 0.3f); },
     [](double x, double y) { return x + (y - x) * 0.3f; },
     [](Formula& f, double x, double y) {
       return f.rounded(x + f.rounded(f.rounded(y - x) * 0.3f));
     },
     -2, 2, -2, 2, 1, 4},
    {"smoothstep", [](auto& x, auto& y) { return gnomon::smoothstep(0.25f, y, x); },
     [](double x, double y) { return gnomon::smoothstep(0.25f, y, x); },
     [](Formula& f, double x, double y) {
       const double d = f.rounded(y - 0.25);
       const double together = f.ulps(f.rounded(x - 0.25) / d, 2.5);
       const double apart = f.rounded(f.ulps(x / d, 2.5) - f.ulps(0.25 / d, 2.5));
       const double t = std::clamp(f.either(together, apart), 0.0, 1.0);
       const double square = f.rounded(t * t);
       const double cube = f.rounded(square * t);
       return f.either(f.rounded(square * f.rounded(3 - 2 * t)),
                       f.rounded(f.rounded(3 * square) - 2 * cube));
     },
     0, 1.5f, 0.5f, 1.5f, 0, 8},
};

// The specification lets a result lie on either side of x as far as the worst form does on one.
TEST_P(EachRounding, InheritedOperationsHoldTheirFormulasAtTheirWorstAndLittleElse) {
  for (const Inherited& tested : kInherited) {
    Arguments arguments(10);
    Formula formula(arguments);
    double loosest = 0;
    for (int i = 0; i < 4000; ++i) {
      const float x = arguments.within(tested.loX, tested.hiX);
      const float y = arguments.within(tested.loY, tested.hiY);
      const Bounded got = tested.bound(x, y);
      const double exact = tested.exact(x, y);
      double worst = 0;
      for (int sample = 0; sample < 40; ++sample)
        worst = std::max(worst, std::abs(tested.formula(formula, x, y) - exact));
      ASSERT_LE(got.lo, gnomon::ceilToFloat(exact - worst * (1 - 0x1p-25)))
          << tested.name << ' ' << x << ' ' << y << got;
      ASSERT_GE(got.hi, gnomon::floorToFloat(exact + worst * (1 - 0x1p-25)))
          << tested.name << ' ' << x << ' ' << y << got;
      // Where rounding happens to be kind to all samples their ratio would say nothing.
      const double kind =
          gnomon::rules().unitRoundoff() * tested.terms * (std::abs(x) + std::abs(y));
      const double half = std::max({worst, kind, 4 * gnomon::spacing(exact)});
      loosest = std::max(loosest, (got.hi - got.lo) / (2 * half));
    }
    EXPECT_LE(loosest, tested.looseness) << tested.name;
  }
}

TEST_P(EachRounding, InheritedOperationsOfIntervalsHoldThoseOfEveryPointInside) {
  for (const Inherited& tested : kInherited) {
    Arguments arguments(11);
    for (int i = 0; i < 10000; ++i) {
      const auto [x0, x1] = std::minmax(
          {arguments.within(tested.loX, tested.hiX), arguments.within(tested.loX, tested.hiX)});
      const auto [y0, y1] = std::minmax(
          {arguments.within(tested.loY, tested.hiY), arguments.within(tested.loY, tested.hiY)});
      const Bounded got = tested.bound(Bounded::between(x0, x1), Bounded::between(y0, y1));
      for (int sample = 0; sample < 4; ++sample) {
        const float x = arguments.within(x0, x1), y = arguments.within(y0, y1);
        const Bounded point = tested.bound(x, y);
        ASSERT_TRUE(got.lo <= point.lo && point.hi <= got.hi)
            << tested.name << ' ' << x << ' ' << y << ": " << point << " in " << got;
      }
    }
  }
}

TEST(BoundModulo, HoldsTheFormulaWithItsQuotientRoundedEitherWay) {
  Arguments arguments(12);
  Formula formula(arguments);
  for (int i = 0; i < 100000; ++i) {
    const float y = arguments.within(0.1f, 4);
    const float x =
        i % 2 == 0 ? y * static_cast<float>(arguments.below(50)) : arguments.within(-50, 50);
    const Bounded got = gnomon::mod(Bounded(x), y);
    // 0 / y = 0 is an assumed exception.
    const double whole = x == 0 ? 0 : std::floor(formula.ulps(static_cast<double>(x) / y, 2.5));
    const double result = formula.rounded(x - formula.rounded(y * whole));
    ASSERT_TRUE(got.lo <= result && result <= got.hi) << x << " mod " << y << ": " << got;
  }
}

}  // namespace
