// The built-ins of a shader for Bounded. Precision: specification, table "Precision of
// GLSL.std.450 Instructions". An operation measured on a device (Rules::measured) is bounded by
// its measurement instead; outside its specified domain it stays unspecified either way.
//
// "Inherited" operations are bounded over all associative, commutative and distributive forms of
// the formula they inherit from, fused ones included, and symmetrically: within the worst distance
// E of any form from the exact x, on both sides of x.
#ifndef GNOMON_REFERENCE_BOUND_BUILTINS_H
#define GNOMON_REFERENCE_BOUND_BUILTINS_H

#include "reference/bound/bounded.h"
#include "reference/bound/real.h"

namespace gnomon {

// Exact; over an interval that spans a discontinuity they are the hull, ambiguous.
Bounded floor(const Bounded& x) noexcept;
Bounded ceil(const Bounded& x) noexcept;
Bounded trunc(const Bounded& x) noexcept;
Bounded round(const Bounded& x) noexcept;      // at .5 either way
Bounded roundEven(const Bounded& x) noexcept;  // at .5 to even
Bounded sign(const Bounded& x) noexcept;
Bounded fract(const Bounded& x) noexcept;  // correctly rounded: 1 for a tiny negative x
Bounded step(const Bounded& edge, const Bounded& x) noexcept;

// From x - y floor(x / y): where x / y may round to either side of an integer, so may the result.
Bounded mod(const Bounded& x, const Bounded& y) noexcept;

// min(max(x, lo), hi); unspecified where lo > hi is possible.
Bounded clamp(const Bounded& x, const Bounded& lo, const Bounded& hi) noexcept;

Bounded square(const Bounded& x) noexcept;  // x * x, never negative
// From OpFMul then OpFAdd: rounded once or twice.
Bounded fma(const Bounded& a, const Bounded& b, const Bounded& c) noexcept;
// From x (1 - a) + y a, hence also x + a (y - x): exact at a = 0, not in general at a = 1.
Bounded mix(const Bounded& x, const Bounded& y, const Bounded& a) noexcept;
// From t t (3 - 2 t); unspecified unless edge0 < edge1.
Bounded smoothstep(const Bounded& edge0, const Bounded& edge1, const Bounded& x) noexcept;

Bounded sqrt(const Bounded& x) noexcept;         // from 1 / inversesqrt(x); x >= 0
Bounded inversesqrt(const Bounded& x) noexcept;  // 2 ULP; x > 0
Bounded exp(const Bounded& x) noexcept;          // 3 + 2|x| ULP
Bounded exp2(const Bounded& x) noexcept;         // 3 + 2|x| ULP
Bounded log(const Bounded& x) noexcept;          // 3 ULP, 2^-21 absolute in [0.5, 2]; x > 0
Bounded log2(const Bounded& x) noexcept;         // likewise
// From exp2(y log2(x)); x > 0, or x = 0 and y > 0.
Bounded pow(const Bounded& x, const Bounded& y) noexcept;

Bounded sin(const Bounded& x) noexcept;   // 2^-11 absolute; |x| <= pi
Bounded cos(const Bounded& x) noexcept;   // likewise
Bounded tan(const Bounded& x) noexcept;   // from sin / cos; |x| <= pi, cos(x) clear of 0
Bounded asin(const Bounded& x) noexcept;  // from atan2(x, sqrt(1 - x x)); |x| <= 1
Bounded acos(const Bounded& x) noexcept;  // from atan2(sqrt(1 - x x), x); |x| <= 1
Bounded atan(const Bounded& x) noexcept;  // 4096 ULP
// 4096 ULP; unspecified where both may be 0. Across y = 0, x < 0 it is [-pi, pi], ambiguous.
Bounded atan2(const Bounded& y, const Bounded& x) noexcept;

// Tests on the bits.
Decision isFinite(const Bounded& x) noexcept;
Decision isInf(const Bounded& x) noexcept;
Decision isNan(const Bounded& x) noexcept;

}  // namespace gnomon

#endif
