// sqrt, exponentials, logarithms and angles. Each is monotone where it is used, so the exact range
// comes from the ends; the error comes from Rules, or from the formula that it is inherited from.
#include <numbers>
#include <optional>

#include "reference/bound/builtins.h"
#include "reference/bound/inherited.h"
#include "reference/bound/ranges.h"

namespace gnomon {
namespace {

using detail::Range;
using detail::relativeError;
using detail::sqrtError;

// An error of 1 ULP is at most this share of a normal result.
constexpr double kUlp = 0x1p-23;

// The measured bound, for an operation that inherits its precision in the specification.
std::optional<Bounded> measured(Operation operation, double value, Range range, Flags flags) {
  const auto& error = rules().measuredError(operation);
  if (!error) return std::nullopt;
  return detail::within(value, range, *error, flags);
}

// The nearest float of pi counts as inside [-pi, pi]: see kAssumedExceptions.
bool inSineDomain(const Bounded& x) {
  constexpr double kPi = std::numbers::pi_v<float>;
  return !x.mayBeNan() && x.lo >= -kPi && x.hi <= kPi;
}

Range sineRange(double lo, double hi) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const double a = std::sin(lo), b = std::sin(hi);
  return {lo <= -kQuarter && -kQuarter <= hi ? -1 : std::min(a, b),
          lo <= kQuarter && kQuarter <= hi ? 1 : std::max(a, b)};
}

Range cosineRange(double lo, double hi) {
  const double a = std::cos(lo), b = std::cos(hi);
  return {std::min(a, b), lo <= 0 && 0 <= hi ? 1 : std::max(a, b)};
}

// exp2(x) is exact for an integer x, and nowhere else.
Range exp2Range(const Bounded& x) {
  return {std::exp2(x.lo), std::exp2(x.hi), x.isPoint() && std::floor(x.lo) == x.lo};
}

Range log2Range(const Bounded& x) {
  const double lo = std::log2(x.lo), hi = std::log2(x.hi);
  return {lo, hi, lo == hi && std::floor(lo) == lo && std::exp2(lo) == x.lo};
}

// Worst error of c = sqrt(1 - x x), given the least c. x x and the difference are rounded once each
// below 1, where floats are u / 2 (to nearest: u) apart: c^2 moves by at most u, and c most where
// it is least and shrinks, by c - sqrt(c^2 - u) = u / (c + sqrt(c^2 - u)), or by sqrt(u) if that is
// all of it. It is never the root of a negative, since x x <= 1 survives rounding. Then sqrt errs.
double complementError(double cosine) {
  const double u = rules().unitRoundoff(), square = cosine * cosine;
  const double moved = square > u ? u / (cosine + std::sqrt(square - u)) : std::sqrt(u);
  return moved * (1 + 0x1p-20) + sqrtError() * (1 + moved);
}

// The angle at (x, c) when c errs by d: tan of the difference is x d / (x^2 + c (c - d)), at most
// 4/3 |x| d, since x^2 + c^2 = 1 and d is either tiny or c^2 < 1/4. Then atan2's own error.
Bounded inheritedAngle(const Bounded& x, double value, Range angle, double complement) {
  const double moved = complement * std::max(std::abs(x.lo), std::abs(x.hi)) * 4 / 3;
  const double largest = std::max(std::abs(angle.lo), std::abs(angle.hi)) + moved;
  const double error = moved + relativeError(Operation::atan2) * largest + 2 * kMinNormal;
  return detail::around(value, angle, 0, error, x.flags);
}

}  // namespace

Bounded inversesqrt(const Bounded& x) noexcept {
  const double value = inversesqrt(x.value);
  if (!(x.lo > 0) || x.mayBeNan()) return unspecified(Operation::inverseSqrt, value, x.flags);
  const double lo = 1 / std::sqrt(x.hi), hi = 1 / std::sqrt(x.lo);
  const bool exact = lo == hi && lo == nearestFloat(lo) && lo * lo * x.lo == 1;
  const Error error = rules().error(Operation::inverseSqrt, x.lo, x.hi);
  return detail::within(value, {lo, hi, exact}, error, x.flags);
}

