// Scaling laws and the quantiles that their intervals need. Covered: Student's and F's quantiles
// against tables and closed forms; laws without noise are found again, with and without a fixed
// cost; intervals hold the true exponent as often as they say; what does not grow has no exponent.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "harness/cases/random.h"
#include "reference/truth/power_law.h"
#include "reference/truth/statistics.h"

namespace gnomon::truth {
namespace {

constexpr double kConfidence = 0.95;

TEST(Student, QuantilesAreThoseOfTheTable) {
  // Abramowitz and Stegun 1964, table 26.10, two-sided 95 %: p = 0.975; three decimals.
  const std::pair<unsigned, double> table[] = {{1, 12.706}, {2, 4.303},  {3, 3.182},
                                               {4, 2.776},  {5, 2.571},  {6, 2.447},
                                               {10, 2.228}, {30, 2.042}, {120, 1.980}};
  for (const auto& [degrees, t] : table)
    EXPECT_NEAR(studentQuantile(0.975, degrees), t, 0.0005) << degrees;
}

TEST(Student, HasItsClosedFormsForOneAndTwoDegrees) {
  for (const double p : {0.01, 0.3, 0.5, 0.9, 0.999}) {
    // Bisection ends at neighbouring doubles, whose probabilities a few roundings part; where the
    // density is small that moves the quantile.
    const double cauchy = std::tan(std::numbers::pi * (p - 0.5));
    EXPECT_NEAR(studentQuantile(p, 1), cauchy, 1e-12 * (1 + cauchy * cauchy));
    const double two = (2 * p - 1) / std::sqrt(2 * p * (1 - p));
    EXPECT_NEAR(studentQuantile(p, 2), two, 1e-12 * (1 + std::abs(two * two * two)));
  }
}

TEST(Student, IsSymmetricAndInvertsItsDistribution) {
  for (const unsigned degrees : {1u, 2u, 3u, 6u, 7u, 40u})
    for (const double p : {0.001, 0.2, 0.6, 0.99}) {
      const double x = studentQuantile(p, degrees);
      EXPECT_NEAR(studentCdf(x, degrees), p, 1e-14) << degrees;
      EXPECT_NEAR(studentCdf(-x, degrees), 1 - p, 1e-14) << degrees;
    }
}

TEST(F, OfTwoAndSomeDegreesIsThatOfTheTable) {
  // Abramowitz and Stegun 1964, table 26.9, upper 5 %; two degrees above.
  const std::pair<unsigned, double> table[] = {{2, 19.00}, {5, 5.79}, {6, 5.14}, {20, 3.49}};
  for (const auto& [degrees, f] : table)
    EXPECT_NEAR(fQuantileOfTwo(0.95, degrees), f, 0.005) << degrees;
}

/// Half decades from 100 to 10^6, as `bench objects` has them; each time off by a factor
/// exp(noise).
std::vector<Sample> samples(double fixed, double factor, double exponent, double noise,
                            Random& random) {
  constexpr int kHalfDecades = 9;
  std::vector<Sample> list;
  for (int i = 0; i < kHalfDecades; ++i) {
    const double n = std::round(std::pow(10, 2 + i / 2.0));
    // Box and Muller 1958.
    const double normal = std::sqrt(-2 * std::log1p(-random.uniform())) *
                          std::cos(2 * std::numbers::pi * random.uniform());
    list.push_back({n, (fixed + factor * std::pow(n, exponent)) * std::exp(noise * normal)});
  }
  return list;
}

TEST(PowerLaw, WithoutNoiseIsFoundAgain) {
  Random random(1);
  for (const double exponent : {0.5, 1.0, 1.3, 2.0})
    for (const double fixed : {0.0, 1e-6, 5e-5}) {
      const double factor = 1e-3 / std::pow(1e6, exponent);  // a millisecond at most
      const auto law = fitPowerLaw(samples(fixed, factor, exponent, 0, random), kConfidence);
      ASSERT_TRUE(law) << exponent << ", " << fixed;
      // A minimum is flat: half the digits of a double.
      EXPECT_NEAR(law->exponent, exponent, 1e-6) << fixed;
      EXPECT_NEAR(law->fixed, fixed, 1e-9) << exponent;
      EXPECT_NEAR(law->factor / factor, 1, 1e-4) << exponent;
      EXPECT_LE(law->lower, law->exponent);
      EXPECT_GE(law->upper, law->exponent);
      EXPECT_LE(law->upper - law->lower, 1e-4) << exponent;
    }
}

TEST(PowerLaw, IntervalHoldsTheExponentAsOftenAsItSays) {
  constexpr int kTrials = 200;
  Random random(2);
  int held = 0;
  for (int i = 0; i < kTrials; ++i) {
    const auto law = fitPowerLaw(samples(2e-5, 1e-9, 1, 0.05, random), kConfidence);
    held += law && law->lower <= 1 && law->upper >= 1;
  }
  // Binomial: 190 expected, standard deviation 3.1; three of them either side.
  EXPECT_GE(held, 181);
  EXPECT_LE(held, 199);
}

TEST(PowerLaw, IntervalNarrowsWithTheNoise) {
  Random random(3);
  double before = kMostExponent;
  for (const double noise : {0.1, 0.01, 0.001}) {
    const auto law = fitPowerLaw(samples(2e-5, 1e-9, 1, noise, random), kConfidence);
    ASSERT_TRUE(law) << noise;
    EXPECT_LT(law->upper - law->lower, before / 3) << noise;
    before = law->upper - law->lower;
  }
}

TEST(PowerLaw, OfAConstantIsNone) {
  constexpr int kTrials = 200;
  Random random(4);
  int none = 0;
  for (int i = 0; i < kTrials; ++i)
    none += !fitPowerLaw(samples(1e-4, 0, 1, 0.05, random), kConfidence);
  // The F test is one of a linear law, which this is not: only near its 190.
  EXPECT_GE(none, 170);
}

TEST(PowerLaw, OfADriftIsNoneWhereItsExponentMayBeTheLeast) {
  std::vector<Sample> drift;
  for (double n = 100; n < 2e6; n *= 10) drift.push_back({n, std::pow(n, 0.01)});
  EXPECT_FALSE(fitPowerLaw(drift, kConfidence));
}

TEST(PowerLaw, NeedsMoreSamplesThanParameters) {
  Random random(5);
  std::vector<Sample> few = samples(0, 1e-9, 1, 0, random);
  few.resize(4);
  EXPECT_FALSE(fitPowerLaw(few, kConfidence));
  few.clear();
  EXPECT_FALSE(fitPowerLaw(few, kConfidence));
}

}  // namespace
}  // namespace gnomon::truth
