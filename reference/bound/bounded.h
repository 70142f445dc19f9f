// Bounded: the number type in which a model of a shader runs on the CPU. It carries the plain
// double result and the interval of all results that a conforming implementation may return.
//
// - Both ends of [lo, hi] are floats (or infinities), since every float32 result is one. Ends are
//   rounded to float, outward for + - * and inward where a rule allows a real range. `value` is
//   the model in unrounded double and may lie outside [lo, hi] by the roundings it does not make.
// - An operation may flush a denormal operand or result to zero. A denormal is therefore the
//   interval between it and zero, as input, literal and result alike, also where the operation
//   only moves bits and would have to keep it.
// - The sign of zero is not tracked: an interval that holds 0 holds both zeros, and where a sign
//   of zero decides (atan2) both sides are taken. `value` follows IEEE 754, so a judge whose
//   contract fixes the sign of an exact zero asks admits() with ZeroSign::asInDouble.
// - Operands are taken as independent: x * x over [-1, 1] is [-1, 1], square(x) is [0, 1].
#ifndef GNOMON_REFERENCE_BOUND_BOUNDED_H
#define GNOMON_REFERENCE_BOUND_BOUNDED_H

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <utility>

#include "reference/bound/decision.h"
#include "reference/bound/flags.h"
#include "reference/bound/float.h"

namespace gnomon {

template <class I>
concept Integer = std::integral<I> && !std::same_as<I, bool>;

struct Bounded {
  double value = 0;
  double lo = 0, hi = 0;
  Flags flags = 0;

  constexpr Bounded() noexcept = default;

  // A literal of the shader, or a number that is known as a float. Not for a kernel's inputs.
  constexpr Bounded(float x) noexcept : value(x), lo(x), hi(x), flags(x == x ? 0 : kMayBeNan) {
    if (lo > 0 && lo < kMinNormal) lo = 0;
    if (hi < 0 && hi > -kMinNormal) hi = 0;
    if (flags != 0) lo = -kInfinity, hi = kInfinity;
  }
  // OpConvertSToF, OpConvertUToF: rounded like + - *.
  template <Integer I>
  Bounded(I x) noexcept;
  // A real literal is a float in the shader: 0.1f, not 0.1.
  Bounded(double) = delete;
  Bounded(bool) = delete;

  // Anything in [lo, hi], rounded outward to float; `value` is the middle.
  static Bounded between(double lo, double hi) noexcept;
  // A kernel's input: widened by the rules' widenUlp. NaN becomes everything, NaN included.
  static Bounded input(float x) noexcept;

