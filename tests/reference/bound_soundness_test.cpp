// Bounds of single operations against MPFR, on seeded random arguments.
//
// Covered: + - * / fma, conversions of integers, the built-ins with an error in ULP or absolute,
// on points and on intervals, under both roundings. Sound: every permitted result is inside. Tight:
// for most points nothing else is, and never more than a small multiple.
// Not covered here: inherited formulas (bound_inherited_test), exact built-ins and special values
// (bound_builtins_test), sums (bound_sum_test).
#include "tests/reference/bound_random.h"

namespace gnomon::test {
namespace {

class BoundRounded : public EachRounding {};
INSTANTIATE_TEST_SUITE_P(Bound, BoundRounded, kBothRoundings, roundingName);

// "Correctly rounded": the two floats around z, or the nearest even one.
Floats roundings(mpfr_ptr z, Rounding rounding) {
  if (rounding == Rounding::nearestEven) {
    const float nearest = mpfr_get_flt(z, MPFR_RNDN);
    return {nearest, nearest};
  }
  return {mpfr_get_flt(z, MPFR_RNDD), mpfr_get_flt(z, MPFR_RNDU)};
}

// MPFR's exponent e says 2^(e-1) <= |z| < 2^e.
bool inDenormalRange(mpfr_ptr z) { return mpfr_zero_p(z) == 0 && mpfr_get_exp(z) <= -126; }

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

// The bound of two points is exactly what MPFR's roundings and the permission to flush leave.
TEST_P(BoundRounded, SumDifferenceAndProductOfPointsAreExactlyTheRoundingsOfTheExactResult) {
  for (const auto& [name, exact, bound] : kRoundedOperations) {
    Arguments arguments(1);
    Real z;
    for (int i = 0; i < kRandomArguments; ++i) {
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
TEST_P(BoundRounded, SumDifferenceAndProductOfIntervalsHoldAllResults) {
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
TEST_P(BoundRounded, FmaHoldsFusedAndSeparateResultsAndLittleElse) {
  Arguments arguments(3);
  Real exact, twice;
  for (int i = 0; i < kRandomArguments; ++i) {
    const float a = arguments.any(), b = arguments.any();
    const float c = i % 2 == 0 ? arguments.any() : arguments.near(a * b);
    const Bounded got = fma(Bounded(a), b, c);
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
    const double allowed = 2 * rules().gamma(2) * terms * (1 + 0x1p-19);
    ASSERT_LE(got.hi - got.lo, allowed + 0x1p-120) << a << ' ' << b << ' ' << c << ": " << got;
  }
}

TEST_P(BoundRounded, IntegersConvertToTheFloatsAroundThem) {
  Arguments arguments(4);
  Real z;
  for (int i = 0; i < kRandomArguments; ++i) {
    const auto x = static_cast<std::int32_t>(arguments.below(0xffffffffU)) >> arguments.below(31);
    mpfr_set_si(z, x, MPFR_RNDN);
    const Floats expected = roundings(z, GetParam());
    const Bounded got = x;
    ASSERT_TRUE(got.lo == expected.low && got.hi == expected.high) << x << ": " << got;
  }
}

// ---- errors in ULP and absolute ----

// The floats within max(ulp * ulp(z), absolute) of z; the largest float's neighbour is infinity,
// no error in ULP changes a sign (an assumed exception, see rules.h), and denormals may be flushed.
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
  if (inDenormalRange(z)) return {std::min(low, 0.0f), std::max(high, 0.0f)};
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
    {"inversesqrt", inversesqrt, mpfr_rec_sqrt, kMin, kMax, true,
     [](double) {
       return Specified{2, 0};
     }},
    {"exp", exp, mpfr_exp, -110, 90, false, expError},
    {"exp2", exp2, mpfr_exp2, -155, 130, false, expError},
    {"log", log, mpfr_log, kMin, kMax, true, logError},
    {"log near 1", log, mpfr_log, 0.25f, 4, false, logError},
    {"log2", log2, mpfr_log2, kMin, kMax, true, logError},
    {"log2 near 1", log2, mpfr_log2, 0.25f, 4, false, logError},
    {"sin", sin, mpfr_sin, -3.14159250f, 3.14159250f, false, sineError},
    {"cos", cos, mpfr_cos, -3.14159250f, 3.14159250f, false, sineError},
    {"atan", atan, arcTangent, kMin, kMax, true,
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
  constexpr int kCount = kRandomArguments;
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
  constexpr int kCount = kRandomArguments;
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
  for (int i = 0; i < kRandomArguments; ++i) {
    const float b = divisorOf(arguments), a = i % 2 == 0 ? arguments.near(b) : divisorOf(arguments);
    if (isDenormal(a)) continue;
    mpfr_set_flt(z, a, MPFR_RNDN);
    mpfr_set_flt(x, b, MPFR_RNDN);
    mpfr_atan2(z, z, x, MPFR_RNDN);
    const Floats expected = permitted(z, 4096, 0);
    const Bounded got = atan2(Bounded(a), b);
    ASSERT_TRUE(got.lo <= expected.low && expected.high <= got.hi) << a << ' ' << b << ": " << got;
    ASSERT_LE(got.hi - got.lo, 2.01 * (static_cast<double>(expected.high) - expected.low) + kMin);
  }
}

}  // namespace
}  // namespace gnomon::test
