#include "reference/bound/inherited.h"

#include "reference/bound/ranges.h"

namespace gnomon::detail {
namespace {

// Weight of the lowest bit set in x, for a product of floats: 2^-298 and up, so normal in double.
double lowestBit(double x) noexcept {
  constexpr std::uint64_t kImplicit = std::uint64_t{1} << 52;
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const auto zeros = static_cast<std::uint64_t>(std::countr_zero(bits | kImplicit));
  const std::uint64_t exponent = (bits >> 52) & 0x7ff;
  return std::bit_cast<double>((exponent + zeros - 52) << 52);
}

}  // namespace

Term product(const Bounded& a) noexcept { return {a.lo, a.hi, a.flags}; }

Term product(const Bounded& a, const Bounded& b) noexcept {
  const double p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
  const double lo = least(least(p, q), least(r, s));
  const double hi = most(most(p, q), most(r, s));
  if (!std::isfinite(p + q + r + s)) return {-kInfinity, kInfinity, a.flags | b.flags | kMayBeNan};
  return {lo, hi, a.flags | b.flags};
}

Term productOfSame(const Bounded& a) noexcept {
  const Bounded magnitude = abs(a);
  return {magnitude.lo * magnitude.lo, magnitude.hi * magnitude.hi, a.flags};
}

void InheritedSum::add(const Term& term) noexcept {
  flags_ |= term.flags;
  if (term.lo == 0 && term.hi == 0) return;
  lo_ += term.lo;
  hi_ += term.hi;
  magnitude_ += std::max(std::abs(term.lo), std::abs(term.hi));
  points_ = points_ && term.lo == term.hi;
  if (points_) grid_ = std::min(grid_, lowestBit(term.lo));
  neverNegative_ = neverNegative_ && term.lo >= 0;
  neverPositive_ = neverPositive_ && term.hi <= 0;
  count_ += 1;
  last_ = term;
}

void InheritedSum::narrow(double lo, double hi) noexcept {
  narrowLo_ = lo;
  narrowHi_ = hi;
}

bool InheritedSum::staysExact() const noexcept {
  return points_ && grid_ >= kMinNormal && magnitude_ <= 0x1p24 * grid_;
}

// Only the product is rounded: nothing changes a term to which zeros are added.
Bounded InheritedSum::ofOneTerm(double value) const noexcept {
  const Bounded once = rounded(value, {last_.lo, 0}, {last_.hi, 0}, flags_);
  if (!points_)
    return around(value, {last_.lo, last_.hi}, 0, rules().gamma(1) * magnitude_ + kMinNormal,
                  flags_);
  const double x = last_.lo, worst = std::max(x - once.lo, once.hi - x);
  return worst == 0 ? once : around(value, {x, x, true}, 0, worst, flags_);
}

Bounded InheritedSum::result(double value, double roundings) const noexcept {
  const Bounded anything = make(value, -kInfinity, kInfinity, flags_ | kMayBeNan);
  const double reach = magnitude_ * (1 + rules().gamma(roundings));
  if ((flags_ & kMayBeNan) != 0 || !(reach < kInfinity)) return anything;
  if (count_ == 0) return make(value, 0, 0, flags_);
  // A partial sum may overflow, and meet one that overflows the other way.
  const bool overflows = reach > kMaxFloat;
  if (overflows && !neverNegative_ && !neverPositive_) return anything;
  if (count_ == 1) return ofOneTerm(value);
  if (staysExact() && !overflows) return make(value, lo_, lo_, flags_);
  // The doubles above err by n 2^-53 of the magnitude, below 2^-28 of gamma_n.
  const double error =
      rules().gamma(roundings) * magnitude_ * (1 + 0x1p-20) + 2 * count_ * kMinNormal;
  const Bounded sum = around(value, {exactLo(), exactHi()}, 0, error, flags_);
  return clipped(sum, neverNegative_ ? 0 : -kInfinity, neverPositive_ ? 0 : kInfinity);
}

}  // namespace gnomon::detail
