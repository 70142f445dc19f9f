// Sums and vectors: every order of evaluation is inside, and exact cases stay exact.
//
// Covered: sum, dot, length, normalize, cross, reflect, matrix products; random orders and fused
// forms in float arithmetic whose every rounding goes to a random neighbour or to nearest.
// Not covered here: scalar operations (bound_soundness_test).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reference/bound/vec.h"

namespace gnomon {
namespace {

testing::AssertionResult is(const Bounded& x, double lo, double hi) {
  if (x.lo == lo && x.hi == hi) return testing::AssertionSuccess();
  return testing::AssertionFailure() << x << " should be [" << lo << ", " << hi << ']';
}

// Float arithmetic of a device that rounds as it likes, within its rules.
class Device {
 public:
  explicit Device(unsigned seed) : random_(seed) {}

  double sum(double a, double b) { return rounded(twoSum(a, b)); }
  double product(double a, double b) { return rounded({a * b, 0}); }
  // a b + c rounded once: the product is exact in double.
  double fused(double a, double b, double c) { return rounded(twoSum(a * b, c)); }
  bool coin() { return (random_() & 1) != 0; }
  std::size_t below(std::size_t n) { return random_() % n; }
  float operand(int exponents) {
    const double unit = static_cast<double>(random_()) / static_cast<double>(random_.max()) * 2 - 1;
    return static_cast<float>(std::ldexp(
        unit, static_cast<int>(below(2 * static_cast<unsigned>(exponents) + 1)) - exponents));
  }

 private:
  double rounded(const Exact& x) {
    if (rules().rounding == Rounding::nearestEven) return nearestFloat(x.head);
    return coin() ? floorToFloat(x) : ceilToFloat(x);
  }
  std::mt19937 random_;
};

// Adds up in a random tree.
double addedAnyhow(Device& device, std::vector<double> terms) {
  while (terms.size() > 1) {
    std::swap(terms[device.below(terms.size())], terms.back());
    const double last = terms.back();
    terms.pop_back();
    double& other = terms[device.below(terms.size())];
    other = device.sum(other, last);
  }
  return terms[0];
}

// Products apart and added in a random tree, or one fused chain in a random order.
double multipliedAnyhow(Device& device, std::vector<float> a, std::vector<float> b) {
  std::vector<double> products;
  double chain = 0;
  const bool fuse = device.coin();
  while (!a.empty()) {
    const std::size_t i = device.below(a.size());
    if (fuse) chain = device.fused(a[i], b[i], chain);
    if (!fuse) products.push_back(device.product(a[i], b[i]));
    std::swap(a[i], a.back()), std::swap(b[i], b.back());
    a.pop_back(), b.pop_back();
  }
  return fuse ? chain : addedAnyhow(device, products);
}

class EachRoundingOfSums : public testing::TestWithParam<Rounding> {
 protected:
  const Rules rules_ = Rules::specification(GetParam());
  const UseRules use_{rules_};
};
INSTANTIATE_TEST_SUITE_P(Bound, EachRoundingOfSums,
                         testing::Values(Rounding::eitherNeighbour, Rounding::nearestEven),
                         [](const auto& tested) {
                           return tested.param == Rounding::nearestEven ? "NearestEven"
                                                                        : "EitherNeighbour";
                         });

constexpr std::size_t kLengths[] = {2, 3, 4, 5, 16, 64};

TEST_P(EachRoundingOfSums, SumHoldsEveryOrderAndIsNoWiderThanGamma) {
  Device device(1);
  for (const std::size_t n : kLengths) {
    for (int i = 0; i < 2000; ++i) {
      std::vector<Bounded> x;
      std::vector<double> terms;
      double magnitude = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const float term = device.operand(i % 8);
        x.emplace_back(term);
        terms.push_back(term);
        magnitude += std::abs(term);
      }
      const Bounded got = sum(x);
      for (int order = 0; order < 8; ++order) {
        const double result = addedAnyhow(device, terms);
        ASSERT_TRUE(got.lo <= result && result <= got.hi) << n << ": " << result << ' ' << got;
      }
      const double allowed = 2 * rules().gamma(static_cast<double>(n - 1)) * magnitude;
      ASSERT_LE(got.hi - got.lo, allowed * (1 + 0x1p-19)) << n << ": " << got;
    }
  }
}

TEST_P(EachRoundingOfSums, DotHoldsEveryOrderAndFusedForms) {
  Device device(2);
  for (const std::size_t n : kLengths) {
    for (int i = 0; i < 2000; ++i) {
      std::vector<float> a, b;
      std::vector<Bounded> x, y;
      double magnitude = 0;
      for (std::size_t k = 0; k < n; ++k) {
        a.push_back(device.operand(i % 8)), b.push_back(device.operand(i % 8));
        x.emplace_back(a[k]), y.emplace_back(b[k]);
        magnitude += std::abs(static_cast<double>(a[k]) * b[k]);
      }
      const Bounded got = dot(std::span<const Bounded>(x), std::span<const Bounded>(y));
      for (int order = 0; order < 8; ++order) {
        const double result = multipliedAnyhow(device, a, b);
        ASSERT_TRUE(got.lo <= result && result <= got.hi) << n << ": " << result << ' ' << got;
      }
      const double allowed = 2 * rules().gamma(static_cast<double>(n)) * magnitude;
      ASSERT_LE(got.hi - got.lo, allowed * (1 + 0x1p-19)) << n << ": " << got;
    }
  }
}

TEST_P(EachRoundingOfSums, OfIntervalsHoldEveryPointInside) {
  Device device(3);
  for (int i = 0; i < 20000; ++i) {
    Vec3<Bounded> a, b;
    std::vector<float> x, y;
    for (std::size_t k = 0; k < 3; ++k) {
      const float ends[] = {device.operand(2), device.operand(2), device.operand(2),
                            device.operand(2)};
      a[k] = join(ends[0], ends[1]);
      b[k] = join(ends[2], ends[3]);
      x.push_back(ends[device.below(2)]), y.push_back(ends[2 + device.below(2)]);
    }
    const double result = multipliedAnyhow(device, x, y);
    const Bounded got = dot(a, b);
    ASSERT_TRUE(got.lo <= result && result <= got.hi) << result << ' ' << got;
    const Vec3<Bounded> inside(x[0], x[1], x[2]);
    const Bounded length3 = length(a), point = length(inside);
    ASSERT_TRUE(length3.lo <= point.lo && point.hi <= length3.hi) << point << ' ' << length3;
    const Vec3<Bounded> unit = normalize(a), pointed = normalize(inside);
    const Vec3<Bounded> mirrored = reflect(a, b),
                        back = reflect(inside, Vec3<Bounded>(y[0], y[1], y[2]));
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_TRUE(unit[k].lo <= pointed[k].lo && pointed[k].hi <= unit[k].hi) << unit[k];
      ASSERT_TRUE(mirrored[k].lo <= back[k].lo && back[k].hi <= mirrored[k].hi) << mirrored[k];
    }
  }
}

