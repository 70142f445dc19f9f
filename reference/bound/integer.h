// IntRange: the integers that an integer expression of a shader may take, for indices and counts
// that come from bounds. Exact, since integer arithmetic is; only the way from a float is open.
//
// Results outside 32 bits, signed or unsigned, wrap on the GPU. A range that gets there is marked
// unspecified, as is a division by a range that holds 0: no model should depend on either.
#ifndef GNOMON_REFERENCE_BOUND_INTEGER_H
#define GNOMON_REFERENCE_BOUND_INTEGER_H

#include <cstdint>
#include <iosfwd>
#include <type_traits>

#include "reference/bound/bounded.h"

namespace gnomon {

struct IntRange {
  std::int64_t value = 0;  // what the plain double model gets
  std::int64_t lo = 0, hi = 0;
  Flags flags = 0;

  constexpr IntRange() noexcept = default;
  constexpr IntRange(std::int64_t x) noexcept : value(x), lo(x), hi(x) {}
  static IntRange between(std::int64_t lo, std::int64_t hi) noexcept;

  // The only value there is; std::logic_error where there are several or none is specified. For
  // trip counts and indices of plain arrays, which have to be certain.
  std::int64_t certain() const;

  bool isPoint() const noexcept { return lo == hi; }
  bool ambiguous() const noexcept { return (flags & kAmbiguous) != 0; }
  bool unspecified() const noexcept { return (flags & kUnspecified) != 0; }

  // OpConvertSToF.
  Bounded toBounded() const noexcept;
};

std::ostream& operator<<(std::ostream& out, const IntRange& x);
void PrintTo(const IntRange& x, std::ostream* out);

IntRange operator-(const IntRange& a) noexcept;
IntRange operator+(const IntRange& a, const IntRange& b) noexcept;
IntRange operator-(const IntRange& a, const IntRange& b) noexcept;
IntRange operator*(const IntRange& a, const IntRange& b) noexcept;
IntRange operator/(const IntRange& a, const IntRange& b) noexcept;   // towards zero
IntRange operator%(const IntRange& a, const IntRange& b) noexcept;   // operands not negative
IntRange operator<<(const IntRange& a, const IntRange& b) noexcept;  // by 0 to 31
IntRange operator>>(const IntRange& a, const IntRange& b) noexcept;  // likewise, arithmetic

IntRange min(const IntRange& a, const IntRange& b) noexcept;
IntRange max(const IntRange& a, const IntRange& b) noexcept;
IntRange clamp(const IntRange& x, const IntRange& lo, const IntRange& hi) noexcept;
IntRange join(const IntRange& a, const IntRange& b) noexcept;
IntRange select(const Decision& condition, const IntRange& a, const IntRange& b) noexcept;

Decision operator<(const IntRange& a, const IntRange& b) noexcept;
Decision operator<=(const IntRange& a, const IntRange& b) noexcept;
Decision operator==(const IntRange& a, const IntRange& b) noexcept;
inline Decision operator>(const IntRange& a, const IntRange& b) noexcept { return b < a; }
inline Decision operator>=(const IntRange& a, const IntRange& b) noexcept { return b <= a; }
inline Decision operator!=(const IntRange& a, const IntRange& b) noexcept { return !(a == b); }

// int(x): towards zero; ambiguous where x may be on either side of an integer; unspecified where
// the result does not fit in 32 bits.
IntRange toInt(const Bounded& x) noexcept;
IntRange floorToInt(const Bounded& x) noexcept;

// The same names for a model in double.
inline std::int64_t toInt(double x) noexcept { return static_cast<std::int64_t>(x); }
inline std::int64_t floorToInt(double x) noexcept {
  return static_cast<std::int64_t>(std::floor(x));
}
inline std::int64_t certain(std::int64_t x) noexcept { return x; }
inline std::int64_t certain(const IntRange& x) { return x.certain(); }

// The integer that goes with a model's number type.
template <class T>
using IntOf = std::conditional_t<std::is_same_v<T, Bounded>, IntRange, std::int64_t>;

// Everything, for a value that is not judged; keeps the plain value.
Bounded withoutLimits(const Bounded& x, Flags flags) noexcept;
IntRange withoutLimits(const IntRange& x, Flags flags) noexcept;

}  // namespace gnomon

#endif