  bool isPoint() const noexcept { return lo == hi && (flags & kMayBeNan) == 0; }
  bool ambiguous() const noexcept { return (flags & kAmbiguous) != 0; }
  bool mayBeNan() const noexcept { return (flags & kMayBeNan) != 0; }
  bool unspecified() const noexcept { return (flags & kUnspecified) != 0; }
  bool notJudged() const noexcept { return (flags & kNotJudged) != 0; }
};
static_assert(sizeof(Bounded) == 32);

// Whether a conforming implementation may have returned `got`.
enum class ZeroSign : std::uint8_t { any, asInDouble };
bool admits(const Bounded& bound, float got, ZeroSign sign = ZeroSign::any) noexcept;

std::ostream& operator<<(std::ostream& out, const Bounded& x);
void PrintTo(const Bounded& x, std::ostream* out);  // GoogleTest's hook

// An intermediate that the contract names: widened by the rules' widenUlp, so that a kernel may
// arrange differently what leads to it. The plain model passes unchanged.
Bounded named(const Bounded& x, const char* name) noexcept;
inline double named(double x, const char*) noexcept { return x; }

// An intermediate that is only told to whoever records (recording.h): nothing is widened, because
// it is an input, or no arrangement has it otherwise.
Bounded reported(const Bounded& x, const char* name) noexcept;
inline double reported(double x, const char*) noexcept { return x; }

// Two expressions of one quantity, of which ours is the first. Where the rules widen, an
// arrangement may start from either: their hull, which is no ambiguity.
Bounded alsoAs(const Bounded& ours, const Bounded& other) noexcept;
inline double alsoAs(double ours, double) noexcept { return ours; }

// Either of the two, flags united; ambiguous unless they are the same. Keeps a's value.
Bounded join(const Bounded& a, const Bounded& b) noexcept;
// Any result at all, because `operation` is not specified there.
Bounded unspecified(Operation operation, double value, Flags flags) noexcept;

namespace detail {

Bounded widenedByRules(const Bounded& x) noexcept;
// Tells a whole vector at once.
void report(const Bounded* components, std::size_t n, const char* name) noexcept;

Bounded addNonFinite(const Bounded& a, const Bounded& b) noexcept;
Bounded multiplyNonFinite(const Bounded& a, const Bounded& b) noexcept;
Bounded minMayBeNan(const Bounded& a, const Bounded& b) noexcept;
Bounded maxMayBeNan(const Bounded& a, const Bounded& b) noexcept;

inline Bounded make(double value, double lo, double hi, Flags flags) noexcept {
  Bounded result;
  result.value = value;
  result.lo = lo;
  result.hi = hi;
  result.flags = flags;
  return result;
}

// "Correctly rounded" for all reals in [lo, hi]; rounding is monotone, so the ends suffice. A
// result counts as denormal, and may be flushed, by its value before rounding.
inline Bounded rounded(double value, Exact lo, Exact hi, Flags flags) noexcept {
  const bool nearest = rules().rounding == Rounding::nearestEven;
  const double low = nearest ? nearestFloat(lo.head) : floorToFloat(lo);
  const double high = nearest ? nearestFloat(hi.head) : ceilToFloat(hi);
  const double flushedLow = lo.head > 0 ? 0.0 : low;
  const double flushedHigh = hi.head < 0 ? 0.0 : high;
  return make(value, lo.head < kMinNormal ? flushedLow : low,
              hi.head > -kMinNormal ? flushedHigh : high, flags);
}

}  // namespace detail

// + - *: "correctly rounded". The sum of two floats in double rounds twice when it is rounded to
// nearest float, which is innocuous: 53 >= 2 * 24 + 2 (Figueroa, When is double rounding
// innocuous?, 1995). For the directed ends twoSum keeps what the first rounding drops.
inline Bounded operator+(const Bounded& a, const Bounded& b) noexcept {
  const Exact lo = twoSum(a.lo, b.lo), hi = twoSum(a.hi, b.hi);
  if (!(std::abs(lo.head) + std::abs(hi.head) < kInfinity)) [[unlikely]]
    return detail::addNonFinite(a, b);
  return detail::rounded(a.value + b.value, lo, hi, a.flags | b.flags);
}

// OpFNegate: "correct result".
constexpr Bounded operator-(const Bounded& a) noexcept {
  Bounded result;
  result.value = -a.value;
  result.lo = -a.hi;
  result.hi = -a.lo;
  result.flags = a.flags;
  return result;
}
constexpr const Bounded& operator+(const Bounded& a) noexcept { return a; }
inline Bounded operator-(const Bounded& a, const Bounded& b) noexcept { return a + -b; }

// The product of two floats is exact in double: 48 bits, exponents in [-298, 256].
inline Bounded operator*(const Bounded& a, const Bounded& b) noexcept {
  const double p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
  if (!(std::abs(p) + std::abs(q) + std::abs(r) + std::abs(s) < kInfinity)) [[unlikely]]
    return detail::multiplyNonFinite(a, b);
  const double lo = least(least(p, q), least(r, s));
  const double hi = most(most(p, q), most(r, s));
  return detail::rounded(a.value * b.value, {lo, 0}, {hi, 0}, a.flags | b.flags);
}

// 2.5 ULP for a divisor whose magnitude is in [2^-126, 2^126], else unspecified; also for a
// divisor 0, which only recent editions of the specification include.
Bounded operator/(const Bounded& a, const Bounded& b) noexcept;

inline Bounded& operator+=(Bounded& a, const Bounded& b) noexcept { return a = a + b; }
inline Bounded& operator-=(Bounded& a, const Bounded& b) noexcept { return a = a - b; }
inline Bounded& operator*=(Bounded& a, const Bounded& b) noexcept { return a = a * b; }
inline Bounded& operator/=(Bounded& a, const Bounded& b) noexcept { return a = a / b; }

template <Integer I>
Bounded::Bounded(I x) noexcept {
  const Exact exact{static_cast<double>(x), 0};
  assert(std::abs(exact.head) <= 0x1p53 && "exact in double, as every integer of a shader is");
  *this = detail::rounded(exact.head, exact, exact, 0);
}

// Comparisons are exact, but a NaN on either side leaves the outcome open.
inline Decision operator<(const Bounded& a, const Bounded& b) noexcept {
  const Flags flags = a.flags | b.flags;
  const bool open = (flags & kMayBeNan) != 0;
  return Decision(open || (a.lo < b.hi), open || (a.hi >= b.lo), a.value < b.value, flags);
}
inline Decision operator<=(const Bounded& a, const Bounded& b) noexcept {
  const Flags flags = a.flags | b.flags;
  const bool open = (flags & kMayBeNan) != 0;
  return Decision(open || (a.lo <= b.hi), open || (a.hi > b.lo), a.value <= b.value, flags);
}
inline Decision operator>(const Bounded& a, const Bounded& b) noexcept { return b < a; }
inline Decision operator>=(const Bounded& a, const Bounded& b) noexcept { return b <= a; }
inline Decision operator==(const Bounded& a, const Bounded& b) noexcept {
  const Flags flags = a.flags | b.flags;
  const bool open = (flags & kMayBeNan) != 0;
  const bool samePoint = a.lo == a.hi && b.lo == b.hi && a.lo == b.lo;
  return Decision(open || ((a.lo <= b.hi && b.lo <= a.hi)), open || !samePoint, a.value == b.value,
                  flags);
}
inline Decision operator!=(const Bounded& a, const Bounded& b) noexcept { return !(a == b); }

// FMin, FMax: "correct result", monotone. Of a NaN and a number either may be returned.
inline Bounded min(const Bounded& a, const Bounded& b) noexcept {
  const Flags flags = a.flags | b.flags;
  if ((flags & kMayBeNan) != 0) [[unlikely]]
    return detail::minMayBeNan(a, b);
  return detail::make(b.value < a.value ? b.value : a.value, least(a.lo, b.lo), least(a.hi, b.hi),
                      flags);
}
inline Bounded max(const Bounded& a, const Bounded& b) noexcept {
  const Flags flags = a.flags | b.flags;
  if ((flags & kMayBeNan) != 0) [[unlikely]]
    return detail::maxMayBeNan(a, b);
  return detail::make(a.value < b.value ? b.value : a.value, most(a.lo, b.lo), most(a.hi, b.hi),
                      flags);
}
// FAbs: "correct result".
inline Bounded abs(const Bounded& a) noexcept {
  return detail::make(std::abs(a.value), most(most(a.lo, -a.hi), 0.0), most(-a.lo, a.hi), a.flags);
}

// A choice between data. Undecided it is either of the two, at once; decided, the other side
// counts for nothing, its flags included.
inline Bounded select(bool condition, const Bounded& a, const Bounded& b) noexcept {
  return condition ? a : b;
}
inline Bounded select(const Decision& condition, const Bounded& a, const Bounded& b) noexcept {
  if (!condition.undecided()) return condition.canBeTrue ? a : b;
  Bounded result = condition.value ? join(a, b) : join(b, a);
  result.flags |= condition.flags & kFromConditions;
  return result;
}

}  // namespace gnomon

#endif
