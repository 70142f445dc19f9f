// What a verdict is wrong by, so that another input can be asked for the same failure.
#pragma once

#include <optional>
#include <string>

#include "harness/verdict/verdict.h"

namespace gnomon {

/// By what a kernel is judged: the bounds that decide, and whether it is a user's, of whom another
/// arrangement is as good as the project's, which has to be as exact as the device is.
struct Standard {
  Bounds bounds;
  bool foreign = false;

  bool fails(const Verdict& v) const {
    return !v.ok() || (!foreign && (v.outsideDevice > 0 || v.verdict != Class::kConforms));
  }
};

struct Failure {
  enum class Kind {
    kHygiene,     ///< a finding of the observation
    kOutside,     ///< a field of the strict twin outside its bound
    kRearranged,  ///< the module as it is further away than rearrangement can be
  };
  Kind kind = Kind::kOutside;
  std::string output{};
  std::string field{};    ///< the first that is outside, in the order of the contract
  std::string finding{};  ///< without its numbers
};

/// What the verdict fails by. Nothing where no single input does: bounds that prove nothing, too
/// many ambiguous elements, a model that leaves the domain of an operation.
std::optional<Failure> failureOf(const Verdict& verdict, const Observation& seen,
                                 const Standard& standard);

/// Whether it fails by that, and by nothing else that would have hidden it.
bool failsBy(const Failure& failure, const Verdict& verdict, const Observation& seen,
             const Standard& standard);

/// The policy for a few elements: shares and medians, which need many, do not fail them.
Policy forFewElements(const Policy& policy);

}  // namespace gnomon
