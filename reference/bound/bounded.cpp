#include "reference/bound/bounded.h"

#include <iomanip>
#include <limits>
#include <ostream>

#include "reference/bound/ranges.h"

namespace gnomon {
namespace {

// The floats around zero are denormals, which count as zero: a zero stays exact, so that what a
// contract says of zero (a depth of 0 is sky) holds for every arrangement.
Bounded widened(Bounded x) noexcept {
  for (int step = 0; step < rules().widenUlp; ++step) {
    if (x.lo != 0) x.lo = nextFloatDown(x.lo);
    if (x.hi != 0) x.hi = nextFloatUp(x.hi);
  }
  if (x.lo > 0 && x.lo < kMinNormal) x.lo = 0;
  if (x.hi < 0 && x.hi > -kMinNormal) x.hi = 0;
  return x;
}

// NaN or anything: of the infinities and of their neighbours nothing finer is worth tracking.
Bounded everything(double value, Flags flags) noexcept {
  return detail::make(value, -kInfinity, kInfinity, flags | kMayBeNan);
}

bool holds(const Bounded& x, double y) { return x.lo <= y && y <= x.hi; }

bool infinite(const Bounded& x) { return x.lo == -kInfinity || x.hi == kInfinity; }

}  // namespace

Bounded Bounded::between(double lo, double hi) noexcept {
  Bounded result = detail::make(lo / 2 + hi / 2, floorToFloat(lo), ceilToFloat(hi), 0);
  if (lo > 0 && lo < kMinNormal) result.lo = 0;
  if (hi < 0 && hi > -kMinNormal) result.hi = 0;
  return result;
}

Bounded Bounded::input(float x) noexcept { return widened(Bounded(x)); }

Bounded named(const Bounded& x, const char* name) noexcept { return reported(widened(x), name); }

Bounded reported(const Bounded& x, const char* name) noexcept {
  detail::report(&x, 1, name);
  return x;
}

Bounded detail::widenedByRules(const Bounded& x) noexcept { return widened(x); }

Bounded alsoAs(const Bounded& ours, const Bounded& other) noexcept {
  if (rules().widenUlp == 0) return ours;
  return detail::make(ours.value, least(ours.lo, other.lo), most(ours.hi, other.hi),
                      ours.flags | other.flags);
}

bool admits(const Bounded& bound, float got, ZeroSign sign) noexcept {
  if (got != got) return bound.mayBeNan();
  const bool exactZero = bound.lo == 0 && bound.hi == 0 && bound.value == 0;
  if (sign == ZeroSign::asInDouble && exactZero && got == 0)
    return std::signbit(got) == std::signbit(bound.value);
  return bound.lo <= got && got <= bound.hi;
}

Bounded join(const Bounded& a, const Bounded& b) noexcept {
  const bool same = a.lo == b.lo && a.hi == b.hi && a.mayBeNan() == b.mayBeNan();
  return detail::make(a.value, std::min(a.lo, b.lo), std::max(a.hi, b.hi),
                      a.flags | b.flags | (same ? 0 : kAmbiguous));
}

Bounded unspecified(Operation operation, double value, Flags flags) noexcept {
  return everything(value, flags | unspecifiedBy(operation));
}

Bounded detail::addNonFinite(const Bounded& a, const Bounded& b) noexcept {
  const double value = a.value + b.value;
  const Flags flags = a.flags | b.flags;
  const bool opposed =
      (a.hi == kInfinity && b.lo == -kInfinity) || (a.lo == -kInfinity && b.hi == kInfinity);
  if (opposed) return everything(value, flags);
  // Unopposed, an end's sum is finite or infinite but not NaN; only its tail may be NaN.
  const Exact lo = twoSum(a.lo, b.lo), hi = twoSum(a.hi, b.hi);
  return detail::rounded(value, std::isfinite(lo.head) ? lo : Exact{lo.head, 0},
                         std::isfinite(hi.head) ? hi : Exact{hi.head, 0}, flags);
}

Bounded detail::multiplyNonFinite(const Bounded& a, const Bounded& b) noexcept {
  const double value = a.value * b.value;
  const Flags flags = a.flags | b.flags;
  if ((infinite(a) && holds(b, 0)) || (infinite(b) && holds(a, 0))) return everything(value, flags);
  const auto [lo, hi] = std::minmax({a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi});
  return detail::rounded(value, {lo, 0}, {hi, 0}, flags);
}

Bounded detail::minMayBeNan(const Bounded& a, const Bounded& b) noexcept {
  const double hiIfNan =
      std::max(a.mayBeNan() ? b.hi : -kInfinity, b.mayBeNan() ? a.hi : -kInfinity);
  return make(b.value < a.value ? b.value : a.value, std::min(a.lo, b.lo),
              std::max(std::min(a.hi, b.hi), hiIfNan), a.flags | b.flags);
}

Bounded detail::maxMayBeNan(const Bounded& a, const Bounded& b) noexcept {
  const double loIfNan = std::min(a.mayBeNan() ? b.lo : kInfinity, b.mayBeNan() ? a.lo : kInfinity);
  return make(a.value < b.value ? b.value : a.value, std::min(std::max(a.lo, b.lo), loIfNan),
              std::max(a.hi, b.hi), a.flags | b.flags);
}

Bounded operator/(const Bounded& a, const Bounded& b) noexcept {
  const double value = a.value / b.value;
  const Flags flags = a.flags | b.flags;
  const double least = b.lo > 0 ? b.lo : -b.hi, most = b.lo > 0 ? b.hi : -b.lo;
  if (!(least >= kMinNormal && most <= 0x1p126))
    return unspecified(Operation::divide, value, flags);
  const auto [lo, hi] = std::minmax({a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi});
  // Only an exact quotient can be a power of two, and only there does ulp(x) need to know.
  const bool exact = lo == hi && lo == nearestFloat(lo) && lo * b.lo == a.lo && a.isPoint();
  const Error error = rules().error(Operation::divide, a.lo, a.hi);
  return detail::within(value, {lo, hi, exact}, error, flags);
}

std::vector<Operation> unspecifiedOperations(Flags flags) {
  std::vector<Operation> result;
  for (std::size_t i = 0; i < kOperationCount; ++i)
    if (const auto operation = static_cast<Operation>(i); flags & unspecifiedBy(operation))
      result.push_back(operation);
  return result;
}

std::string describe(Flags flags) {
  std::string result;
  const auto say = [&](std::string_view what) {
    result.append(result.empty() ? "" : ", ").append(what);
  };
  if (flags & kAmbiguous) say("ambiguous");
  if (flags & kMayBeNan) say("may be NaN");
  if (flags & kNotJudged) say("not judged");
  for (const Operation operation : unspecifiedOperations(flags))
    say("unspecified: " + std::string(nameOf(operation)));
  return result;
}

// Nine digits name a float, seventeen a double.
std::ostream& operator<<(std::ostream& out, const Bounded& x) {
  const auto before = out.precision(std::numeric_limits<float>::max_digits10);
  out << '[' << x.lo << ", " << x.hi << "] around "
      << std::setprecision(std::numeric_limits<double>::max_digits10) << x.value;
  out.precision(before);
  if (x.flags != 0) out << " (" << describe(x.flags) << ')';
  return out;
}

void PrintTo(const Bounded& x, std::ostream* out) { *out << x; }

}  // namespace gnomon
