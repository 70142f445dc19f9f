// Known answers for rounding, zeros, denormals, infinities, NaN and choices.
//
// Covered: + - * /, literals, inputs, named intermediates, comparisons, min max clamp abs, select,
// Decision, the judge's admits(), Rules. Not covered here: random soundness (bound_soundness_test).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "reference/bound/builtins.h"

namespace gnomon {
namespace {

constexpr float kMax = std::numeric_limits<float>::max();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kQuiet = std::numeric_limits<float>::quiet_NaN();
constexpr float kMin = std::numeric_limits<float>::min();

double before(double x) { return std::nextafter(static_cast<float>(x), -kInf); }
double after(double x) { return std::nextafter(static_cast<float>(x), kInf); }

testing::AssertionResult is(const Bounded& x, double lo, double hi) {
  if (x.lo == lo && x.hi == hi) return testing::AssertionSuccess();
  return testing::AssertionFailure() << x << " should be [" << lo << ", " << hi << ']';
}
testing::AssertionResult isEverything(const Bounded& x) {
  if (x.mayBeNan()) return is(x, -kInfinity, kInfinity);
  return testing::AssertionFailure() << x << " should be everything";
}

const Rules kNearest = Rules::specification(Rounding::nearestEven);

TEST(BoundSum, ExactStaysExact) {
  EXPECT_TRUE(is(Bounded(0.25f) + 0.5f, 0.75, 0.75));
  EXPECT_TRUE(is(Bounded(1) - 1, 0, 0));
  EXPECT_TRUE(is(Bounded(kMax) - kMax, 0, 0));
}

// The exact result lies strictly between 1 and the float below it, however close to 1: a double's
// sum would call it exact.
TEST(BoundSum, OfOneAndATinyNegativeIsOneOrTheFloatBelow) {
  EXPECT_TRUE(is(Bounded(1) + -0x1p-80f, before(1), 1));
  EXPECT_TRUE(is(Bounded(1) + 0x1p-80f, 1, after(1)));
  EXPECT_TRUE(is(Bounded(-1) + 0x1p-80f, -1, -before(1)));
  const UseRules use(kNearest);
  EXPECT_TRUE(is(Bounded(1) + -0x1p-80f, 1, 1));
}

// 1 + 2^-24 is the midpoint of 1 and 1 + 2^-23; 1 has the even mantissa. With 1 + 2^-23 the even
// neighbour is the one above.
TEST(BoundSum, OfAMidpointGoesToEvenIfDeclaredElseEitherWay) {
  EXPECT_TRUE(is(Bounded(1) + 0x1p-24f, 1, after(1)));
  const UseRules use(kNearest);
  EXPECT_TRUE(is(Bounded(1) + 0x1p-24f, 1, 1));
  EXPECT_TRUE(is(Bounded(1 + 0x1p-23f) + 0x1p-24f, 1 + 0x1p-22, 1 + 0x1p-22));
}

// IEEE 754: to nearest, half a step (2^103) above the largest float is where infinity begins.
TEST(BoundSum, BeyondTheLargestFloatIsThatOrInfinity) {
  EXPECT_TRUE(is(Bounded(kMax) + 0x1p60f, kMax, kInfinity));
  EXPECT_TRUE(is(Bounded(-kMax) - 0x1p60f, -kInfinity, -kMax));
  const UseRules use(kNearest);
  EXPECT_TRUE(is(Bounded(kMax) + 0x1p60f, kMax, kMax));
  EXPECT_TRUE(is(Bounded(kMax) + 0x1p103f, kInfinity, kInfinity));
}

TEST(BoundSum, OfInfinitiesFollowsIeee) {
  EXPECT_TRUE(is(Bounded(kInf) + 1, kInfinity, kInfinity));
  EXPECT_TRUE(is(Bounded(kInf) + kInf, kInfinity, kInfinity));
  EXPECT_TRUE(isEverything(Bounded(kInf) - kInf));
  EXPECT_TRUE(is(Bounded::between(1, kInfinity) + 1, 2, kInfinity));
}

TEST(BoundProduct, ExactStaysExactAndInexactTakesBothNeighbours) {
  EXPECT_TRUE(is(Bounded(1.5f) * 1.5f, 2.25, 2.25));
  // (1 + 2^-23)^2 = 1 + 2^-22 + 2^-46.
  const float x = 1 + 0x1p-23f;
  EXPECT_TRUE(is(Bounded(x) * x, 1 + 0x1p-22, 1 + 0x1p-22 + 0x1p-23));
  const UseRules use(kNearest);
  EXPECT_TRUE(is(Bounded(x) * x, 1 + 0x1p-22, 1 + 0x1p-22));
}

TEST(BoundProduct, OfZeroAndInfinityMayBeNan) {
  EXPECT_TRUE(isEverything(Bounded(0) * kInf));
  EXPECT_TRUE(isEverything(Bounded::between(-1, 1) * kInf));
  EXPECT_TRUE(is(Bounded::between(0.5, 1) * -kInf, -kInfinity, -kInfinity));
}

TEST(BoundProduct, KnowsASquareOnlyWhenTold) {
  const Bounded x = Bounded::between(-1, 1);
  EXPECT_TRUE(is(x * x, -1, 1));
  EXPECT_TRUE(is(square(x), 0, 1));
}

TEST(BoundDenormal, IsItselfOrZero) {
  EXPECT_TRUE(is(Bounded(0x1p-140f), 0, 0x1p-140));
  EXPECT_TRUE(is(Bounded::input(-0x1p-140f), -0x1p-140, 0));
  EXPECT_TRUE(is(Bounded(0x1p-100f) * 0x1p-30f, 0, 0x1p-130));
  EXPECT_TRUE(is(Bounded(-0x1p-126f) + 0x1p-127f, -0x1p-126, 0));  // the operand is [0, 2^-127]
  EXPECT_TRUE(is(Bounded(0x1p-126f), 0x1p-126, 0x1p-126));
}

// 2^-126 (1 - 2^-30) rounds to the normal 2^-126, but counts as denormal before it is rounded.
TEST(BoundDenormal, CountsBeforeRounding) {
  const UseRules use(kNearest);
  EXPECT_TRUE(is(Bounded(0x1p-63f * (1 - 0x1p-15f)) * (0x1p-63f * (1 + 0x1p-15f)), 0, 0x1p-126));
}

TEST(BoundDenormal, UnderflowKeepsASmallestDenormal) {
  EXPECT_TRUE(is(Bounded(0x1p-100f) * 0x1p-100f, 0, kMinDenormal));
  EXPECT_TRUE(is(Bounded(0x1p-100f) * -0x1p-100f, -kMinDenormal, 0));
}

// 2.5 ULP around 0.5: ulp(0.5) is 2^-25, the distance to the float below.
TEST(BoundDivision, OfOneByTwoIsWithinTwoAndAHalfOfTheSmallerUlp) {
  EXPECT_TRUE(is(Bounded(1) / 2, 0.5 - 2 * 0x1p-25, 0.5 + 0x1p-24));
}

TEST(BoundDivision, IsUnspecifiedForADivisorOutsideItsRange) {
  for (const float divisor : {0.0f, -0.0f, 0x1p-127f, 0x1.000002p126f, kInf, kQuiet}) {
    const Bounded x = Bounded(1) / divisor;
    EXPECT_TRUE(isEverything(x)) << divisor;
    EXPECT_EQ(unspecifiedOperations(x.flags), std::vector{Operation::divide}) << divisor;
  }
  EXPECT_FALSE((Bounded(1) / 0x1p126f).unspecified());
  EXPECT_FALSE((Bounded(1) / -kMin).unspecified());
  EXPECT_TRUE((Bounded(1) / Bounded::between(-1, 1)).unspecified());
}

TEST(BoundDivision, OfADenormalQuotientMayBeFlushed) {
  EXPECT_EQ((Bounded(0x1p-100f) / 0x1p30f).lo, 0);
  EXPECT_EQ((Bounded(-0x1p-100f) / 0x1p30f).hi, 0);
}

TEST(BoundDivision, OfZeroIsZero) { EXPECT_TRUE(is(Bounded(0) / 3, 0, 0)); }

TEST(BoundLiteral, ConvertsThroughFloat) {
  static_assert(!std::is_constructible_v<Bounded, double>);
  static_assert(!std::is_constructible_v<Bounded, bool>);
  EXPECT_TRUE(is(Bounded(0.1f), 0.1f, 0.1f));
  EXPECT_EQ(Bounded(0.1f).value, static_cast<double>(0.1f));
  EXPECT_TRUE(is(Bounded(16777217), 16777216, 16777218));  // 2^24 + 1
}

TEST(BoundInput, IsWidenedByTheRules) {
  Rules rules;
  rules.widenUlp = 2;
  const UseRules use(rules);
  EXPECT_TRUE(is(Bounded::input(1), before(before(1)), after(after(1))));
  EXPECT_TRUE(is(Bounded::input(0), 0, 0));
  EXPECT_TRUE(is(Bounded(1), 1, 1));
  EXPECT_TRUE(is(named(Bounded(1), "one"), before(before(1)), after(after(1))));
  EXPECT_EQ(named(0.1, "plain"), 0.1);
}

TEST(BoundInput, OfNanIsEverything) { EXPECT_TRUE(isEverything(Bounded::input(kQuiet))); }

TEST(BoundComparison, IsDecidedOnlyWhereAllResultsAgree) {
  const Bounded low = Bounded::between(0, 1), high = Bounded::between(1, 2);
  EXPECT_TRUE((low < high).undecided());
  EXPECT_TRUE(certainly(low <= high));
  EXPECT_FALSE(possibly(low > high));
  EXPECT_TRUE((low == high).undecided());
  EXPECT_TRUE(certainly(Bounded(1) == 1));
  EXPECT_FALSE(possibly(Bounded(1) != 1));
  EXPECT_TRUE(certainly(Bounded(0.0f) == -0.0f));
  EXPECT_TRUE((Bounded(kQuiet) < 1).undecided());
  EXPECT_TRUE((Bounded(kQuiet) == Bounded(kQuiet)).undecided());
}

TEST(BoundComparison, OfAMaybeNanIsOpenWhateverItsInterval) {
  Bounded maybe = Bounded::between(2, 3);
  maybe.flags |= kMayBeNan;
  EXPECT_TRUE((maybe < 1).undecided());
  EXPECT_TRUE((maybe > 1).undecided());
  EXPECT_TRUE((maybe <= 1).undecided());
  EXPECT_TRUE((maybe >= 1).undecided());
  EXPECT_TRUE((maybe == 1).undecided());
  EXPECT_TRUE((maybe != 1).undecided());
}

TEST(BoundComparison, FlushesDenormalsEitherWay) {
  EXPECT_TRUE((Bounded(0x1p-140f) > 0).undecided());
}

TEST(BoundDecision, KeepsThreeValues) {
  const Decision open = Bounded::between(0, 1) < 0.5f;
  const Decision yes = true, no = false;
  EXPECT_TRUE((!open).undecided());
  EXPECT_TRUE((open && yes).undecided());
  EXPECT_FALSE(possibly(open && no));
  EXPECT_TRUE(certainly(open || true));
  EXPECT_TRUE((false || open).undecided());
  EXPECT_EQ((open && yes).value, false);  // the value 0.5 is not below 0.5
}

TEST(BoundDecision, UndecidedOutsideExploreThrows) {
  const Decision open = Bounded::between(0, 1) < 0.5f;
  EXPECT_THROW(static_cast<void>(static_cast<bool>(open)), std::logic_error);
}

TEST(BoundSelect, UndecidedIsTheHullAndAmbiguous) {
  const Bounded x = select(Bounded::between(0, 1) < 0.5f, Bounded(1), Bounded(4));
  EXPECT_TRUE(is(x, 1, 4));
  EXPECT_TRUE(x.ambiguous());
  EXPECT_EQ(x.value, 4);
}

TEST(BoundSelect, DecidedIgnoresTheOtherSide) {
  const Bounded x = select(Bounded(0) < 1, Bounded(2), sqrt(Bounded(-1)));
  EXPECT_TRUE(is(x, 2, 2));
  EXPECT_EQ(x.flags, 0u);
}

TEST(BoundSelect, OnAnUnspecifiedValueIsUnspecified) {
  EXPECT_TRUE(select(sqrt(Bounded(-1)) < 1, Bounded(2), Bounded(3)).unspecified());
}

TEST(BoundSelect, OnAMaybeNanIsOpenButNoNan) {
  const Bounded x = select(Bounded(kQuiet) < 1, Bounded(2), Bounded(3));
  EXPECT_TRUE(is(x, 2, 3));
  EXPECT_FALSE(x.mayBeNan());
}

TEST(BoundSelect, OfEqualSidesIsNotAmbiguous) {
  EXPECT_FALSE(select(Bounded::between(0, 1) < 0.5f, Bounded(2), Bounded(2)).ambiguous());
}

TEST(BoundMinimum, IsExactAndNotAmbiguous) {
  const Bounded x = min(Bounded::between(0, 3), Bounded::between(1, 2));
  EXPECT_TRUE(is(x, 0, 2));
  EXPECT_FALSE(x.ambiguous());
  EXPECT_TRUE(is(max(Bounded::between(0, 3), Bounded::between(1, 2)), 1, 3));
}

// With NaN on one side the other operand may come back, which min of numbers would not give.
TEST(BoundMinimum, OfAMaybeNanIsAnyOperandOrNan) {
  Bounded maybe = Bounded::between(0, 1);
  maybe.flags |= kMayBeNan;
  const Bounded low = min(maybe, Bounded(5)), high = max(maybe, Bounded(-5));
  EXPECT_TRUE(is(low, 0, 5));
  EXPECT_TRUE(low.mayBeNan());
  EXPECT_TRUE(is(high, -5, 1));
  EXPECT_TRUE(is(clamp(maybe, 2, 3), 2, 3));
}

TEST(BoundClamp, IsUnspecifiedForReversedEnds) {
  EXPECT_TRUE(is(clamp(Bounded::between(-1, 0.5), 0, 1), 0, 0.5));
  EXPECT_TRUE(clamp(Bounded(0), 1, 0).unspecified());
}

TEST(BoundMagnitude, OfAnIntervalAcrossZeroStartsAtZero) {
  EXPECT_TRUE(is(abs(Bounded::between(-3, 2)), 0, 3));
  EXPECT_TRUE(is(abs(Bounded::between(-3, -2)), 2, 3));
}

TEST(BoundJudge, AdmitsWhatIsInsideAndNanOnlyIfPossible) {
  const Bounded x = Bounded(1) + 0x1p-24f;
  EXPECT_TRUE(admits(x, 1));
  EXPECT_TRUE(admits(x, static_cast<float>(after(1))));
  EXPECT_FALSE(admits(x, static_cast<float>(before(1))));
  EXPECT_FALSE(admits(x, kQuiet));
  EXPECT_TRUE(admits(Bounded(kInf) - kInf, kQuiet));
}

TEST(BoundJudge, AsksForTheSignOfAnExactZeroOnlyWhereTold) {
  const Bounded negative = Bounded(-0.0f) * 1;
  EXPECT_TRUE(admits(negative, 0.0f));
  EXPECT_FALSE(admits(negative, 0.0f, ZeroSign::asInDouble));
  EXPECT_TRUE(admits(negative, -0.0f, ZeroSign::asInDouble));
}

TEST(BoundRules, NestAndEnd) {
  EXPECT_EQ(rules().rounding, Rounding::eitherNeighbour);
  {
    const UseRules outer(kNearest);
    Rules widened;
    widened.widenUlp = 1;
    {
      const UseRules inner(widened);
      EXPECT_EQ(rules().widenUlp, 1);
    }
    EXPECT_EQ(rules().rounding, Rounding::nearestEven);
  }
  EXPECT_EQ(rules().rounding, Rounding::eitherNeighbour);
}

TEST(BoundRules, NameEveryOperationOnce) {
  for (std::size_t i = 0; i < kOperationCount; ++i)
    EXPECT_EQ(operationNamed(kOperationNames[i]), static_cast<Operation>(i));
  EXPECT_EQ(nameOf(Operation::integer), "integer");
  EXPECT_EQ(operationNamed("erf"), std::nullopt);
}

TEST(BoundRules, MeasuredErrorReplacesTheFormula) {
  Rules device;
  device.measure(Operation::sqrt, {1, 0});
  const Bounded specified = sqrt(Bounded(2));
  const UseRules use(device);
  // sqrt(2) = 1.41421356237 lies between two floats; one ULP (2^-23) away are two at most.
  EXPECT_TRUE(is(sqrt(Bounded(2)), floorToFloat(std::sqrt(2.0)), ceilToFloat(std::sqrt(2.0))));
  EXPECT_GT(specified.hi - specified.lo, 8 * 0x1p-23);
  EXPECT_TRUE(sqrt(Bounded(-1)).unspecified());
}

TEST(BoundRules, PartsOfFormulasAreMeasuredInUlpAlone) {
  Rules device;
  EXPECT_THROW(device.measure(Operation::divide, {2.5, 0x1p-20}), std::invalid_argument);
  device.measure(Operation::sin, {0, 0x1p-20});
  const UseRules use(device);
  EXPECT_LE(sin(Bounded(1)).hi - sin(Bounded(1)).lo, 2 * 0x1p-20);
}

TEST(BoundText, NamesTheCulprits) {
  EXPECT_EQ(describe((sqrt(Bounded(-1)) + log2(Bounded(0))).flags),
            "may be NaN, unspecified: sqrt, unspecified: log2");
}

// ulp() by the specification: at a power of two the distance to the float below.
TEST(BoundFloat, UlpIsTheSmallerDistance) {
  EXPECT_EQ(ulp(1.0), 0x1p-24);
  EXPECT_EQ(ulp(1.5), 0x1p-23);
  EXPECT_EQ(ulp(-2.0), 0x1p-23);
  EXPECT_EQ(ulp(0.0), kMinDenormal);
  EXPECT_EQ(ulp(0x1p-126), kMinDenormal);
  EXPECT_EQ(ulp(kMaxFloat), 0x1p104);
  EXPECT_EQ(ulp(0x1p200), 0x1p104);
  EXPECT_EQ(spacing(1.0), 0x1p-23);
}

TEST(BoundFloat, NeighboursOfZeroAreTheSmallestDenormals) {
  EXPECT_EQ(nextFloatUp(0.0), kMinDenormal);
  EXPECT_EQ(nextFloatDown(-0.0), -kMinDenormal);
  EXPECT_EQ(nextFloatUp(-kMinDenormal), 0);
  EXPECT_EQ(nextFloatUp(kMaxFloat), kInfinity);
}

// Every operation computes `value` as the plain model does, bit for bit.
template <class T>
T polynomial(T x, T y) {
  const T t = clamp(x * y + 0.5f, 0.1f, 3.0f);
  return mix(sqrt(t), exp2(-t), smoothstep(T(0.0f), T(2.0f), x)) / (max(t, x) + fract(y) - 4);
}
TEST(BoundValue, IsThePlainModel) {
  for (float x = -2; x < 2; x += 0.37f)
    for (float y = -2; y < 2; y += 0.41f)
      EXPECT_EQ(polynomial<Bounded>(x, y).value, polynomial<double>(x, y));
}

}  // namespace
}  // namespace gnomon
