#include "reference/bound/sum.h"

#include <cassert>

#include "reference/bound/builtins.h"
#include "reference/bound/inherited.h"
#include "reference/bound/ranges.h"

namespace gnomon {
namespace {

using detail::InheritedSum;
using detail::Range;

InheritedSum squares(std::span<const Bounded> a) noexcept {
  InheritedSum sum;
  for (const Bounded& x : a) sum.add(detail::productOfSame(x));
  return sum;
}

// Products and partial sums that may be flushed, each by less than 2^-126.
double flushed(const InheritedSum& sum) noexcept { return 2 * sum.count() * kMinNormal; }

// The plain model's operands, for the same loops over Bounded.
struct Values {
  std::span<const Bounded> of;
  double operator[](std::size_t i) const noexcept { return of[i].value; }
  std::size_t size() const noexcept { return of.size(); }
};

// Adding up starts at the first term: 0 + -0 would lose its sign.
template <class F>
double accumulate(std::size_t n, const F& term) noexcept {
  double result = n == 0 ? 0 : term(0);
  for (std::size_t i = 1; i < n; ++i) result += term(i);
  return result;
}

template <class A, class B>
double plainDot(const A& a, const B& b) noexcept {
  return accumulate(a.size(), [&](std::size_t i) { return a[i] * b[i]; });
}

template <class A>
double plainReflected(const A& i, const A& n, std::size_t k) noexcept {
  return i[k] - 2 * plainDot(n, i) * n[k];
}

// x / sqrt(x^2 + r) grows with x, and shrinks towards 0 as r grows.
Range unitRange(const Bounded& x, const InheritedSum& others) noexcept {
  const double near = others.exactLo(), far = others.exactHi();
  const auto at = [](double y, double r) { return y == 0 ? 0 : y / std::sqrt(y * y + r); };
  return {at(x.lo, x.lo > 0 ? far : near), at(x.hi, x.hi > 0 ? near : far)};
}

bool isZero(const Bounded& x) noexcept { return x.lo == 0 && x.hi == 0; }

bool isUnitAxis(std::span<const Bounded> n, std::size_t k) noexcept {
  for (std::size_t i = 0; i < n.size(); ++i)
    if (i != k && !isZero(n[i])) return false;
  return n[k].isPoint() && std::abs(n[k].lo) == 1;
}

}  // namespace

Bounded sum(std::span<const Bounded> x) noexcept {
  InheritedSum sum;
  for (const Bounded& term : x) sum.add(detail::product(term));
  const Values values{x};
  const double value = accumulate(x.size(), [&](std::size_t i) { return values[i]; });
  return sum.result(value, std::max(sum.count() - 1, 0.0));
}

Bounded dot(std::span<const Bounded> a, std::span<const Bounded> b) noexcept {
  assert(a.size() == b.size());
  InheritedSum sum;
  for (std::size_t i = 0; i < a.size(); ++i) sum.add(detail::product(a[i], b[i]));
  return sum.result(plainDot(Values{a}, Values{b}), sum.count());
}

Bounded lengthSquared(std::span<const Bounded> a) noexcept {
  const InheritedSum sum = squares(a);
  return sum.result(plainDot(Values{a}, Values{a}), sum.count());
}

// Of s = dot(a, a) (1 + e), |e| <= gamma_n, the root errs by less than 1 / sqrt(1 - gamma_n) - 1,
// and then by sqrt's error. What is flushed moves s by d and the root by min(sqrt(d), d / root).
Bounded length(std::span<const Bounded> a) noexcept {
  const double value = std::sqrt(plainDot(Values{a}, Values{a}));
  const InheritedSum sum = squares(a);
  Bounded square = sum.result(value * value, sum.count());
  if (square.mayBeNan() || square.hi == kInfinity)
    return detail::make(value, -kInfinity, kInfinity, square.flags);
  if (square.isPoint()) {
    square = sqrt(square);
    square.value = value;
    return square;
  }
  const double lo = std::sqrt(sum.exactLo()), hi = std::sqrt(sum.exactHi());
  const double relative = (1 + detail::sqrtError()) / std::sqrt(1 - rules().gamma(sum.count())) - 1;
  const double d = flushed(sum);
  const double absolute = 2 * (lo > 0 ? std::min(std::sqrt(d), d / lo) : std::sqrt(d));
  const Bounded result = detail::around(value, {lo, hi}, relative, absolute, square.flags);
  return detail::clipped(result, 0, kInfinity);
}

Bounded normalizedComponent(std::span<const Bounded> a, std::size_t k) noexcept {
  const double value = Values{a}[k] * inversesqrt(plainDot(Values{a}, Values{a}));
  const InheritedSum sum = squares(a);
  const Bounded square = sum.result(0, sum.count());
  if (!(square.lo >= kMinNormal && square.hi < kInfinity) || square.mayBeNan())
    return unspecified(Operation::inverseSqrt, value, square.flags);
  if (isZero(a[k])) return detail::make(value, 0, 0, square.flags);

  InheritedSum others;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (i != k) others.add(detail::productOfSame(a[i]));
  const double ofSquare =
      square.isPoint() ? 0 : rules().gamma(sum.count()) + flushed(sum) / sum.exactLo();
  const double relative = (1 + rules().unitRoundoff()) *
                              (1 + detail::relativeError(Operation::inverseSqrt)) /
                              std::sqrt(1 - std::min(ofSquare, 0.5)) -
                          1;
  const Bounded result =
      detail::around(value, unitRange(a[k], others), relative, kMinNormal, square.flags);
  return detail::clipped(result, a[k].lo >= 0 ? 0 : -kInfinity, a[k].hi <= 0 ? 0 : kInfinity);
}

// Distributed, the terms are i[k] and the n products 2 n[j] i[j] n[k]; dot, the product by n[k] and
// the difference round one of them at most n + 2 times. Exact for n[k] = 0 and for a unit axis.
Bounded reflectedComponent(std::span<const Bounded> i, std::span<const Bounded> n,
                           std::size_t k) noexcept {
  assert(i.size() == n.size());
  const double value = plainReflected(Values{i}, Values{n}, k);
  InheritedSum dots;
  for (std::size_t j = 0; j < n.size(); ++j) dots.add(detail::product(n[j], i[j]));
  const Flags flags = dots.flags() | i[k].flags | n[k].flags;
  const double largest = std::max(std::abs(n[k].lo), std::abs(n[k].hi));
  const double magnitude =
      std::max(std::abs(i[k].lo), std::abs(i[k].hi)) + 2 * dots.magnitude() * largest;
  if ((flags & kMayBeNan) || !(magnitude < kMaxFloat / 2))
    return detail::make(value, -kInfinity, kInfinity, flags | kMayBeNan);
  if (isZero(n[k])) return detail::make(value, i[k].lo, i[k].hi, flags);
  if (isUnitAxis(n, k)) return detail::make(value, -i[k].hi, -i[k].lo, flags);

  const auto [lo, hi] = std::minmax({dots.exactLo() * n[k].lo, dots.exactLo() * n[k].hi,
                                     dots.exactHi() * n[k].lo, dots.exactHi() * n[k].hi});
  const double error = rules().gamma(dots.count() + 2) * magnitude * (1 + 0x1p-20) +
                       2 * flushed(dots) * std::max(largest, 1.0) + 2 * kMinNormal;
  return detail::around(value, {i[k].lo - 2 * hi, i[k].hi - 2 * lo}, 0, error, flags);
}

double sum(std::span<const double> x) noexcept {
  return accumulate(x.size(), [&](std::size_t i) { return x[i]; });
}

double dot(std::span<const double> a, std::span<const double> b) noexcept {
  assert(a.size() == b.size());
  return plainDot(a, b);
}

double lengthSquared(std::span<const double> a) noexcept { return plainDot(a, a); }

double length(std::span<const double> a) noexcept { return std::sqrt(plainDot(a, a)); }

double normalizedComponent(std::span<const double> a, std::size_t k) noexcept {
  return a[k] * inversesqrt(plainDot(a, a));
}

double reflectedComponent(std::span<const double> i, std::span<const double> n,
                          std::size_t k) noexcept {
  return plainReflected(i, n, k);
}

}  // namespace gnomon
