// How a time grows with the size of its problem: t = fixed + factor n^exponent.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace gnomon::truth {

struct Sample {
  double n = 0;  ///< > 0
  double t = 0;  ///< > 0
};

struct PowerLaw {
  double fixed = 0, factor = 0, exponent = 0;
  double lower = 0, upper = 0;  ///< of the exponent, with the confidence asked for
};

/// The law that fits best, with fixed >= 0, factor > 0 and an exponent in [kLeastExponent,
/// kMostExponent]: least squares of log t, since errors of a time are a share of it.
///
/// The interval is that of the profile (Bates and Watts 1988, "Nonlinear Regression Analysis and
/// Its Applications", ch. 6): every exponent b with S(b) <= S (1 + q^2 / (m - 3)), where S(b) is
/// the least sum of squares with that exponent, S the least of all, m the number of samples and q
/// Student's quantile on m - 3 degrees. Where the law is linear that is the usual interval; unlike
/// that of the linearised law it knows that the fixed cost is no less than 0. Nothing where there
/// are fewer than kFewestSamples, or where they do not show any growth: a constant fits as well, by
/// the F test with the same confidence, or the interval reaches down to kLeastExponent.
std::optional<PowerLaw> fitPowerLaw(std::span<const Sample> samples, double confidence);

inline constexpr std::size_t kFewestSamples = 5;  // three parameters, two degrees of freedom
inline constexpr double kLeastExponent = 0.05;
inline constexpr double kMostExponent = 4;

}  // namespace gnomon::truth
