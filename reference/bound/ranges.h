// From a range of reals and a permitted error to a Bounded: the rounding step of every operation
// that is not simply "correctly rounded". Internal to reference/bound.
//
// Reals here are computed in double, so each carries an error of its own: at most kDoubleError
// times its magnitude, which is glibc's worst (below 1 ULP for every function used here) with room
// for a few further roundings. Ranges are widened by it, then rounded inward to float: the
// result of the shader is a float, so a float outside the permitted range is no result.
#ifndef GNOMON_REFERENCE_BOUND_RANGES_H
#define GNOMON_REFERENCE_BOUND_RANGES_H

#include "reference/bound/bounded.h"

namespace gnomon::detail {

inline constexpr double kDoubleError = 0x1p-49;

// Infinitely precise results for all operands in question. `exact`: a single one, known to the
// last bit, so that ulp() can be taken of it even at a power of two.
struct Range {
  double lo, hi;
  bool exact = false;
};

// All floats in [lo, hi]. Beyond the largest float infinity is a result as well, and the largest
// float too (specification, "ULP"); denormals may be flushed.
Bounded floatsIn(double value, double lo, double hi, Flags flags) noexcept;

// All floats within `error` of some x in the range. An error in ULP keeps the sign of x
// (see kAssumedExceptions): only denormals would lose it.
Bounded within(double value, Range range, Error error, Flags flags) noexcept;

// All floats within relative * |x| + absolute of some x in the range.
Bounded around(double value, Range range, double relative, double absolute, Flags flags) noexcept;

// The range's common part with [lo, hi], for results that cannot leave it.
Bounded clipped(Bounded x, double lo, double hi) noexcept;

// Worst relative errors, for results that are normal. An error of 1 ULP is at most 2^-23 of one.
double relativeError(Operation operation) noexcept;  // not for one that inherits
double sqrtError() noexcept;                         // measured, or from y = 1 / inversesqrt(x)

}  // namespace gnomon::detail

#endif
