#include "reference/bound/rules.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace gnomon {
namespace {

// Tables "Precision of Core SPIR-V Instructions" and "Precision of GLSL.std.450 Instructions",
// single precision.
constexpr double kDivideUlp = 2.5;
constexpr double kInverseSqrtUlp = 2;
constexpr double kLogUlp = 3;             // for arguments outside [0.5, 2]
constexpr double kLogAbsolute = 0x1p-21;  // for arguments in [0.5, 2]
constexpr double kSineAbsolute = 0x1p-11;
constexpr double kAtanUlp = 4096;

// 3 + 2|x| ULP.
Error expError(double lo, double hi) { return {3 + 2 * std::max(std::abs(lo), std::abs(hi)), 0}; }

Error logError(double lo, double hi) {
  const bool meetsInside = hi >= 0.5 && lo <= 2;
  const bool meetsOutside = lo < 0.5 || hi > 2;
  return {meetsOutside ? kLogUlp : 0, meetsInside ? kLogAbsolute : 0};
}

}  // namespace

std::optional<Operation> operationNamed(std::string_view name) {
  const auto* const found = std::find(kOperationNames.begin(), kOperationNames.end(), name);
  if (found == kOperationNames.end()) return std::nullopt;
  return static_cast<Operation>(found - kOperationNames.begin());
}

Rules Rules::specification(Rounding rounding) {
  Rules result;
  result.rounding = rounding;
  return result;
}

void Rules::measure(Operation operation, Error error) {
  constexpr Operation kParts[] = {Operation::divide, Operation::inverseSqrt, Operation::sqrt,
                                  Operation::exp2, Operation::atan2};
  if (error.absolute != 0 &&
      std::find(std::begin(kParts), std::end(kParts), operation) != std::end(kParts))
    throw std::invalid_argument("Rules::measure: the error of " + std::string(nameOf(operation)) +
                                " has to be in ULP alone, because formulas use it as relative");
  measured[static_cast<std::size_t>(operation)] = error;
}

// A measured error counts where it is the smaller: what an operation needs at one end of its domain
// (exp near 88) is not what it may err at the other.
Error Rules::error(Operation operation, double lo, double hi) const {
  const auto& known = measuredError(operation);
  const auto specified = specifiedError(operation, lo, hi);
  if (known && specified)
    return {std::min(known->ulp, specified->ulp), std::min(known->absolute, specified->absolute)};
  if (known) return *known;
  if (specified) return *specified;
  throw std::logic_error(std::string(nameOf(operation)) +
                         " inherits its precision and was not measured");
}

std::optional<Error> Rules::specifiedError(Operation operation, double lo, double hi) {
  switch (operation) {
    case Operation::divide:
      return Error{kDivideUlp, 0};
    case Operation::inverseSqrt:
      return Error{kInverseSqrtUlp, 0};
    case Operation::exp:
    case Operation::exp2:
      return expError(lo, hi);
    case Operation::log:
    case Operation::log2:
      return logError(lo, hi);
    case Operation::sin:
    case Operation::cos:
      return Error{0, kSineAbsolute};
    case Operation::atan:
    case Operation::atan2:
      return Error{kAtanUlp, 0};
    default:
      return std::nullopt;
  }
}

}  // namespace gnomon