// length, normalize, cross and reflect as a device computes them: 2 ULP of inversesqrt, 2.5 of the
// division, each at an end; unit roundoff of everything else.
TEST_P(EachRoundingOfSums, GeometryHoldsTheInheritedFormulas) {
  Device device(4);
  const auto off = [&](double x, double ulps) {
    const double error = ulps * ulp(x);
    return device.coin() ? ceilToFloat(x - error) : floorToFloat(x + error);
  };
  for (int i = 0; i < 50000; ++i) {
    const std::vector<float> x{device.operand(3), device.operand(3), device.operand(3)};
    const std::vector<float> y{device.operand(3), device.operand(3), device.operand(3)};
    const Vec3<Bounded> a(x[0], x[1], x[2]), b(y[0], y[1], y[2]);
    const double inverse = off(1 / std::sqrt(multipliedAnyhow(device, x, x)), 2);
    ASSERT_TRUE(admits(length(a), static_cast<float>(off(1 / inverse, 2.5))));
    const Vec3<Bounded> unit = normalize(a), mirrored = reflect(a, b);
    const Bounded crossed = cross(a, b).x;
    const double d = multipliedAnyhow(device, x, y);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto of = static_cast<float>(device.product(x[k], inverse));
      ASSERT_TRUE(admits(unit[k], of)) << of << ' ' << unit[k];
      const double back = device.product(device.product(2, d), y[k]);
      const auto to = static_cast<float>(device.sum(x[k], -back));
      ASSERT_TRUE(admits(mirrored[k], to)) << to << ' ' << mirrored[k];
    }
    const double minor = device.sum(device.product(x[1], y[2]), -device.product(x[2], y[1]));
    ASSERT_TRUE(admits(crossed, static_cast<float>(minor))) << minor << ' ' << crossed;
    ASSERT_TRUE(
        admits(crossed, static_cast<float>(multipliedAnyhow(device, {x[1], -x[2]}, {y[2], y[1]}))));
  }
}

// 2 ULP of inversesqrt and at most gamma_3 / 2 + u besides, on each side; ULP to relative costs 2.
TEST(BoundVector, NormalizeOfAPointIsTight) {
  const Vec3<Bounded> unit = normalize(Vec3<Bounded>(1, 2, 3));
  const double relative = 2 * 0x1p-23 + rules().gamma(3) / 2 + rules().unitRoundoff();
  EXPECT_LE(unit.x.hi - unit.x.lo, 2 * relative * unit.x.value * 1.01 + ulp(unit.x.value));
}

// x / |x| of (x, 1, 0) runs from 1 / sqrt(2) to 2 / sqrt(5) for x in [1, 2].
TEST(BoundVector, NormalizeOfAnIntervalKnowsTheComponentOnBothSidesOfTheQuotient) {
  const Bounded unit = normalize(Vec3<Bounded>(Bounded::between(1, 2), 1, 0)).x;
  EXPECT_NEAR(unit.lo, std::sqrt(0.5), 8 * 0x1p-23);
  EXPECT_NEAR(unit.hi, 2 / std::sqrt(5.0), 8 * 0x1p-23);
}

