// What mutation does to one instruction: each operator makes a small, typical mistake of it.
//
// The operators follow mutation testing's usual catalogue (Offutt et al. 1996, "An experimental
// determination of sufficient mutant operators": arithmetic, relational, logical, absolute value)
// and what kernels need on top (Zhu and Zaidman 2020, "Massively parallel, highly efficient, but
// what about the test suite quality?": thread indices, synchronisation, atomics).
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/mutate/module_view.h"

namespace gnomon {

/// Gets every edit that operators propose, with the operator's name.
using EditSink = std::function<void(std::string_view operatorName, Edit edit)>;

/// Name and summary of every operator, in the order in which they are applied.
struct OperatorInfo {
  std::string_view name, summary;
};
const std::vector<OperatorInfo>& mutationOperators();

/// Every edit of the instruction at this index. Not every one is valid SPIR-V (a branch may leave
/// its construct): the caller validates.
void proposeEdits(const ModuleView& view, std::size_t index, const EditSink& sink);

}  // namespace gnomon
