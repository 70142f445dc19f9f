// Altered: a double that counts the operations of a model's evaluation and does one of them wrong.
// It is what shows that the tests of a model would see a mistake in it (mutation analysis: DeMillo,
// Lipton, Sayward 1978, "Hints on test data selection"; the operators are those of Offutt et al.
// 1996, "An experimental determination of sufficient mutant operators", and constants).
//
// Operations are numbered as they are evaluated, from 0; literals are operations, inputs are none.
// Built-ins that inherit their precision from a formula (clamp, mix, dot, ...) are that formula's
// operations. After an `if` the same number is another operation on another path, so an operation
// is known by its number and by what was decided before it; a model that switches on a number of
// its contract is one entry for each (harness/cases/modelled.h). C++ leaves the order of a call's
// arguments open, so numbers hold for one compiler.
#ifndef GNOMON_REFERENCE_BOUND_ALTERED_H
#define GNOMON_REFERENCE_BOUND_ALTERED_H

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "reference/bound/bounded.h"
#include "reference/bound/real.h"

namespace gnomon {

/// What is done instead of an operation. min and max keep one operand whichever is the less: where
/// their swap would be seen, one of these is; a select is altered by its condition.
enum class Alteration : std::uint8_t {
  none,
  add,        ///< a - b for a + b
  subtract,   ///< a + b
  multiply,   ///< a / b
  divide,     ///< a * b
  negate,     ///< a
  first,      ///< a, for the min or max of a and b
  second,     ///< b
  literal,    ///< more by a relative 1e-4; 1e-4 for 0
  function,   ///< the first argument, for a built-in of one or two
  compare,    ///< the opposite outcome
  threshold,  ///< the opposite outcome where both sides are equal: < for <=
};
std::string_view nameOf(Alteration kind);
/// none where nothing has that name.
Alteration alterationNamed(std::string_view name);

/// An operation that can be altered, as an evaluation meets it.
struct AlterableOperation {
  std::uint32_t number = 0;
  std::uint64_t path = 1;  ///< a 1, then a bit for each `if` before it: whether its condition held
  Alteration kind = Alteration::none;
  auto operator<=>(const AlterableOperation&) const = default;
};
struct Operands {
  double a = 0, b = 0;
};
struct AlterableStep {
  AlterableOperation operation{};
  Operands operands{};
};

namespace detail {
struct AlteredState {
  std::uint32_t next = 0;
  std::uint64_t path = 1;
  AlterableOperation altered{};
  std::vector<AlterableStep>* steps = nullptr;
};
}  // namespace detail

/// One evaluation of a model, on the thread and for the time that this lives. With `steps` it
/// lists what could be altered, in order.
class AlteredEvaluation {
 public:
  explicit AlteredEvaluation(const AlterableOperation& altered) noexcept
      : AlteredEvaluation(State{.altered = altered}) {}
  explicit AlteredEvaluation(std::vector<AlterableStep>& steps) noexcept
      : AlteredEvaluation(State{.steps = &steps}) {}
  ~AlteredEvaluation() { running = before; }
  AlteredEvaluation(const AlteredEvaluation&) = delete;
  AlteredEvaluation& operator=(const AlteredEvaluation&) = delete;

  /// How the next operation is altered, of the ways that it can be; counts it.
  static Alteration next(Alteration one, Alteration other, Operands operands) noexcept {
    const std::uint32_t number = running.next++;
    if (running.steps != nullptr) [[unlikely]]
      record(number, one, other, operands);
    const AlterableOperation& a = running.altered;
    const bool meant =
        number == a.number && running.path == a.path && (a.kind == one || a.kind == other);
    return meant ? a.kind : Alteration::none;
  }
  /// The same where there is one way.
  static bool next(Alteration kind, Operands operands) noexcept {
    return next(kind, kind, operands) != Alteration::none;
  }

  /// Goes on with what an `if` decided. Paths are told apart by their first 63 decisions.
  static void decide(bool holds) noexcept {
    if (running.path >> 63 == 0) running.path = running.path << 1 | (holds ? 1 : 0);
  }