TEST(BoundVector, AxisAlignedStaysExact) {
  const Vec3<Bounded> axis(0, 0, 1), v(0.1f, 0.2f, 0.3f);
  EXPECT_TRUE(is(dot(axis, v), 0.3f, 0.3f));
  EXPECT_TRUE(is(cross(axis, v).x, -0.2f, -0.2f));
  const Vec3<Bounded> mirrored = reflect(v, axis);
  EXPECT_TRUE(is(mirrored.x, 0.1f, 0.1f));
  EXPECT_TRUE(is(mirrored.z, -0.3f, -0.3f));
  const Vec3<Bounded> unit = normalize(axis);
  EXPECT_TRUE(is(unit.x, 0, 0));
}

TEST(BoundVector, SmallIntegersStayExact) {
  EXPECT_TRUE(is(dot(Vec3<Bounded>(1, 2, 3), Vec3<Bounded>(4, 5, 6)), 32, 32));
  EXPECT_TRUE(is(sum(std::array<Bounded, 3>{Bounded(1), Bounded(0.5f), Bounded(-2)}), -0.5, -0.5));
  // 2^24 + 1 + 1 = 2^24 + 2 is a float, but 2^24 + 1 on the way is none.
  const Bounded late = sum(std::array<Bounded, 3>{Bounded(0x1p24f), Bounded(1), Bounded(1)});
  EXPECT_FALSE(late.isPoint());
}

TEST(BoundVector, SumOfNothingIsZero) { EXPECT_TRUE(is(sum(std::vector<Bounded>{}), 0, 0)); }

TEST(BoundVector, LengthOfZeroIsZeroAndItsDirectionUnspecified) {
  EXPECT_TRUE(is(length(Vec3<Bounded>()), 0, 0));
  EXPECT_EQ(unspecifiedOperations(normalize(Vec3<Bounded>()).x.flags),
            std::vector{Operation::inverseSqrt});
  // 2^-70 squared is denormal, so the device may see 0.
  EXPECT_TRUE(normalize(Vec3<Bounded>(0x1p-70f, 0, 0)).x.unspecified());
}

TEST(BoundVector, SquaresAreNeverNegative) {
  const Bounded side = Bounded::between(-1, 1);
  EXPECT_EQ(lengthSquared(Vec3<Bounded>(side, side, side)).lo, 0);
  EXPECT_EQ(dot(Vec3<Bounded>(side, side, side), Vec3<Bounded>(side, side, side)).lo,
            ceilToFloat(-3 * (1 + rules().gamma(3))));
}

TEST(BoundVector, OverflowOfPartialSumsIsSeen) {
  const Bounded big = 0x1p127f;
  EXPECT_TRUE(dot(Vec2<Bounded>(big, big), Vec2<Bounded>(2, -2)).mayBeNan());
  const Bounded same = dot(Vec2<Bounded>(big, big), Vec2<Bounded>(2, 2));
  EXPECT_TRUE(is(same, kMaxFloat, kInfinity));
  EXPECT_FALSE(same.mayBeNan());
}

TEST(BoundMatrix, ProductsAgreeWithGlmInDouble) {
  glm::mat4 m(1), n(1);
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) {
      m[c][r] = static_cast<float>(3 * c - r) * 0.5f;
      n[c][r] = static_cast<float>(c * r - 2);
    }
  const glm::vec4 v(1, -2, 3, 0.5f);
  const glm::mat4 mn = m * n;
  const glm::vec4 mv = m * v, vm = v * m;
  // Halves of small integers: exact in float, so equal bit for bit.
  const Mat4<Bounded> product = input<Bounded>(m) * input<Bounded>(n);
  for (int c = 0; c < 4; ++c) {
    const auto i = static_cast<std::size_t>(c);
    EXPECT_TRUE(is((input<Bounded>(m) * input<Bounded>(v))[i], mv[c], mv[c]));
    EXPECT_TRUE(is((input<Bounded>(v) * input<Bounded>(m))[i], vm[c], vm[c]));
    for (int r = 0; r < 4; ++r)
      EXPECT_TRUE(is(product[i][static_cast<std::size_t>(r)], mn[c][r], mn[c][r]));
    EXPECT_EQ((input<double>(m) * input<double>(v))[i], mv[c]);
  }
}

template <class T>
T model(const Vec3<T>& a, const Vec3<T>& b) {
  const Vec3<T> h = normalize(a + b * 0.5f);
  return dot(reflect(a, h), cross(h, b)) + length(mix(a, b, T(0.3f))) + lengthSquared(h);
}

TEST(BoundVector, ValueIsThePlainModel) {
  const glm::vec3 a(0.1f, -0.7f, 2.3f), b(1.7f, 0.2f, -0.4f);
  EXPECT_EQ(model(input<Bounded>(a), input<Bounded>(b)).value,
            model(input<double>(a), input<double>(b)));
}

}  // namespace
}  // namespace gnomon
