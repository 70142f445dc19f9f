// What a bound remembers besides its interval: bits that are united whenever values combine.
#ifndef GNOMON_REFERENCE_BOUND_FLAGS_H
#define GNOMON_REFERENCE_BOUND_FLAGS_H

#include <cstdint>
#include <string>
#include <vector>

#include "reference/bound/rules.h"

namespace gnomon {

using Flags = std::uint64_t;

// Two different results were joined: a choice or a discontinuity was undecided.
inline constexpr Flags kAmbiguous = 1;
// NaN is one of the conforming results.
inline constexpr Flags kMayBeNan = 2;
// explore() gave up: the interval is everything, and the element says nothing about the kernel.
inline constexpr Flags kNotJudged = 4;

// An operation was reached outside its specified domain: the interval is everything, and a case
// that gets there fails as a test. One bit an operation, so that every culprit stays known.
constexpr Flags unspecifiedBy(Operation operation) {
  return Flags{8} << static_cast<unsigned>(operation);
}
inline constexpr Flags kUnspecified = (unspecifiedBy(Operation{kOperationCount}) - 1) & ~Flags{7};

// What a result inherits from the values that a choice was made on: a comparison with NaN is open,
// but yields no NaN.
inline constexpr Flags kFromConditions = kUnspecified | kNotJudged;

// The operations to blame, in the order of the enumeration.
std::vector<Operation> unspecifiedOperations(Flags flags);

// "ambiguous, may be NaN, unspecified: sqrt"; empty for no flag.
std::string describe(Flags flags);

}  // namespace gnomon

#endif
