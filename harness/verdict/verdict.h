// From observed bytes and a model to a verdict: conforms, equivalent or wrong, by how much, where.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/hygiene/observe.h"
#include "harness/verdict/policy.h"
#include "reference/bound/bounded.h"
#include "reference/bound/rules.h"
#include "reference/bound/storage.h"

namespace gnomon {

enum class Class { kConforms, kEquivalent, kWrong };
std::string_view nameOf(Class c);
void PrintTo(Class c, std::ostream* out);  // GoogleTest's hook

/// What the outputs must be, for every element; scalars in the order of the contract's fields.
struct Expectation {
  std::string output;  ///< as the observation calls it
  std::size_t elements = 0;
  unsigned width = 0;  ///< pixels in a row of an image; 0: a buffer
  /// Of an image with mip levels how many there are, and the height of the largest.
  unsigned mips = 1, height = 0;
  /// Format that every scalar is stored in and read back from: the observation's narrow copy.
  Storage storage = Storage::float32;
  /// The first `corners` elements are corner cases and are always judged by intervals.
  std::size_t corners = 0;
  bool judgesRules = false;  ///< what is judged are the rules themselves, however wide they are
  /// The plain double model, which clears most elements cheaply.
  std::function<void(std::size_t element, std::span<double> scalars)> plain;
  /// The interval model, under the rules in force on the calling thread. Called by many threads.
  std::function<void(std::size_t element, std::span<Bounded> scalars)> bounded;
  /// The element's inputs, one "name value" line each; asked for only when a message needs them.
  std::function<std::string(std::size_t element)> inputs;

  /// "results[12]", "target(3, 5)" or "pyramid level 2 (3, 4)".
  std::string place(std::size_t element) const;
};

/// The rules that decide.
struct Bounds {
  Rules spec;   ///< what the Vulkan specification allows the strict twin, as it is declared
  Rules plain;  ///< what it allows the module as it is, but for rearrangement
  std::optional<Rules> device;  ///< `spec` with errors measured on this device

  /// The specification's bounds for a device whose twins declare round to nearest even, or not.
  static Bounds specification(bool roundingRte);
};

/// One scalar that is furthest from what it may be.
struct Offender {
  std::size_t element = 0;
  std::string field;  ///< "F.y"
  double got = 0;
  double gotPlain = 0;
  double value = 0;       ///< the model's double
  double lo = 0, hi = 0;  ///< what was allowed
  double budget = 0;
};

/// What became of one field of the output over all elements.
struct FieldVerdict {
  std::string name;
  std::size_t outside = 0;        ///< elements of the twin outside the deciding bound
  double budget = 0;              ///< worst share of the deciding bound that was used; inf if exact
  double specBudget = 0;          ///< of the specification's bound
  double specWidth = 0;           ///< median relative width of the specification's interval
  double deviceWidth = 0;         ///< of the device's interval; 0 without measured rules
  std::optional<Offender> worst;  ///< where `budget` was used
};

struct Verdict {
  Class verdict = Class::kConforms;
  int widening = 0;  ///< k of `equivalent`
  std::string output;
  Storage storage = Storage::float32;  ///< that the output was read back from
  std::size_t elements = 0;
  /// Of them judged by intervals. The rest was cleared by the model; or left alone, where the first
  /// thousands showed that the kernel is wrong at large.
  std::size_t bounded = 0;
  bool rearranged = false;  ///< the twin is inside, the module as it is further than it may be
  bool truncated = false;   ///< wrong at large, so the rest was left alone
  std::size_t outside = 0;  ///< elements of the twin outside the specification's bound
  std::size_t outsideDevice = 0;  ///< outside the device's bound
  std::size_t ambiguous = 0;      ///< elements with a joined branch, of the `bounded` ones
  std::size_t reassociated = 0;   ///< elements of the plain module outside the bound
  double plainBudget = 0;         ///< worst of the plain module
  std::vector<FieldVerdict> fields;
  std::optional<Offender> worst;      ///< of the twin, or of the plain module if only it is wrong
  std::vector<std::string> problems;  ///< why it is wrong, one sentence each; hygiene included

  bool ok() const { return verdict != Class::kWrong; }
  double maxBudget() const;
};

/// Judges one output of an observation. `seed` picks the elements that are judged by intervals.
Verdict judge(const Struct& layout, const Observation& seen, const Expectation& expected,
              const Bounds& bounds, const Policy& policy, std::uint64_t seed);

/// The share of an interval that a result uses, on its side of the model's value: 0 at the value,
/// 1 at the end of the interval, infinite where an exact result differs or a number is missing.
double budgetUsed(double got, const Bounded& allowed, bool signOfZero);

/// A verdict in words for a person: what is wrong, which fields are not, the worst element with
/// its inputs and what was allowed. Empty for a clean verdict. `divergence` is what is known of the
/// intermediates of worstOf(): lines that follow the name of the field.
std::string explain(const Verdict& verdict, const Expectation& expected,
                    const std::string& divergence = {});

/// Its parts: what is wrong and which fields are not; and one scalar, got and allowed.
std::string explainFields(const Verdict& verdict, const std::string& divergence = {});
std::string explainNumbers(const Offender& offender);
/// The scalar that a message is about: the worst of the first field outside. Null for none.
const Offender* worstOf(const Verdict& verdict);

}  // namespace gnomon
