// Tests of hypotheses, done once and right.
#pragma once

#include <cstddef>
#include <vector>

namespace gnomon::truth {

/// Probability that a chi-square variable with that many degrees of freedom is at least
/// `statistic`: Q(degrees / 2, statistic / 2), by MPFR.
double chiSquareTail(double statistic, double degrees);

/// Pearson's test of counts against expected counts; bins are pooled until each expects at least
/// five (Cochran 1954). Returns the p-value.
double chiSquareTest(const std::vector<double>& observed, const std::vector<double>& expected);

/// The significance of one of n independent tests whose family-wise significance is alpha:
/// 1 - (1 - alpha)^(1/n). Sidak 1967.
double sidak(double alpha, std::size_t n);

/// Probability that Student's t with that many degrees of freedom is at most x: the finite sums of
/// Abramowitz and Stegun 1964, 26.7.3 and 26.7.4. degrees >= 1.
double studentCdf(double x, unsigned degrees);

/// The x with studentCdf(x, degrees) = p, 0 < p < 1.
double studentQuantile(double p, unsigned degrees);

/// The x that an F variable with 2 and that many degrees of freedom stays below with probability p:
/// its distribution is 1 - (1 + 2 x / degrees)^(-degrees / 2).
double fQuantileOfTwo(double p, unsigned degrees);

}  // namespace gnomon::truth
