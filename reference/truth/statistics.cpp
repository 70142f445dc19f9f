#include "reference/truth/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <mpfr.h>

namespace gnomon::truth {

double chiSquareTail(double statistic, double degrees) {
  constexpr mpfr_prec_t kBits = 64;
  mpfr_t a, x, upper, whole;
  mpfr_inits2(kBits, a, x, upper, whole, static_cast<mpfr_ptr>(nullptr));
  mpfr_set_d(a, degrees / 2, MPFR_RNDN);
  mpfr_set_d(x, statistic / 2, MPFR_RNDN);
  mpfr_gamma_inc(upper, a, x, MPFR_RNDN);
  mpfr_gamma(whole, a, MPFR_RNDN);
  mpfr_div(upper, upper, whole, MPFR_RNDN);
  const double tail = mpfr_get_d(upper, MPFR_RNDN);
  mpfr_clears(a, x, upper, whole, static_cast<mpfr_ptr>(nullptr));
  return tail;
}

double chiSquareTest(const std::vector<double>& observed, const std::vector<double>& expected) {
  constexpr double kLeastExpected = 5;
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  double statistic = 0, bins = 0;
  double pooledObserved = 0, pooledExpected = 0, left = 0;
  for (const std::size_t bin : order) left += expected[bin];
  for (const std::size_t bin : order) {
    pooledObserved += observed[bin];
    pooledExpected += expected[bin];
    left -= expected[bin];
    // What could not make a pool of its own any more joins this one.
    const bool last = bin == order.back();
    if (!last && (pooledExpected < kLeastExpected || left < kLeastExpected)) continue;
    statistic +=
        (pooledObserved - pooledExpected) * (pooledObserved - pooledExpected) / pooledExpected;
    bins += 1;
    pooledObserved = pooledExpected = 0;
  }
  return chiSquareTail(statistic, bins - 1);
}

double sidak(double alpha, std::size_t n) {
  return -std::expm1(std::log1p(-alpha) / static_cast<double>(n));
}

double studentCdf(double x, unsigned degrees) {
  const double nu = degrees, theta = std::atan(x / std::sqrt(nu));
  const double c = std::cos(theta), s = std::sin(theta);
  // The probability within [-x, x]; `term` is the next one of the series in powers of cos^2.
  double sum = 0, term = degrees % 2 == 0 ? 1 : c;
  for (unsigned k = degrees % 2 == 0 ? 0 : 1; k + 2 <= degrees; k += 2) {
    sum += term;
    term *= c * c * (k + 1) / (k + 2);
  }
  const double within = degrees % 2 == 0 ? s * sum : 2 / std::numbers::pi * (theta + s * sum);
  return (1 + within) / 2;
}

double studentQuantile(double p, unsigned degrees) {
  double lo = -1, hi = 1;
  while (studentCdf(lo, degrees) > p) lo *= 2;
  while (studentCdf(hi, degrees) < p) hi *= 2;
  while (true) {
    const double middle = (lo + hi) / 2;
    if (middle <= lo || middle >= hi) return middle;
    (studentCdf(middle, degrees) < p ? lo : hi) = middle;
  }
}

double fQuantileOfTwo(double p, unsigned degrees) {
  const double half = degrees / 2.0;
  return half * std::expm1(-std::log1p(-p) / half);
}

}  // namespace gnomon::truth
