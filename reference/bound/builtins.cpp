// The built-ins that round, choose and interpolate; transcendental.cpp has the others.
#include "reference/bound/builtins.h"

#include "reference/bound/inherited.h"
#include "reference/bound/ranges.h"

namespace gnomon {
namespace {

// Monotone and integer-valued: exact, and a jump inside the interval leaves the result open.
Bounded stepped(double value, double lo, double hi, Flags flags) noexcept {
  return detail::make(value, lo, hi, flags | (lo == hi ? 0 : kAmbiguous));
}

}  // namespace

Bounded floor(const Bounded& x) noexcept {
  return stepped(floor(x.value), floor(x.lo), floor(x.hi), x.flags);
}

Bounded ceil(const Bounded& x) noexcept {
  return stepped(ceil(x.value), ceil(x.lo), ceil(x.hi), x.flags);
}

Bounded trunc(const Bounded& x) noexcept {
  return stepped(trunc(x.value), trunc(x.lo), trunc(x.hi), x.flags);
}

Bounded round(const Bounded& x) noexcept {
  return stepped(round(x.value), ceil(x.lo - 0.5), floor(x.hi + 0.5), x.flags);
}

Bounded roundEven(const Bounded& x) noexcept {
  return stepped(roundEven(x.value), roundEven(x.lo), roundEven(x.hi), x.flags);
}

Bounded sign(const Bounded& x) noexcept {
  return stepped(sign(x.value), sign(x.lo), sign(x.hi), x.flags);
}

Bounded fract(const Bounded& x) noexcept {
  const double whole = floor(x.lo);
  if (x.mayBeNan() || std::isinf(x.lo) || std::isinf(x.hi))
    return detail::make(fract(x.value), 0, 1, x.flags | kMayBeNan);
  if (whole != floor(x.hi)) return detail::make(fract(x.value), 0, 1, x.flags | kAmbiguous);
  return detail::rounded(fract(x.value), twoSum(x.lo, -whole), twoSum(x.hi, -whole), x.flags);
}

Bounded step(const Bounded& edge, const Bounded& x) noexcept {
  return select(x < edge, Bounded(0.0f), Bounded(1.0f));
}

Bounded mod(const Bounded& x, const Bounded& y) noexcept {
  const double value = mod(x.value, y.value);
  const Bounded quotient = x / y;
  if (quotient.unspecified() || quotient.mayBeNan())
    return unspecified(Operation::mod, value, quotient.flags);
  const Bounded whole = floor(quotient);
  const Bounded result = fma(-y, whole, x);
  // With floor open, exact result and formula still both lie in `result`: its width bounds E.
  const double width = whole.isPoint() ? 0 : result.hi - result.lo;
  return detail::floatsIn(value, result.lo - width, result.hi + width, result.flags);
}

Bounded clamp(const Bounded& x, const Bounded& lo, const Bounded& hi) noexcept {
  if (lo.hi > hi.lo || lo.mayBeNan() || hi.mayBeNan())
    return unspecified(Operation::clamp, clamp(x.value, lo.value, hi.value),
                       x.flags | lo.flags | hi.flags);
  return min(max(x, lo), hi);
}

Bounded square(const Bounded& x) noexcept {
  const Bounded magnitude = abs(x);
  return magnitude * magnitude;
}

Bounded fma(const Bounded& a, const Bounded& b, const Bounded& c) noexcept {
  detail::InheritedSum sum;
  sum.add(detail::product(a, b));
  sum.add(detail::product(c));
  return sum.result(fma(a.value, b.value, c.value), 2);
}

// Of all forms x - x a + y a has the largest terms, and no form rounds one of them more than three
// times. The exact value is linear in each operand, so its extremes are at corners.
Bounded mix(const Bounded& x, const Bounded& y, const Bounded& a) noexcept {
  detail::InheritedSum sum;
  sum.add(detail::product(x));
  sum.add(detail::product(-x, a));
  sum.add(detail::product(y, a));
  const auto at = [&](double t) {
    const double towardsX[] = {x.lo * (1 - t), x.hi * (1 - t)};
    const double towardsY[] = {y.lo * t, y.hi * t};
    return detail::Range{std::min(towardsX[0], towardsX[1]) + std::min(towardsY[0], towardsY[1]),
                         std::max(towardsX[0], towardsX[1]) + std::max(towardsY[0], towardsY[1])};
  };
  const detail::Range atLo = at(a.lo), atHi = at(a.hi);
  sum.narrow(std::min(atLo.lo, atHi.lo), std::max(atLo.hi, atHi.hi));
  return sum.result(mix(x.value, y.value, a.value), 3);
}

// t = (x - e0) / (e1 - e0) may be evaluated as x / d - e0 / d: three roundings and a division for
// each of |x| / d and |e0| / d. Then h(t) = 3 t^2 - 2 t^3, whose slope is 6 t (1 - t), in at most
// three roundings of either term, since 2 t is exact; h is exact where clamp yields 0 or 1.
Bounded smoothstep(const Bounded& edge0, const Bounded& edge1, const Bounded& x) noexcept {
  const double value = smoothstep(edge0.value, edge1.value, x.value);
  const Flags flags = edge0.flags | edge1.flags | x.flags;
  const double least = edge1.lo - edge0.hi, most = edge1.hi - edge0.lo;
  const bool bounded = std::isfinite(x.lo + x.hi + most);
  if ((flags & kMayBeNan) || !bounded || !(least >= kMinNormal && most <= 0x1p126))
    return unspecified(Operation::smoothstep, value, flags);

  const auto size = [](const Bounded& b) { return std::max(std::abs(b.lo), std::abs(b.hi)); };
  const double divide = detail::relativeError(Operation::divide);
  const double roundings3 = rules().gamma(3);
  const double error =
      (roundings3 + divide * (1 + roundings3)) * (size(x) + size(edge0)) / least * (1 + 0x1p-20) +
      4 * kMinNormal;
  // t falls with edge0 at x < edge1 and rises above, but only inside [0, 1] does it matter.
  const auto t = [&](double at, double e0, double e1, double slack) {
    return std::clamp((at - e0) / (e1 - e0) + slack, 0.0, 1.0);
  };
  const double tLo = t(x.lo, edge0.hi, edge1.hi, -error), tHi = t(x.hi, edge0.lo, edge1.lo, error);
  if (tLo == tHi) return detail::make(value, tLo, tLo, flags);
  const auto h = [](double at) { return at * at * (3 - 2 * at); };
  const double steepest = std::clamp(0.5, tLo, tHi);
  const double moved = std::min(6 * steepest * (1 - steepest) * error, h(tHi) - h(tLo));
  const double rounded = roundings3 * (3 + 2 * tHi) * tHi * tHi;
  const double exactLo = t(x.lo, edge0.hi, edge1.hi, 0), exactHi = t(x.hi, edge0.lo, edge1.lo, 0);
  const Bounded result =
      detail::around(value, {h(exactLo), h(exactHi)}, 0, moved + rounded + 4 * kMinNormal, flags);
  return detail::clipped(result, 0, kInfinity);
}

Decision isFinite(const Bounded& x) noexcept {
  const bool mayHold = x.lo < kInfinity && x.hi > -kInfinity;
  const bool mayFail = x.mayBeNan() || x.lo == -kInfinity || x.hi == kInfinity;
  return {mayHold, mayFail, isFinite(x.value), x.flags};
}

Decision isInf(const Bounded& x) noexcept {
  const bool mayHold = x.lo == -kInfinity || x.hi == kInfinity;
  const bool mayFail = x.mayBeNan() || (x.lo < kInfinity && x.hi > -kInfinity);
  return {mayHold, mayFail, isInf(x.value), x.flags};
}

Decision isNan(const Bounded& x) noexcept { return {x.mayBeNan(), true, isNan(x.value), x.flags}; }

}  // namespace gnomon