Bounded sqrt(const Bounded& x) noexcept {
  const double value = sqrt(x.value);
  if (!(x.lo >= 0) || x.mayBeNan()) return unspecified(Operation::sqrt, value, x.flags);
  const double lo = std::sqrt(x.lo), hi = std::sqrt(x.hi);
  const bool exact = lo == hi && lo == nearestFloat(lo) && lo * lo == x.lo;
  if (const auto known = measured(Operation::sqrt, value, {lo, hi, exact}, x.flags)) return *known;
  return detail::around(value, {lo, hi, exact}, sqrtError(), 0, x.flags);
}

Bounded exp(const Bounded& x) noexcept {
  const double value = exp(x.value);
  if (x.mayBeNan()) return unspecified(Operation::exp, value, x.flags);
  const bool exact = x.lo == 0 && x.hi == 0;
  const Error error = rules().error(Operation::exp, x.lo, x.hi);
  return detail::within(value, {std::exp(x.lo), std::exp(x.hi), exact}, error, x.flags);
}

Bounded exp2(const Bounded& x) noexcept {
  const double value = exp2(x.value);
  if (x.mayBeNan()) return unspecified(Operation::exp2, value, x.flags);
  return detail::within(value, exp2Range(x), rules().error(Operation::exp2, x.lo, x.hi), x.flags);
}

Bounded log(const Bounded& x) noexcept {
  const double value = log(x.value);
  if (!(x.lo > 0) || x.mayBeNan()) return unspecified(Operation::log, value, x.flags);
  const Error error = rules().error(Operation::log, x.lo, x.hi);
  const bool exact = x.lo == 1 && x.hi == 1;
  return detail::within(value, {std::log(x.lo), std::log(x.hi), exact}, error, x.flags);
}

Bounded log2(const Bounded& x) noexcept {
  const double value = log2(x.value);
  if (!(x.lo > 0) || x.mayBeNan()) return unspecified(Operation::log2, value, x.flags);
  return detail::within(value, log2Range(x), rules().error(Operation::log2, x.lo, x.hi), x.flags);
}

// p = y log2(x) errs by the error of log2 times |y| and by its own rounding, so exp2(p) by the
// factor 2^that, and then by exp2's own error. At x = 0 the result is 0.
Bounded pow(const Bounded& x, const Bounded& y) noexcept {
  const double value = pow(x.value, y.value);
  const Flags flags = x.flags | y.flags;
  if ((flags & kMayBeNan) || !(x.lo > 0 || (x.lo == 0 && y.lo > 0)) || std::isinf(y.hi - y.lo))
    return unspecified(Operation::pow, value, flags);
  const auto [lo, hi] = std::minmax(
      {std::pow(x.lo, y.lo), std::pow(x.lo, y.hi), std::pow(x.hi, y.lo), std::pow(x.hi, y.hi)});
  if (const auto known = measured(Operation::pow, value, {lo, hi}, flags)) return *known;
  if (x.hi == 0) return detail::make(value, 0, 0, flags);

  // Below 2^-149 (x = 0 included) the logarithm is that of no float, and the result only smaller.
  const Bounded logarithm = log2(detail::make(x.value, std::max(x.lo, kMinDenormal), x.hi, flags));
  const Error logError = rules().error(Operation::log2, std::max(x.lo, kMinDenormal), x.hi);
  const double logSize = std::max(std::abs(logarithm.lo), std::abs(logarithm.hi));
  const double ySize = std::max(std::abs(y.lo), std::abs(y.hi));
  const double power = ySize * logSize;
  const double moved = ySize * std::max(logError.ulp * spacing(logSize), logError.absolute) +
                       rules().unitRoundoff() * power + kMinNormal;
  const double exp2Error = rules().error(Operation::exp2, -power - moved, power + moved).ulp * kUlp;
  const double relative = std::exp2(moved) * (1 + exp2Error) - 1;
  const Bounded result = detail::around(value, {lo, hi}, relative, 0, flags);
  // A denormal result errs by whole denormals, and a flushed one by all of itself.
  return detail::floatsIn(value, lo < 2 * kMinNormal ? 0 : std::max(result.lo, 0.0),
                          std::max(result.hi, hi < kMinNormal ? 2 * kMinNormal : 0), flags);
}

Bounded sin(const Bounded& x) noexcept {
  const double value = sin(x.value);
  if (!inSineDomain(x)) return unspecified(Operation::sin, value, x.flags);
  const Error error = rules().error(Operation::sin, x.lo, x.hi);
  return detail::within(value, sineRange(x.lo, x.hi), error, x.flags);
}