 private:
  using State = detail::AlteredState;
  explicit AlteredEvaluation(const State& state) noexcept : before(running) { running = state; }
  static void record(std::uint32_t number, Alteration one, Alteration other, Operands operands);

  static thread_local constinit inline State running{};
  State before;
};

struct Altered {
  double value = 0;

  constexpr Altered() noexcept = default;

  // A literal of the model.
  Altered(float x) noexcept : Altered(literal(x)) {}
  template <Integer I>
  Altered(I x) noexcept : Altered(literal(static_cast<double>(x))) {}
  Altered(double) = delete;
  Altered(bool) = delete;

  /// What the model is given: no operation of its own.
  static constexpr Altered input(double x) noexcept {
    Altered result;
    result.value = x;
    return result;
  }

 private:
  static Altered literal(double x) noexcept {
    constexpr double kNudge = 1e-4;
    if (!AlteredEvaluation::next(Alteration::literal, {x, x})) return input(x);
    return input(x == 0 ? kNudge : x * (1 + kNudge));
  }
};

inline Altered operator+(const Altered& a, const Altered& b) noexcept {
  const bool altered = AlteredEvaluation::next(Alteration::add, {a.value, b.value});
  return Altered::input(altered ? a.value - b.value : a.value + b.value);
}
inline Altered operator-(const Altered& a, const Altered& b) noexcept {
  const bool altered = AlteredEvaluation::next(Alteration::subtract, {a.value, b.value});
  return Altered::input(altered ? a.value + b.value : a.value - b.value);
}
inline Altered operator*(const Altered& a, const Altered& b) noexcept {
  const bool altered = AlteredEvaluation::next(Alteration::multiply, {a.value, b.value});
  return Altered::input(altered ? a.value / b.value : a.value * b.value);
}
inline Altered operator/(const Altered& a, const Altered& b) noexcept {
  const bool altered = AlteredEvaluation::next(Alteration::divide, {a.value, b.value});
  return Altered::input(altered ? a.value * b.value : a.value / b.value);
}
inline Altered operator-(const Altered& a) noexcept {
  const bool altered = AlteredEvaluation::next(Alteration::negate, {a.value, a.value});
  return Altered::input(altered ? a.value : -a.value);
}
inline const Altered& operator+(const Altered& a) noexcept { return a; }
inline Altered& operator+=(Altered& a, const Altered& b) noexcept { return a = a + b; }
inline Altered& operator-=(Altered& a, const Altered& b) noexcept { return a = a - b; }
inline Altered& operator*=(Altered& a, const Altered& b) noexcept { return a = a * b; }
inline Altered& operator/=(Altered& a, const Altered& b) noexcept { return a = a / b; }

/// The outcome of a comparison. As in a Decision, && and || evaluate both sides; read by an `if` it
/// is a step of the path.
struct AlteredDecision {
  bool holds = false;

