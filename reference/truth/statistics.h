// Tests of hypotheses for samplers, done once and right.
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

}  // namespace gnomon::truth
