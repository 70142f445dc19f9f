#include "reference/truth/power_law.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "reference/truth/statistics.h"

namespace gnomon::truth {
namespace {

/// The least of f over [lo, hi]: the best of a grid, then the golden section around it.
struct Least {
  double at = 0, value = 0;
};
Least leastOf(const std::function<double(double)>& f, double lo, double hi) {
  constexpr int kGrid = 64, kSections = 40;  // 0.618^40 of two cells is 9e-9 of one
  const double cell = (hi - lo) / kGrid;
  Least best{lo, f(lo)};
  for (int i = 1; i <= kGrid; ++i)
    if (const double x = lo + cell * i, value = f(x); value < best.value) best = {x, value};
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double a = std::max(lo, best.at - cell), b = std::min(hi, best.at + cell);
  const auto at = [&](double x) { return Least{x, f(x)}; };
  Least left = at(b - golden * (b - a)), right = at(a + golden * (b - a));
  for (int i = 0; i < kSections; ++i) {
    if (left.value < right.value) {
      b = std::exchange(right, left).at;
      left = at(b - golden * (b - a));
    } else {
      a = std::exchange(left, right).at;
      right = at(a + golden * (b - a));
    }
  }
  for (const Least& end : {left, right})
    if (end.value < best.value) best = end;
  return best;
}

/// The law with a given exponent: t = factor (ratio + n^exponent), sizes relative to the largest.
class Profile {
 public:
  explicit Profile(std::span<const Sample> samples) {
    largest = std::ranges::max(samples, {}, &Sample::n).n;
    for (const Sample& s : samples) points.push_back({s.n / largest, std::log(s.t)});
  }

  struct Fit {
    double squares = 0, ratio = 0, logFactor = 0;
  };

  /// The best fixed cost for that exponent: none, or a share of the largest time on a log scale.
  Fit best(double exponent) const {
    constexpr double kLeastRatio = -30, kMostRatio = 10;  // natural logarithms
    std::vector<double> powers;
    for (const Sample& p : points) powers.push_back(std::pow(p.n, exponent));
    const Fit none = about(powers, 0);
    const Least with = leastOf([&](double log) { return about(powers, std::exp(log)).squares; },
                               kLeastRatio, kMostRatio);
    return with.value < none.squares ? about(powers, std::exp(with.at)) : none;
  }

  double squaresOfConstant() const {
    double mean = 0, squares = 0;
    for (const Sample& p : points) mean += p.t / static_cast<double>(points.size());
    for (const Sample& p : points) squares += std::pow(p.t - mean, 2);
    return squares;
  }

  std::size_t size() const { return points.size(); }
  double scale() const { return largest; }

 private:
  /// Of log t about factor (ratio + power), the factor being the best one.
  Fit about(const std::vector<double>& powers, double ratio) const {
    std::vector<double> rest;
    for (std::size_t i = 0; i < powers.size(); ++i)
      rest.push_back(points[i].t - std::log(ratio + powers[i]));
    double mean = 0, squares = 0;
    for (const double r : rest) mean += r / static_cast<double>(rest.size());
    for (const double r : rest) squares += (r - mean) * (r - mean);
    return {squares, ratio, mean};
  }

  std::vector<Sample> points;  // n / largest, log t
  double largest = 1;
};

/// Where the sum of squares passes the limit between a point inside and one that may be outside.
double crossing(const Profile& profile, double limit, double inside, double outside) {
  constexpr int kHalvings = 30;  // of an interval of 4: 4e-9
  if (profile.best(outside).squares <= limit) return outside;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (inside + outside) / 2;
    (profile.best(middle).squares <= limit ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace

std::optional<PowerLaw> fitPowerLaw(std::span<const Sample> samples, double confidence) {
  if (samples.size() < kFewestSamples) return std::nullopt;
  const Profile profile(samples);
  const auto [exponent, squares] =
      leastOf([&](double b) { return profile.best(b).squares; }, kLeastExponent, kMostExponent);
  const auto free = static_cast<unsigned>(profile.size()) - 3;
  const double variance = squares / free;
  if (profile.squaresOfConstant() - squares <= 2 * fQuantileOfTwo(confidence, free) * variance)
    return std::nullopt;
  const double q = studentQuantile((1 + confidence) / 2, free);
  const double limit = squares + q * q * variance;
  const double lower = crossing(profile, limit, exponent, kLeastExponent);
  if (lower <= kLeastExponent) return std::nullopt;
  const Profile::Fit fit = profile.best(exponent);
  const double factor = std::exp(fit.logFactor);
  return PowerLaw{.fixed = factor * fit.ratio,
                  .factor = factor * std::pow(profile.scale(), -exponent),
                  .exponent = exponent,
                  .lower = lower,
                  .upper = crossing(profile, limit, exponent, kMostExponent)};
}

}  // namespace gnomon::truth