  constexpr AlteredDecision(bool known) noexcept : holds(known) {}
  explicit operator bool() const noexcept {
    AlteredEvaluation::decide(holds);
    return holds;
  }
};
constexpr AlteredDecision operator!(const AlteredDecision& a) noexcept { return !a.holds; }
constexpr AlteredDecision operator&&(const AlteredDecision& a, const AlteredDecision& b) noexcept {
  return a.holds && b.holds;
}
constexpr AlteredDecision operator||(const AlteredDecision& a, const AlteredDecision& b) noexcept {
  return a.holds || b.holds;
}
constexpr bool certainly(const AlteredDecision& d) noexcept { return d.holds; }
constexpr bool possibly(const AlteredDecision& d) noexcept { return d.holds; }

namespace detail {
inline AlteredDecision ordered(bool holds, const Altered& a, const Altered& b) noexcept {
  const Alteration altered =
      AlteredEvaluation::next(Alteration::compare, Alteration::threshold, {a.value, b.value});
  const bool flipped =
      altered == Alteration::compare || (altered == Alteration::threshold && a.value == b.value);
  return holds != flipped;
}
inline AlteredDecision equal(bool holds, const Altered& a, const Altered& b) noexcept {
  return holds != AlteredEvaluation::next(Alteration::compare, {a.value, b.value});
}
}  // namespace detail
inline AlteredDecision operator<(const Altered& a, const Altered& b) noexcept {
  return detail::ordered(a.value < b.value, a, b);
}
inline AlteredDecision operator<=(const Altered& a, const Altered& b) noexcept {
  return detail::ordered(a.value <= b.value, a, b);
}
inline AlteredDecision operator>(const Altered& a, const Altered& b) noexcept {
  return detail::ordered(a.value > b.value, a, b);
}
inline AlteredDecision operator>=(const Altered& a, const Altered& b) noexcept {
  return detail::ordered(a.value >= b.value, a, b);
}
inline AlteredDecision operator==(const Altered& a, const Altered& b) noexcept {
  return detail::equal(a.value == b.value, a, b);
}
inline AlteredDecision operator!=(const Altered& a, const Altered& b) noexcept {
  return detail::equal(a.value != b.value, a, b);
}
inline Altered select(const AlteredDecision& condition, const Altered& a,
                      const Altered& b) noexcept {
  return condition.holds ? a : b;
}

inline Altered named(const Altered& x, const char*) noexcept { return x; }
inline Altered reported(const Altered& x, const char*) noexcept { return x; }
inline Altered alsoAs(const Altered& ours, const Altered&) noexcept { return ours; }

Altered min(const Altered& a, const Altered& b) noexcept;
Altered max(const Altered& a, const Altered& b) noexcept;
Altered clamp(const Altered& x, const Altered& lo, const Altered& hi) noexcept;
Altered mix(const Altered& x, const Altered& y, const Altered& a) noexcept;
Altered step(const Altered& edge, const Altered& x) noexcept;
Altered smoothstep(const Altered& edge0, const Altered& edge1, const Altered& x) noexcept;
Altered fma(const Altered& a, const Altered& b, const Altered& c) noexcept;
Altered square(const Altered& x) noexcept;
Altered fract(const Altered& x) noexcept;
Altered mod(const Altered& x, const Altered& y) noexcept;

Altered abs(const Altered& x) noexcept;
Altered sign(const Altered& x) noexcept;
Altered floor(const Altered& x) noexcept;
Altered ceil(const Altered& x) noexcept;
Altered trunc(const Altered& x) noexcept;
Altered round(const Altered& x) noexcept;
Altered roundEven(const Altered& x) noexcept;
Altered sqrt(const Altered& x) noexcept;
Altered inversesqrt(const Altered& x) noexcept;
Altered exp(const Altered& x) noexcept;
Altered exp2(const Altered& x) noexcept;
Altered log(const Altered& x) noexcept;
Altered log2(const Altered& x) noexcept;
Altered pow(const Altered& x, const Altered& y) noexcept;
Altered sin(const Altered& x) noexcept;
Altered cos(const Altered& x) noexcept;
Altered tan(const Altered& x) noexcept;
Altered asin(const Altered& x) noexcept;
Altered acos(const Altered& x) noexcept;
Altered atan(const Altered& x) noexcept;
Altered atan2(const Altered& y, const Altered& x) noexcept;

inline bool isFinite(const Altered& x) noexcept { return isFinite(x.value); }
inline bool isInf(const Altered& x) noexcept { return isInf(x.value); }
inline bool isNan(const Altered& x) noexcept { return isNan(x.value); }

Altered sum(std::span<const Altered> x) noexcept;
Altered dot(std::span<const Altered> a, std::span<const Altered> b) noexcept;
Altered lengthSquared(std::span<const Altered> a) noexcept;
Altered length(std::span<const Altered> a) noexcept;
Altered normalizedComponent(std::span<const Altered> a, std::size_t k) noexcept;
Altered reflectedComponent(std::span<const Altered> i, std::span<const Altered> n,
                           std::size_t k) noexcept;

}  // namespace gnomon

#endif
