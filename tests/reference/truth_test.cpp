// Truth is tested too: quadrature, statistics and microfacet theory against closed forms.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "reference/truth/microfacet.h"
#include "reference/truth/quadrature.h"
#include "reference/truth/statistics.h"

namespace gnomon::truth {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(GaussLegendre, IntegratesPolynomialsOfDegree2nMinus1) {
  for (const std::size_t n : {1u, 2u, 5u, 20u}) {
    const GaussLegendre rule(n);
    const auto degree = static_cast<double>(2 * n - 1);
    const double integral = rule(0, 1, [&](double x) { return std::pow(x, degree); });
    EXPECT_LE(std::abs(integral - 1 / (degree + 1)), 8 * kEpsilon) << n;
    const double even = rule(-1, 1, [&](double x) { return std::pow(x, degree - 1); });
    EXPECT_LE(std::abs(even - 2 / degree), 8 * kEpsilon) << n;
  }
}

TEST(Hemisphere, OfTheCosineIsPiWhateverTheScale) {
  for (const double scale : {0.1, 1.0, 3.0}) {
    const double integral =
        hemisphere([](double theta, double) { return std::cos(theta); }, scale, 96);
    EXPECT_LE(std::abs(integral - std::numbers::pi), 1e3 * kEpsilon) << scale;
  }
}

TEST(ChiSquare, TailHasItsClosedFormsForTwoAndFourDegrees) {
  for (const double x : {0.1, 1.0, 5.0, 30.0}) {
    EXPECT_LE(std::abs(chiSquareTail(x, 2) - std::exp(-x / 2)), 4 * kEpsilon);
    EXPECT_LE(std::abs(chiSquareTail(x, 4) - std::exp(-x / 2) * (1 + x / 2)), 4 * kEpsilon);
  }
}

TEST(ChiSquare, SeesAShiftOfOnePercentAndAcceptsTheExpectation) {
  const std::vector<double> expected(10, 10'000);
  EXPECT_EQ(chiSquareTest(expected, expected), 1);
  std::vector<double> shifted = expected;
  shifted[0] += 500;
  shifted[1] -= 500;
  // Statistic 50 on 9 degrees: p = 1.1e-7.
  EXPECT_LT(chiSquareTest(shifted, expected), 1e-6);
}

TEST(ChiSquare, PoolsBinsThatExpectTooLittle) {
  std::vector<double> expected(1000, 0.01), observed(1000, 0.0);
  expected.push_back(1000);
  observed.push_back(1000);
  // 500 times what a bin expects: 5,000 on 1,000 degrees, were there no pools. Each pool of 500
  // bins (or 501: a hundredth is not exact) holds the five that it expects.
  observed[17] = observed[700] = 5;
  EXPECT_GT(chiSquareTest(observed, expected), 0.9);
}

TEST(Sidak, SplitsAFamilyOfTwo) {
  const double each = sidak(0.01, 2);
  EXPECT_LE(std::abs((1 - each) * (1 - each) - 0.99), 2 * kEpsilon);
}

TEST(Microfacet, GgxAtTheNormalIsOneOverPiAlphaSquared) {
  for (const double alpha : {0.01, 0.5, 1.0})
    EXPECT_LE(std::abs(ggx(0, alpha) * std::numbers::pi * alpha * alpha - 1), 8 * kEpsilon);
}

TEST(Microfacet, SmithG1IsOneHeadOnAndTwoThirdsWhereTanIsRootThree) {
  EXPECT_EQ(smithG1(1, 0.3), 1);
  // alpha = 1, tan^2 = 3: 2 / (1 + 2).
  EXPECT_LE(std::abs(smithG1(0.5, 1) - 2.0 / 3), 4 * kEpsilon);
}

TEST(Microfacet, SampledHalfVectorsAreTheInverseOfTheDistribution) {
  // P(theta < t) = tan^2 / (alpha^2 + tan^2), Walter et al. 2007, inverted by eq. 35.
  for (const double u : {0.0, 0.25, 0.5, 0.9}) {
    const double t = std::tan(sampleGgx(u, 0, 0.3)[0]);
    EXPECT_LE(std::abs(t * t / (0.09 + t * t) - u), 16 * kEpsilon);
  }
}

// Smith G1 for GGX at alpha = 0.1, theta from pi/3 to pi/2 in 19 steps: Mitsuba 3,
// test_microfacet.py, test03_smith_g1_ggx, printed with eight digits. It was computed in float32: a
// theta in [1, 2) is rounded by at most 2^-24, its cosine below 1/2 by 2^-26, together below 2^-23.
TEST(Smith, G1IsThePublishedTable) {
  constexpr std::array kTable = {9.9261039e-01, 9.9160647e-01, 9.9042398e-01, 9.8901933e-01,
                                 9.8733366e-01, 9.8528832e-01, 9.8277503e-01, 9.7964239e-01,
                                 9.7567332e-01, 9.7054905e-01, 9.6378750e-01, 9.5463598e-01,
                                 9.4187391e-01, 9.2344058e-01, 8.9569420e-01, 8.5189372e-01,
                                 7.7902949e-01, 6.5144652e-01, 4.1989169e-01};
  constexpr double kAlpha = 0.1, kCosineError = 0x1p-23;
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    const double theta = std::numbers::pi / 3 + (std::numbers::pi / 2 - std::numbers::pi / 3) *
                                                    static_cast<double>(i) / 19;
    // dG1/dcos is at most 2 / alpha (at the horizon), so that much of the cosine's error arrives;
    // the last printed digit is 1e-8.
    EXPECT_LE(std::abs(smithG1(std::cos(theta), kAlpha) - kTable[i]),
              kCosineError * 2 / kAlpha + 1e-8 / 2)
        << "theta " << theta;
  }
}

}  // namespace
}  // namespace gnomon::truth
