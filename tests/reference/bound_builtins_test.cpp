// Known answers and domains of the built-ins.
//
// Covered: floor ceil trunc round roundEven fract sign step mod, mix and smoothstep at their ends,
// domains of every function, assumed exceptions, tests on bits.
// Not covered here: errors of the functions inside their domains (bound_soundness_test).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "reference/bound/builtins.h"

namespace gnomon {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kQuiet = std::numeric_limits<float>::quiet_NaN();

testing::AssertionResult is(const Bounded& x, double lo, double hi) {
  if (x.lo == lo && x.hi == hi) return testing::AssertionSuccess();
  return testing::AssertionFailure() << x << " should be [" << lo << ", " << hi << ']';
}

TEST(BoundFloor, IsExactInsideAStepAndAmbiguousAcross) {
  EXPECT_TRUE(is(floor(Bounded::between(1.25, 1.75)), 1, 1));
  EXPECT_FALSE(floor(Bounded::between(1.25, 1.75)).ambiguous());
  EXPECT_TRUE(is(floor(Bounded::between(0.75, 1.25)), 0, 1));
  EXPECT_TRUE(floor(Bounded::between(0.75, 1.25)).ambiguous());
  EXPECT_TRUE(is(ceil(Bounded::between(0.75, 1.25)), 1, 2));
  EXPECT_TRUE(is(trunc(Bounded::between(-0.75, 0.75)), 0, 0));
  EXPECT_FALSE(trunc(Bounded::between(-0.75, 0.75)).ambiguous());
}

TEST(BoundFloor, OfADenormalBelowZeroIsEitherMinusOneOrZero) {
  EXPECT_TRUE(is(floor(Bounded(-0x1p-140f)), -1, 0));
}

TEST(BoundRound, AtAHalfGoesEitherWay) {
  EXPECT_TRUE(is(round(Bounded(2.5f)), 2, 3));
  EXPECT_TRUE(round(Bounded(2.5f)).ambiguous());
  EXPECT_TRUE(is(round(Bounded(-2.5f)), -3, -2));
  EXPECT_TRUE(is(round(Bounded(2.25f)), 2, 2));
  EXPECT_TRUE(is(round(Bounded(0x1p23f - 0.5f)), 0x1p23 - 1, 0x1p23));  // the largest half
}

TEST(BoundRound, ToEvenIsCertain) {
  EXPECT_TRUE(is(roundEven(Bounded(2.5f)), 2, 2));
  EXPECT_TRUE(is(roundEven(Bounded(3.5f)), 4, 4));
}

// x - floor(x) = 1 - 2^-30 lies between the float below 1 and 1.
TEST(BoundFraction, OfATinyNegativeMayBeOne) {
  EXPECT_TRUE(is(fract(Bounded(-0x1p-30f)), 1 - 0x1p-24, 1));
  EXPECT_TRUE(is(fract(Bounded(-1.25f)), 0.75, 0.75));
  EXPECT_TRUE(is(fract(Bounded::between(0.75, 1.25)), 0, 1));
  EXPECT_TRUE(fract(Bounded::between(0.75, 1.25)).ambiguous());
}

TEST(BoundSign, AndStepAreAmbiguousOnlyAcrossTheirJump) {
  EXPECT_TRUE(is(sign(Bounded(-3)), -1, -1));
  EXPECT_TRUE(is(sign(Bounded(0)), 0, 0));
  EXPECT_TRUE(sign(Bounded::between(-1, 1)).ambiguous());
  EXPECT_TRUE(is(step(Bounded(1), Bounded(1)), 1, 1));
  EXPECT_TRUE(is(step(Bounded(1), Bounded(0)), 0, 0));
  EXPECT_TRUE(step(Bounded(1), Bounded::between(0, 2)).ambiguous());
}

// 5.5 / 2 = 2.75 is clear of an integer, 2 * 2 and 5.5 - 4 are exact. The specification itself
// notes that FMod(x, x) may be x: the quotient may be below 1. That is x away from 0, so by the
// rule of inherited precision -x conforms too.
TEST(BoundModulo, IsExactClearOfAnIntegerAndOpenAtOne) {
  EXPECT_TRUE(is(mod(Bounded(5.5f), Bounded(2)), 1.5, 1.5));
  EXPECT_FALSE(mod(Bounded(5.5f), Bounded(2)).ambiguous());
  const Bounded same = mod(Bounded(3), Bounded(3));
  EXPECT_TRUE(same.ambiguous());
  EXPECT_LE(same.lo, -3);
  EXPECT_GE(same.hi, 3);
  EXPECT_TRUE(mod(Bounded(1), Bounded(0)).unspecified());
}

// x (1 - 1) + y is y, but x + 1 (y - x) rounds: 0.1 - 1 needs more than 24 bits.
TEST(BoundMix, IsExactAtZeroButNotAtOne) {
  EXPECT_TRUE(is(mix(Bounded(1), Bounded(0.1f), 0), 1, 1));
  EXPECT_GT(mix(Bounded(1), Bounded(0.1f), 1).hi, 0.1f);
  EXPECT_TRUE(is(mix(Bounded(1), Bounded(3), 0.5f), 2, 2));
}

// Treating x and 1 - a, a as independent would give [0, 2] with 0.5 (x + y) for x = y = 1.
TEST(BoundMix, OfAnIntervalWeightStaysBetweenTheEnds) {
  const Bounded x = mix(Bounded(1), Bounded(1), Bounded::between(0, 1));
  // gamma_3 of the terms 1, 1 a and 1 a, each at most 1.
  const double error = rules().gamma(3) * 3 * (1 + 0x1p-10);
  EXPECT_NEAR(x.lo, 1, error);
  EXPECT_NEAR(x.hi, 1, error);
}

TEST(BoundSmoothstep, IsExactOutsideItsEdgesAndUnspecifiedForReversedOnes) {
  EXPECT_TRUE(is(smoothstep(Bounded(0), Bounded(1), Bounded(-1)), 0, 0));
  EXPECT_TRUE(is(smoothstep(Bounded(0), Bounded(1), Bounded(2)), 1, 1));
  EXPECT_TRUE(smoothstep(Bounded(1), Bounded(1), Bounded(2)).unspecified());
  EXPECT_TRUE(admits(smoothstep(Bounded(0), Bounded(1), 0.5f), 0.5f));
}

struct Outside {
  const char* name;
  Bounded (*bound)(const Bounded&);
  Operation operation;
  std::vector<float> outside, inside;
};

// The float nearest pi is 8.7e-8 above pi: an assumed exception counts it as inside.
constexpr float kPi = std::numbers::pi_v<float>;
const Outside kDomains[] = {
    {"sqrt", sqrt, Operation::sqrt, {-1, -0x1p-140f, kQuiet}, {0, -0.0f, 0x1p-140f, 1, kInf}},
    {"inversesqrt", inversesqrt, Operation::inverseSqrt, {-1, 0, 0x1p-140f}, {0x1p-126f, 1e38f}},
    {"log", log, Operation::log, {-1, 0, 0x1p-140f}, {0x1p-126f, 1}},
    {"log2", log2, Operation::log2, {-1, 0, 0x1p-140f}, {0x1p-126f, 1}},
    {"sin", sin, Operation::sin, {4, -4, kInf, kQuiet}, {kPi, -kPi, 0}},
    {"cos", cos, Operation::cos, {4, -4, kInf, kQuiet}, {kPi, -kPi, 0}},
    {"tan", tan, Operation::tan, {4, kPi / 2}, {1.5f, -3}},
    {"asin", asin, Operation::asin, {1.5f, -1.5f}, {1, -1, 0}},
    {"acos", acos, Operation::acos, {1.5f, -1.5f}, {1, -1, 0}},
    {"exp", exp, Operation::exp, {kQuiet}, {-200, 200, 0}},
    {"exp2", exp2, Operation::exp2, {kQuiet}, {-200, 200, 0}},
    {"atan", atan, Operation::atan, {kQuiet}, {0, 1e30f}},
};

TEST(BoundDomain, OutsideItAFunctionIsUnspecifiedAndSaysSo) {
  for (const auto& [name, bound, operation, outside, inside] : kDomains) {
    for (const float x : outside) {
      const Bounded got = bound(x);
      EXPECT_TRUE(got.unspecified() && got.mayBeNan() && got.lo == -kInf && got.hi == kInf)
          << name << '(' << x << ") = " << got;
      EXPECT_EQ(unspecifiedOperations(got.flags), std::vector{operation}) << name;
    }
    for (const float x : inside) EXPECT_FALSE(bound(x).unspecified()) << name << '(' << x << ')';
  }
}

TEST(BoundDomain, OfPowerIsNotNegativeAndZeroOnlyWithAPositiveExponent) {
  EXPECT_TRUE(is(pow(Bounded(0), 2.2f), 0, 0));
  EXPECT_TRUE(pow(Bounded(0), Bounded(0)).unspecified());
  EXPECT_TRUE(pow(Bounded(-1), Bounded(2)).unspecified());
  const Bounded nearZero = pow(Bounded::between(0, 0.25), 2);
  EXPECT_EQ(nearZero.lo, 0);
  EXPECT_NEAR(nearZero.hi, 0.0625, 0.0625 * 1e-3);
}

TEST(BoundAngle, IsUnspecifiedAtTheOriginAndOpenAcrossTheCut) {
  EXPECT_TRUE(atan2(Bounded(0), Bounded(0)).unspecified());
  const Bounded cut = atan2(Bounded(0), Bounded(-1));
  EXPECT_TRUE(cut.ambiguous());
  EXPECT_LE(cut.lo, -std::numbers::pi);
  EXPECT_GE(cut.hi, std::numbers::pi);
  EXPECT_TRUE(is(atan2(Bounded(0), Bounded(1)), 0, 0));
}

TEST(BoundException, ZerosThatAreAssumed) {
  EXPECT_TRUE(is(sqrt(Bounded(0)), 0, 0));
  EXPECT_TRUE(is(atan(Bounded(0)), 0, 0));
  EXPECT_EQ(exp(Bounded(-200)).lo, 0);
  EXPECT_GT(acos(Bounded(-1)).lo, 3);
}

TEST(BoundSine, AcrossItsExtremesReachesThem) {
  EXPECT_EQ(sin(Bounded::between(1, 2)).hi, floorToFloat(1 + 0x1p-11));
  EXPECT_EQ(cos(Bounded::between(-1, 1)).hi, floorToFloat(1 + 0x1p-11));
  EXPECT_EQ(sin(Bounded::between(-2, -1)).lo, ceilToFloat(-1 - 0x1p-11));
}

// exp2(0) = 1 exactly, 3 ULP of 2^-24 on either side, of which below 1 three are floats and above
// one (the floats there are 2^-23 apart).
TEST(BoundExponential, OfZeroIsWithinThreeOfTheSmallerUlp) {
  EXPECT_TRUE(is(exp2(Bounded(0)), 1 - 3 * 0x1p-24, 1 + 0x1p-23));
  EXPECT_TRUE(is(exp(Bounded(0)), 1 - 3 * 0x1p-24, 1 + 0x1p-23));
  EXPECT_TRUE(is(inversesqrt(Bounded(4)), 0.5 - 2 * 0x1p-25, 0.5 + 0x1p-24));
  EXPECT_TRUE(is(log2(Bounded(1)), -0x1p-21, 0x1p-21));
}

TEST(BoundExponential, BeyondTheLargestFloatIsThatOrInfinity) {
  const Bounded x = exp(Bounded(200));
  EXPECT_TRUE(is(x, kMaxFloat, kInfinity));
  EXPECT_FALSE(x.mayBeNan());
}

TEST(BoundBits, AreTestedExactly) {
  EXPECT_TRUE(certainly(isFinite(Bounded(1))));
  EXPECT_FALSE(possibly(isFinite(Bounded(kInf))));
  EXPECT_TRUE(isFinite(Bounded::between(0, kInfinity)).undecided());
  EXPECT_TRUE(certainly(isInf(Bounded(-kInf))));
  EXPECT_FALSE(possibly(isNan(Bounded(1))));
  EXPECT_TRUE(isNan(Bounded(kQuiet)).undecided());
}

}  // namespace
}  // namespace gnomon
