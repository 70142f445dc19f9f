// Altered: unaltered it is a double; each kind of alteration does what it says, to the operation it
// is meant for and to no other.
#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "reference/bound/altered.h"
#include "reference/bound/vec.h"

namespace gnomon {
namespace {

template <class Model>
double altered(AlterableOperation operation, const Model& model) {
  const AlteredEvaluation evaluation(operation);
  return model().value;
}

template <class Model>
std::vector<AlterableStep> stepsOf(const Model& model) {
  std::vector<AlterableStep> steps;
  const AlteredEvaluation evaluation(steps);
  model();
  return steps;
}

const Altered a = Altered::input(6), b = Altered::input(3);

struct Row {
  Alteration kind;
  Altered (*model)();
  double plain, altered;
};

// 6 and 3; a literal is nudged by 1e-4 of itself.
const std::array kRows = {
    Row{Alteration::add, [] { return a + b; }, 9, 3},
    Row{Alteration::subtract, [] { return a - b; }, 3, 9},
    Row{Alteration::multiply, [] { return a * b; }, 18, 2},
    Row{Alteration::divide, [] { return a / b; }, 2, 18},
    Row{Alteration::negate, [] { return -a; }, -6, 6},
    Row{Alteration::first, [] { return min(a, b); }, 3, 6},
    Row{Alteration::second, [] { return min(b, a); }, 3, 6},
    Row{Alteration::first, [] { return max(b, a); }, 6, 3},
    Row{Alteration::second, [] { return max(a, b); }, 6, 3},
    Row{Alteration::literal, [] { return Altered(2.0f); }, 2, 2 * (1 + 1e-4)},
    Row{Alteration::literal, [] { return Altered(0); }, 0, 1e-4},
    Row{Alteration::function, [] { return floor(Altered::input(2.5)); }, 2, 2.5},
    Row{Alteration::function, [] { return pow(a, b); }, 216, 6},
    Row{Alteration::compare, [] { return select(a < b, a, b); }, 3, 6},
    Row{Alteration::threshold, [] { return select(a < b, a, b); }, 3, 3},
    Row{Alteration::threshold, [] { return select(a <= a, a, b); }, 6, 3},
    Row{Alteration::compare, [] { return select(a == b, a, b); }, 3, 6},
};

TEST(BoundAltered, EveryKindAltersItsOperationAndNoOther) {
  for (const Row& row : kRows) {
    const AlterableOperation meant{.number = 0, .kind = row.kind};
    EXPECT_EQ(row.model().value, row.plain) << nameOf(row.kind);
    EXPECT_EQ(altered(meant, row.model), row.altered) << nameOf(row.kind);
    EXPECT_EQ(altered({.number = 1, .kind = row.kind}, row.model), row.plain) << nameOf(row.kind);
    EXPECT_EQ(altered({.number = 0, .path = 2, .kind = row.kind}, row.model), row.plain);
    const auto listed = stepsOf(row.model);
    EXPECT_TRUE(std::ranges::any_of(listed, [&](const AlterableStep& s) {
      return s.operation == meant;
    })) << nameOf(row.kind);
  }
}

TEST(BoundAltered, NamesAreReadAsTheyAreWritten) {
  for (const Row& row : kRows) EXPECT_EQ(alterationNamed(nameOf(row.kind)), row.kind);
  EXPECT_EQ(alterationNamed("nothing"), Alteration::none);
}

// An inherited built-in is its formula: three products and two sums.
TEST(BoundAltered, ADotProductIsFiveOperations) {
  const Vec3<Altered> v(a, b, a);
  const auto steps = stepsOf([&] { return dot(v, v); });
  EXPECT_EQ(steps.size(), 5u);
  EXPECT_EQ(dot(v, v).value, 36 + 9 + 36);
}

// After an `if` operation 1 is another one on each side, and && does not skip what it need not see.
TEST(BoundAltered, AnIfPartsPathsAndAnAndDoesNot) {
  const auto parted = [](const Altered& x) { return x < b ? x + x : x * x; };
  const AlterableOperation sum{.number = 1, .path = 3, .kind = Alteration::add};
  const AlterableOperation product{.number = 1, .path = 2, .kind = Alteration::multiply};
  EXPECT_EQ(stepsOf([&] { return parted(Altered::input(2)); }).back().operation, sum);
  EXPECT_EQ(stepsOf([&] { return parted(a); }).back().operation, product);
  EXPECT_EQ(altered(sum, [&] { return parted(Altered::input(2)); }), 0);
  EXPECT_EQ(altered(sum, [&] { return parted(a); }), 36);
  const auto both = [](const Altered& x) { return select(x < b && x < a, x, a); };
  EXPECT_EQ(stepsOf([&] { return both(a); }).size(), stepsOf([&] { return both(b); }).size());
}

TEST(BoundAltered, AnEvaluationEndsWithItsScope) {
  {
    const AlteredEvaluation evaluation(AlterableOperation{.number = 0, .kind = Alteration::add});
    EXPECT_EQ((a + b).value, 3);
    EXPECT_EQ((a + b).value, 9);  // the second operation
  }
  EXPECT_EQ((a + b).value, 9);
}

}  // namespace
}  // namespace gnomon
