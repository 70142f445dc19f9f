#include "reference/bound/integer.h"

#include <algorithm>
#include <limits>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "reference/bound/builtins.h"

namespace gnomon {
namespace {

constexpr std::int64_t kLeast = std::numeric_limits<std::int32_t>::min();
constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();

// Operands are kept within 33 bits, so nothing here overflows 64.
IntRange make(std::int64_t value, std::int64_t lo, std::int64_t hi, Flags flags) noexcept {
  IntRange result;
  result.value = value;
  result.lo = std::max(lo, kLeast);
  result.hi = std::min(hi, kMost);
  result.flags = flags;
  if (result.lo != lo || result.hi != hi) {
    result.lo = kLeast;
    result.hi = kMost;
    result.flags |= unspecifiedBy(Operation::integer);
  }
  return result;
}

IntRange outside(std::int64_t value, Operation operation, Flags flags) noexcept {
  return make(value, kLeast, kMost, flags | unspecifiedBy(operation));
}

// The extremes of a function that is monotone in each operand.
template <class F>
IntRange atCorners(const IntRange& a, const IntRange& b, const F& f) noexcept {
  const auto [lo, hi] = std::minmax({f(a.lo, b.lo), f(a.lo, b.hi), f(a.hi, b.lo), f(a.hi, b.hi)});
  return make(f(a.value, b.value), lo, hi, a.flags | b.flags);
}

bool shiftable(const IntRange& by) {
  return by.lo >= 0 && by.hi < 32 && by.value >= 0 && by.value < 32;
}

}  // namespace

IntRange IntRange::between(std::int64_t lo, std::int64_t hi) noexcept {
  return make(lo + (hi - lo) / 2, lo, hi, 0);
}

std::int64_t IntRange::certain() const {
  if (isPoint() && !unspecified()) return lo;
  std::ostringstream text;
  text << "an integer that has to be certain is " << *this;
  throw std::logic_error(text.str());
}

Bounded IntRange::toBounded() const noexcept {
  const Exact low{static_cast<double>(lo), 0}, high{static_cast<double>(hi), 0};
  return detail::rounded(static_cast<double>(value), low, high, flags);
}

std::ostream& operator<<(std::ostream& out, const IntRange& x) {
  out << '[' << x.lo << ", " << x.hi << "] around " << x.value;
  if (x.flags != 0) out << " (" << describe(x.flags) << ')';
  return out;
}

void PrintTo(const IntRange& x, std::ostream* out) { *out << x; }

IntRange operator-(const IntRange& a) noexcept { return make(-a.value, -a.hi, -a.lo, a.flags); }

IntRange operator+(const IntRange& a, const IntRange& b) noexcept {
  return make(a.value + b.value, a.lo + b.lo, a.hi + b.hi, a.flags | b.flags);
}

IntRange operator-(const IntRange& a, const IntRange& b) noexcept { return a + -b; }

IntRange operator*(const IntRange& a, const IntRange& b) noexcept {
  return atCorners(a, b, [](std::int64_t x, std::int64_t y) { return x * y; });
}

IntRange operator/(const IntRange& a, const IntRange& b) noexcept {
  if (b.value == 0 || (b.lo <= 0 && 0 <= b.hi))
    return outside(0, Operation::integer, a.flags | b.flags);
  return atCorners(a, b, [](std::int64_t x, std::int64_t y) { return x / y; });
}

// Below every divisor the number itself; between multiples of a single divisor the remainder only
// grows; else anything below the largest divisor.
IntRange operator%(const IntRange& a, const IntRange& b) noexcept {
  const Flags flags = a.flags | b.flags;
  if (a.lo < 0 || b.lo <= 0 || b.value == 0) return outside(0, Operation::integer, flags);
  const std::int64_t value = a.value % b.value;
  if (a.hi < b.lo) return make(value, a.lo, a.hi, flags);
  if (b.isPoint() && a.lo / b.lo == a.hi / b.lo)
    return make(value, a.lo % b.lo, a.hi % b.lo, flags);
  return make(value, 0, std::min(a.hi, b.hi - 1), flags | kAmbiguous);
}

IntRange operator<<(const IntRange& a, const IntRange& b) noexcept {
  if (!shiftable(b)) return outside(a.value, Operation::integer, a.flags | b.flags);
  return atCorners(a, b, [](std::int64_t x, std::int64_t by) { return x << by; });
}

IntRange operator>>(const IntRange& a, const IntRange& b) noexcept {
  if (!shiftable(b)) return outside(a.value, Operation::integer, a.flags | b.flags);
  return atCorners(a, b, [](std::int64_t x, std::int64_t by) { return x >> by; });
}

IntRange min(const IntRange& a, const IntRange& b) noexcept {
  return make(std::min(a.value, b.value), std::min(a.lo, b.lo), std::min(a.hi, b.hi),
              a.flags | b.flags);
}

IntRange max(const IntRange& a, const IntRange& b) noexcept {
  return make(std::max(a.value, b.value), std::max(a.lo, b.lo), std::max(a.hi, b.hi),
              a.flags | b.flags);
}

IntRange clamp(const IntRange& x, const IntRange& lo, const IntRange& hi) noexcept {
  if (lo.hi > hi.lo) return outside(x.value, Operation::clamp, x.flags | lo.flags | hi.flags);
  return min(max(x, lo), hi);
}

IntRange join(const IntRange& a, const IntRange& b) noexcept {
  const bool same = a.lo == b.lo && a.hi == b.hi;
  return make(a.value, std::min(a.lo, b.lo), std::max(a.hi, b.hi),
              a.flags | b.flags | (same ? 0 : kAmbiguous));
}

IntRange select(const Decision& condition, const IntRange& a, const IntRange& b) noexcept {
  if (!condition.undecided()) return condition.canBeTrue ? a : b;
  IntRange result = condition.value ? join(a, b) : join(b, a);
  result.flags |= condition.flags & kFromConditions;
  return result;
}

Decision operator<(const IntRange& a, const IntRange& b) noexcept {
  return {a.lo < b.hi, a.hi >= b.lo, a.value < b.value, a.flags | b.flags};
}

Decision operator<=(const IntRange& a, const IntRange& b) noexcept {
  return {a.lo <= b.hi, a.hi > b.lo, a.value <= b.value, a.flags | b.flags};
}

Decision operator==(const IntRange& a, const IntRange& b) noexcept {
  const bool samePoint = a.isPoint() && b.isPoint() && a.lo == b.lo;
  return {a.lo <= b.hi && b.lo <= a.hi, !samePoint, a.value == b.value, a.flags | b.flags};
}

IntRange toInt(const Bounded& x) noexcept {
  const Bounded whole = trunc(x);
  const auto fits = [](double y) {
    return y >= static_cast<double>(kLeast) && y <= static_cast<double>(kMost);
  };
  const std::int64_t value = fits(whole.value) ? toInt(whole.value) : 0;
  if (x.mayBeNan() || !fits(whole.lo) || !fits(whole.hi))
    return outside(value, Operation::toInteger, whole.flags);
  return make(value, toInt(whole.lo), toInt(whole.hi), whole.flags);
}

IntRange floorToInt(const Bounded& x) noexcept { return toInt(floor(x)); }

Bounded withoutLimits(const Bounded& x, Flags flags) noexcept {
  return detail::make(x.value, -kInfinity, kInfinity, x.flags | flags | kMayBeNan);
}

IntRange withoutLimits(const IntRange& x, Flags flags) noexcept {
  return make(x.value, kLeast, kMost, x.flags | flags);
}

}  // namespace gnomon
