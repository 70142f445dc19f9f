// Control flow over bounds, and the integers that come from them.
//
// Covered: explore() over if, loops, nested explorations, structs, the cap; IntRange arithmetic
// against all integers in small ranges; conversions from and to Bounded.
#include <gtest/gtest.h>

#include <tuple>

#include "reference/bound/explore.h"
#include "reference/bound/vec.h"

namespace gnomon {
namespace {

testing::AssertionResult is(const Bounded& x, double lo, double hi) {
  if (x.lo == lo && x.hi == hi) return testing::AssertionSuccess();
  return testing::AssertionFailure() << x << " should be [" << lo << ", " << hi << ']';
}

const Bounded kOpen = Bounded::between(0, 1);  // around 0.5

TEST(BoundExplore, DecidedBranchesRunOnce) {
  int runs = 0;
  const Bounded x = explore([&] {
    ++runs;
    return Bounded(1) < 2 ? Bounded(3) : Bounded(4);
  });
  EXPECT_EQ(runs, 1);
  EXPECT_TRUE(is(x, 3, 3));
  EXPECT_FALSE(x.ambiguous());
}

TEST(BoundExplore, UndecidedBranchesRunBothWaysAndJoin) {
  int runs = 0;
  const Bounded x = explore([&] {
    ++runs;
    return kOpen < 0.75f ? Bounded(3) : Bounded(4);
  });
  EXPECT_EQ(runs, 2);
  EXPECT_TRUE(is(x, 3, 4));
  EXPECT_TRUE(x.ambiguous());
  EXPECT_EQ(x.value, 3);  // 0.5 < 0.75
}

// Three independent choices between 0 and a power of two reach every number below 8.
TEST(BoundExplore, TriesEveryCombination) {
  std::array<bool, 8> seen{};
  explore([&] {
    std::size_t number = 0;
    for (const std::size_t bit : {1U, 2U, 4U})
      if (kOpen < 0.5f) number += bit;
    seen[number] = true;
    return Bounded(0);
  });
  for (const bool each : seen) EXPECT_TRUE(each);
}

TEST(BoundExplore, EndsLoopsWhoseCountIsOpen) {
  const Bounded steps = explore([] {
    Bounded x = Bounded::between(0, 0.5), count = 0;
    while (x < 2.25f) {
      x += 1;
      count += 1;
    }
    return count;
  });
  EXPECT_TRUE(is(steps, 2, 3));
}

TEST(BoundExplore, BeyondTheCapIsNotJudged) {
  int runs = 0;
  const Bounded x = explore([&] {
    ++runs;
    for (int i = 0; i < 7; ++i)
      if (kOpen < 0.5f) continue;
    return Bounded(1);
  });
  EXPECT_EQ(runs, kMaxPaths);
  EXPECT_TRUE(x.notJudged() && x.ambiguous());
  EXPECT_TRUE(is(x, -kInfinity, kInfinity));
  EXPECT_EQ(x.value, 1);
}

// Six choices are 64 paths exactly: the last that is judged.
TEST(BoundExplore, TheCapItselfIsJudged) {
  const Bounded x = explore([] {
    Bounded sum = 0;
    for (int i = 0; i < 6; ++i)
      if (kOpen < 0.5f) sum += 1;
    return sum;
  });
  EXPECT_FALSE(x.notJudged());
  EXPECT_TRUE(is(x, 0, 6));
}

TEST(BoundExplore, EndlessIndecisionEnds) {
  const Bounded x = explore([] {
    int i = 0;
    while (i < 1000 && kOpen < 0.75f) ++i;
    return Bounded(i);
  });
  EXPECT_TRUE(x.notJudged());
}

struct Shaded {
  Vec3<Bounded> colour;
  IntRange count;
  std::array<Bounded, 2> weights;
  bool hit = true;
  auto scalars() { return std::tie(colour, count, weights, hit); }
};

TEST(BoundExplore, JoinsStructsMemberByMember) {
  const Shaded s = explore([] {
    Shaded result;
    const bool near = static_cast<bool>(kOpen < 0.5f);
    result.colour = near ? Vec3<Bounded>(1, 2, 3) : Vec3<Bounded>(1, 5, 3);
    result.count = near ? 4 : 7;
    result.weights[1] = near ? 1 : 2;
    return result;
  });
  EXPECT_TRUE(is(s.colour.y, 2, 5));
  EXPECT_TRUE(is(s.weights[1], 1, 2));
  EXPECT_EQ(s.count.lo, 4);
  EXPECT_EQ(s.count.hi, 7);
  EXPECT_TRUE(s.colour.y.ambiguous() && s.count.ambiguous());
  EXPECT_FALSE(s.colour.x.ambiguous()) << "the branches agree on it";
}

TEST(BoundExplore, PlainMembersThatDifferAreAnError) {
  EXPECT_THROW(explore([] {
                 Shaded result;
                 result.hit = static_cast<bool>(kOpen < 0.5f);
                 return result;
               }),
               std::logic_error);
}

TEST(BoundExplore, NestsAndRestoresItsTrailAfterAThrow) {
  const Bounded x = explore([] {
    const Bounded inner = explore([] { return kOpen < 0.5f ? Bounded(1) : Bounded(2); });
    return kOpen < 0.25f ? inner : inner + 10;
  });
  EXPECT_TRUE(is(x, 1, 12));
  EXPECT_THROW(explore([]() -> Bounded { throw std::runtime_error("model"); }), std::runtime_error);
  EXPECT_THROW(static_cast<void>(static_cast<bool>(kOpen < 0.5f)), std::logic_error);
}

TEST(BoundExplore, BranchingOnAnUnspecifiedValueIsUnspecified) {
  const Bounded x = explore([] { return sqrt(Bounded(-1)) < 1 ? Bounded(1) : Bounded(1); });
  EXPECT_TRUE(x.unspecified());
}

// ---- integers ----

using IntOperation = IntRange (*)(const IntRange&, const IntRange&);
using PlainOperation = std::int64_t (*)(std::int64_t, std::int64_t);
struct IntCase {
  const char* name;
  IntOperation range;
  PlainOperation plain;
  std::int64_t lo;  // least operands: the domain differs
  std::int64_t loB;
};
const IntCase kIntCases[] = {
    {"+", [](auto& a, auto& b) { return a + b; }, [](auto a, auto b) { return a + b; }, -4, -4},
    {"-", [](auto& a, auto& b) { return a - b; }, [](auto a, auto b) { return a - b; }, -4, -4},
    {"*", [](auto& a, auto& b) { return a * b; }, [](auto a, auto b) { return a * b; }, -4, -4},
    {"/", [](auto& a, auto& b) { return a / b; }, [](auto a, auto b) { return a / b; }, -4, 1},
    {"%", [](auto& a, auto& b) { return a % b; }, [](auto a, auto b) { return a % b; }, 0, 1},
    {"<<", [](auto& a, auto& b) { return a << b; }, [](auto a, auto b) { return a << b; }, -4, 0},
    {">>", [](auto& a, auto& b) { return a >> b; }, [](auto a, auto b) { return a >> b; }, -4, 0},
    {"min", [](auto& a, auto& b) { return min(a, b); },
     [](auto a, auto b) { return std::min(a, b); }, -4, -4},
    {"max", [](auto& a, auto& b) { return max(a, b); },
     [](auto a, auto b) { return std::max(a, b); }, -4, -4},
};

// All ranges within [-4, 5]: every result is inside, both ends are reached (except by %, whose
// hull may be wider), and a single pair is a single result.
TEST(BoundInteger, RangesAreTheHullOfAllResults) {
  for (const IntCase& tested : kIntCases) {
    for (std::int64_t a0 = tested.lo; a0 <= 5; ++a0)
      for (std::int64_t a1 = a0; a1 <= 5; ++a1)
        for (std::int64_t b0 = tested.loB; b0 <= 5; ++b0)
          for (std::int64_t b1 = b0; b1 <= 5; ++b1) {
            std::int64_t lo = INT64_MAX, hi = INT64_MIN;
            for (std::int64_t a = a0; a <= a1; ++a)
              for (std::int64_t b = b0; b <= b1; ++b) {
                lo = std::min(lo, tested.plain(a, b));
                hi = std::max(hi, tested.plain(a, b));
              }
            const IntRange got = tested.range(IntRange::between(a0, a1), IntRange::between(b0, b1));
            ASSERT_FALSE(got.unspecified()) << tested.name;
            ASSERT_TRUE(got.lo <= lo && hi <= got.hi) << tested.name << ' ' << got;
            const bool hull = got.lo == lo && got.hi == hi;
            ASSERT_TRUE(hull || (tested.name[0] == '%' && !(a0 == a1 && b0 == b1)))
                << tested.name << ' ' << got;
          }
  }
}

TEST(BoundInteger, OutsideThirtyTwoBitsIsUnspecified) {
  EXPECT_TRUE((IntRange(INT32_MAX) * 4).unspecified());
  EXPECT_FALSE((IntRange(INT32_MAX) + INT32_MAX).unspecified());  // fits an unsigned
  EXPECT_TRUE((IntRange(1) / IntRange::between(-1, 1)).unspecified());
  EXPECT_TRUE((IntRange(0) << IntRange::between(0, 32)).unspecified());
  EXPECT_TRUE((IntRange(1) >> -1).unspecified());
  EXPECT_TRUE(toInt(Bounded(0x1p40f)).unspecified());
}

TEST(BoundInteger, FromABoundIsAmbiguousAcrossAStep) {
  EXPECT_EQ(toInt(Bounded(-1.5f)).certain(), -1);
  EXPECT_EQ(floorToInt(Bounded(-1.5f)).certain(), -2);
  const IntRange x = toInt(Bounded::between(0.5, 2.5));
  EXPECT_TRUE(x.ambiguous());
  EXPECT_EQ(x.lo, 0);
  EXPECT_EQ(x.hi, 2);
  EXPECT_THROW(static_cast<void>(x.certain()), std::logic_error);
  EXPECT_TRUE((x < 2).undecided());
  EXPECT_TRUE(certainly(x <= 2));
  EXPECT_TRUE(is(x.toBounded(), 0, 2));
}

TEST(BoundInteger, ToABoundRoundsLikeAnyConversion) {
  EXPECT_TRUE(is(IntRange(16777217).toBounded(), 16777216, 16777218));  // 2^24 + 1
}

}  // namespace
}  // namespace gnomon