Bounded cos(const Bounded& x) noexcept {
  const double value = cos(x.value);
  if (!inSineDomain(x)) return unspecified(Operation::cos, value, x.flags);
  const Error error = rules().error(Operation::cos, x.lo, x.hi);
  return detail::within(value, cosineRange(x.lo, x.hi), error, x.flags);
}

// With |error of sin|, |error of cos| <= e: (s + e) / (c - e) - s / c = e (s + c) / (c (c - e)),
// and s + c <= sqrt(2); then the division.
Bounded tan(const Bounded& x) noexcept {
  const double value = tan(x.value);
  const Range cosine = cosineRange(x.lo, x.hi);
  const double least = std::max(cosine.lo, -cosine.hi);
  if (!inSineDomain(x) || !(least > 0)) return unspecified(Operation::tan, value, x.flags);
  const Range tangent{std::tan(x.lo), std::tan(x.hi)};
  if (const auto known = measured(Operation::tan, value, tangent, x.flags)) return *known;

  const Error sine = rules().error(Operation::sin, x.lo, x.hi);
  const Error cosineError = rules().error(Operation::cos, x.lo, x.hi);
  const double e =
      std::max({sine.absolute, cosineError.absolute, sine.ulp * kUlp, cosineError.ulp * kUlp});
  if (!(least - e > kMinNormal)) return unspecified(Operation::tan, value, x.flags);
  const double moved = std::numbers::sqrt2 * e / (least * (least - e));
  const double largest = std::max(std::abs(tangent.lo), std::abs(tangent.hi)) + moved;
  return detail::around(value, tangent, 0,
                        moved + relativeError(Operation::divide) * largest + 2 * kMinNormal,
                        x.flags);
}

Bounded asin(const Bounded& x) noexcept {
  const double value = asin(x.value);
  if (!(x.lo >= -1 && x.hi <= 1) || x.mayBeNan())
    return unspecified(Operation::asin, value, x.flags);
  const Range angle{std::asin(x.lo), std::asin(x.hi)};
  if (const auto known = measured(Operation::asin, value, angle, x.flags)) return *known;
  const double cosine = std::min(std::cos(angle.lo), std::cos(angle.hi));
  return inheritedAngle(x, value, angle, complementError(cosine));
}

Bounded acos(const Bounded& x) noexcept {
  const double value = acos(x.value);
  if (!(x.lo >= -1 && x.hi <= 1) || x.mayBeNan())
    return unspecified(Operation::acos, value, x.flags);
  const Range angle{std::acos(x.hi), std::acos(x.lo)};
  if (const auto known = measured(Operation::acos, value, angle, x.flags)) return *known;
  const double sine = std::min(std::sin(angle.lo), std::sin(angle.hi));
  return detail::clipped(inheritedAngle(x, value, angle, complementError(sine)), 0, kInfinity);
}

Bounded atan(const Bounded& x) noexcept {
  const double value = atan(x.value);
  if (x.mayBeNan()) return unspecified(Operation::atan, value, x.flags);
  const Error error = rules().error(Operation::atan, x.lo, x.hi);
  return detail::within(value, {std::atan(x.lo), std::atan(x.hi)}, error, x.flags);
}

Bounded atan2(const Bounded& y, const Bounded& x) noexcept {
  const double value = atan2(y.value, x.value);
  const Flags flags = y.flags | x.flags;
  const bool acrossX = y.lo <= 0 && 0 <= y.hi, acrossY = x.lo <= 0 && 0 <= x.hi;
  if ((flags & kMayBeNan) || (acrossX && acrossY) || std::isinf(y.lo - y.hi) ||
      std::isinf(x.lo - x.hi))
    return unspecified(Operation::atan2, value, flags);
  const Error error = rules().error(Operation::atan2, 0, 0);
  if (acrossX && x.hi < 0) {
    constexpr double kPi = std::numbers::pi;
    return detail::within(value, {-kPi, kPi}, error, flags | kAmbiguous);
  }
  // A box clear of the origin and of the cut is seen from the origin between two of its corners.
  const auto [lo, hi] = std::minmax({std::atan2(y.lo, x.lo), std::atan2(y.lo, x.hi),
                                     std::atan2(y.hi, x.lo), std::atan2(y.hi, x.hi)});
  return detail::within(value, {lo, hi}, error, flags);
}

}  // namespace gnomon
