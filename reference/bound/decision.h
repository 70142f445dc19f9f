// The outcome of a comparison of bounds: yes, no, or undecided because both can happen.
#ifndef GNOMON_REFERENCE_BOUND_DECISION_H
#define GNOMON_REFERENCE_BOUND_DECISION_H

#include "reference/bound/flags.h"

namespace gnomon {

// Read as a bool (`if`, `while`, `?:`) an undecided Decision is a branch of the running explore()
// and throws std::logic_error outside of one: write select(), or call the model through explore().
// && || ! keep three values; both sides are evaluated, there is no short circuit.
struct Decision {
  bool canBeTrue = false;
  bool canBeFalse = false;
  bool value = false;  // what the plain double model decides
  Flags flags = 0;     // of the operands, where they matter: when undecided

  constexpr Decision(bool known) noexcept : canBeTrue(known), canBeFalse(!known), value(known) {}
  constexpr Decision(bool mayHold, bool mayFail, bool inDouble, Flags of) noexcept
      : canBeTrue(mayHold),
        canBeFalse(mayFail),
        value(inDouble),
        flags(mayHold && mayFail ? of : 0) {}

  constexpr bool undecided() const noexcept { return canBeTrue && canBeFalse; }
  explicit operator bool() const { return undecided() ? branch(*this) : canBeTrue; }

 private:
  static bool branch(const Decision& decision);
};

constexpr Decision operator!(const Decision& a) noexcept {
  return {a.canBeFalse, a.canBeTrue, !a.value, a.flags};
}
constexpr Decision operator&&(const Decision& a, const Decision& b) noexcept {
  return {a.canBeTrue && b.canBeTrue, a.canBeFalse || b.canBeFalse, a.value && b.value,
          a.flags | b.flags};
}
constexpr Decision operator||(const Decision& a, const Decision& b) noexcept { return !(!a && !b); }

// Without these a mixed && would be ambiguous between the built-in operator and the ones above.
constexpr Decision operator&&(const Decision& a, bool b) noexcept { return a && Decision(b); }
constexpr Decision operator&&(bool a, const Decision& b) noexcept { return Decision(a) && b; }
constexpr Decision operator||(const Decision& a, bool b) noexcept { return a || Decision(b); }
constexpr Decision operator||(bool a, const Decision& b) noexcept { return Decision(a) || b; }

// So that a model in double can ask the same questions.
constexpr bool certainly(bool known) noexcept { return known; }
constexpr bool possibly(bool known) noexcept { return known; }
constexpr bool certainly(const Decision& d) noexcept { return !d.canBeFalse; }
constexpr bool possibly(const Decision& d) noexcept { return d.canBeTrue; }

}  // namespace gnomon

#endif
