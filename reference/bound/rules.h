// What a conforming implementation may do to a float32 result: the worst error of every operation.
//
// Source: Vulkan specification, appendix "Vulkan Environment for SPIR-V", section "Precision and
// Operation of SPIR-V Instructions". The default Rules are that specification. A device's own
// bound is the same expression with errors measured on the device in place of the specified ones.
#ifndef GNOMON_REFERENCE_BOUND_RULES_H
#define GNOMON_REFERENCE_BOUND_RULES_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace gnomon {

// How + - * and conversions round. The specification says "correctly rounded" and fixes no
// direction: either neighbouring float, and an exact result stays exact. A module that declares
// RoundingModeRTE 32 leaves one result only.
enum class Rounding : std::uint8_t { eitherNeighbour, nearestEven };

// Operations with an error of their own, or with arguments for which no result is specified.
enum class Operation : std::uint8_t {
  divide,
  mod,
  inverseSqrt,
  sqrt,
  exp,
  exp2,
  log,
  log2,
  pow,
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  atan2,
  clamp,
  smoothstep,
  toInteger,
  integer,
};

// As they stand in a device's file of measured errors.
inline constexpr std::array<std::string_view, 20> kOperationNames{
    "divide", "mod",   "inversesqrt", "sqrt",       "exp",       "exp2",   "log",
    "log2",   "pow",   "sin",         "cos",        "tan",       "asin",   "acos",
    "atan",   "atan2", "clamp",       "smoothstep", "toInteger", "integer"};
inline constexpr std::size_t kOperationCount = kOperationNames.size();

constexpr std::string_view nameOf(Operation operation) {
  return kOperationNames[static_cast<std::size_t>(operation)];
}
std::optional<Operation> operationNamed(std::string_view name);

// A result lies within max(ulp * ulp(x), absolute) of the infinitely precise x.
struct Error {
  double ulp = 0;
  double absolute = 0;
};

struct Rules {
  Rounding rounding = Rounding::eitherNeighbour;

  // A measured worst error replaces the specified one, and for an operation that inherits its
  // precision the whole formula it inherits from. It holds on the specified domain only.
  std::array<std::optional<Error>, kOperationCount> measured{};

  // Steps of float by which every input and every named intermediate is widened on each side:
  // the mixed forward-backward error that class "equivalent" grants to another arrangement.
  int widenUlp = 0;

  static Rules specification(Rounding rounding = Rounding::eitherNeighbour);

  const std::optional<Error>& measuredError(Operation operation) const noexcept {
    return measured[static_cast<std::size_t>(operation)];
  }
  // divide, inversesqrt, sqrt, exp2 and atan2 enter formulas by their relative error, so theirs
  // has to be in ULP alone: std::invalid_argument otherwise.
  void measure(Operation operation, Error error);

  // Worst error for arguments in [lo, hi]. Throws std::logic_error for an operation that has no
  // error of its own because it inherits and was not measured.
  Error error(Operation operation, double lo, double hi) const;

  // What the specification allows; nothing for an operation that inherits its precision.
  static std::optional<Error> specifiedError(Operation operation, double lo, double hi);

  // Worst relative error of one + - * whose result is a normal float.
  double unitRoundoff() const noexcept {
    return rounding == Rounding::nearestEven ? 0x1p-24 : 0x1p-23;
  }
  // n of them in a row: gamma_n = n u / (1 - n u) (Higham, Accuracy and Stability of Numerical
  // Algorithms, 2002, lemma 3.1).
  double gamma(double n) const noexcept { return n * unitRoundoff() / (1 - n * unitRoundoff()); }
};

// Where the specification promises nothing, or noise around zero, and every device is assumed to
// do the sensible thing. `gnomon validate precision` checks each line on each device.
struct AssumedException {
  Operation operation;
  std::string_view assumption;
  std::string_view reason;
};
inline constexpr std::array<AssumedException, 9> kAssumedExceptions{{
    {Operation::sqrt, "sqrt(0) = 0, length(0) = 0",
     "inherited from 1 / inversesqrt(0), and inversesqrt(0) is undefined"},
    {Operation::pow, "pow(0, y) = 0 for y > 0",
     "inherited from exp2(y * log2(0)), and log2(0) is undefined"},
    {Operation::pow,
     "pow, length, acos, smoothstep, normalize and sums do not leave the sign that every form of "
     "their formula has",
     "a result may lie on either side of the exact one as far as the worst form does on one"},
    {Operation::divide, "0 / y = 0, and a quotient never has the wrong sign",
     "2.5 ULP of a denormal reach across zero"},
    {Operation::exp, "exp and exp2 are never negative", "3 + 2|x| ULP of a denormal reach below 0"},
    {Operation::atan, "atan(0) = 0, and an angle never has the wrong sign",
     "4096 ULP of a denormal reach across zero"},
    {Operation::acos, "acos(-1) = +pi",
     "inherited from atan2(sqrt(1 - x * x), x), where 1 - 1 may be -0"},
    {Operation::sin, "sin at the float nearest pi is as good as inside [-pi, pi]",
     "that float is 8.7e-8 above pi, so outside by the letter"},
    {Operation::cos, "cos at the float nearest pi is as good as inside [-pi, pi]", "as for sin"},
}};

namespace detail {
inline constexpr Rules kSpecification{};
inline constinit thread_local const Rules* currentRules = &kSpecification;
}  // namespace detail

// The rules of this thread: the specification, unless a UseRules is alive.
inline const Rules& rules() noexcept { return *detail::currentRules; }

// Makes `rules` this thread's for its lifetime; nests. The rules must outlive it.
class UseRules {
 public:
  explicit UseRules(const Rules& used) noexcept : outer_(detail::currentRules) {
    detail::currentRules = &used;
  }
  explicit UseRules(Rules&&) = delete;
  ~UseRules() { detail::currentRules = outer_; }
  UseRules(const UseRules&) = delete;
  UseRules& operator=(const UseRules&) = delete;

 private:
  const Rules* outer_;
};

}  // namespace gnomon

#endif
