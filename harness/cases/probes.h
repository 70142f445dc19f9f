// Which intermediate left its bounds first: a failed case runs again with the kernel's probes on,
// and the model names the same intermediates.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/hygiene/observe.h"
#include "harness/verdict/verdict.h"
#include "reference/bound/recording.h"

namespace gnomon {

/// One scalar of an element's probes, and what the model says of it.
struct ProbedScalar {
  std::string name;   ///< "F0.y"
  std::string field;  ///< "F0"
  double got = 0;
  bool written = true;             ///< by the kernel
  std::optional<Bounded> allowed;  ///< none where the model does not certainly get there
};

/// What a kernel left in its probes at one element, after two runs with two poisons, beside what
/// the model has recorded there; in the order of the struct.
std::vector<ProbedScalar> probedElement(const Struct& probes, std::span<const std::byte> first,
                                        std::span<const std::byte> second,
                                        const Recording::Names& model);

/// The first that is outside, or that the model reaches and the kernel does not; null if none.
const ProbedScalar* firstDiverging(const std::vector<ProbedScalar>& element);

/// That in a sentence or two, `place` being "results[12]".
std::string describeDivergence(const std::vector<ProbedScalar>& element, const std::string& place);

/// What the model records of an element under these rules.
Recording::Names recorded(const Expectation& expected, const Rules& rules, std::size_t element);

/// Names of the contract's probes that no element's recording knows, then names of recordings that
/// are no probes or have another number of scalars: none where model and contract agree.
std::vector<std::string> disagreements(const Struct& probes, std::span<const Expectation> expected);

/// Runs the case once more with probes and names the first intermediate that left its bounds where
/// the verdict's first field is worst. Empty where the kernel names none, or where nothing is
/// outside; where the probes fail, one line says why. Never throws: there is a failure to report.
std::string firstDivergence(const std::string& kernel, const Observation& seen,
                            const Expectation& expected, const Bounds& deciding,
                            const Verdict& verdict) noexcept;

/// For tests of the probes themselves: elements of the run whose probes are not all inside, each
/// as describeDivergence has it, up to `most`.
std::vector<std::string> divergences(const std::string& kernel, const Observation& seen,
                                     const Expectation& expected, const Rules& rules,
                                     std::size_t most);

}  // namespace gnomon
