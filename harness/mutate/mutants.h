// The mutants of a kernel: its module with one instruction changed, each under a name that lasts.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "harness/mutate/module_view.h"

namespace gnomon {

struct Mutant {
  /// FILE:FUNCTION:OPERATOR:N, the N-th of that operator in that function: "lib/brdf.glsl:D_GGX:
  /// arithmetic:3". It does not depend on lines above, nor on other functions.
  std::string id{};
  std::string operatorName{};
  SourcePlace place{};
  std::string change{};  ///< "* becomes /"
  SpirvWords module{};
  std::uint64_t hash = 0;  ///< of the module without its debug information
};

/// What became of the edits that operators proposed.
struct MutantSet {
  std::vector<Mutant> mutants{};     ///< to be judged, in the order of the code
  std::vector<Mutant> equivalent{};  ///< with the original's normal form: nothing can tell them
  std::size_t invalid = 0;           ///< no valid SPIR-V
  std::size_t duplicates = 0;        ///< with the normal form of a mutant before them
};

/// Every mutant by these operators (none named: by all) of the code that the module's entry points
/// reach, or of those parts of it whose mutants' ids begin so. Throws UsageError where the module
/// does not parse. Takes about 10 ms a mutant on both of two cores: spirv-val and spirv-opt run on
/// each.
MutantSet mutantsOf(std::span<const std::uint32_t> module, const std::set<std::string>& operators,
                    const std::vector<std::string>& parts = {});

/// The mutants with these ids alone, not classified. Throws UsageError where one is not among them.
std::vector<Mutant> mutantsNamed(std::span<const std::uint32_t> module,
                                 const std::vector<std::string>& ids);

}  // namespace gnomon
