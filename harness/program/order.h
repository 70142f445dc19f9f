// The order twin: a compute kernel that sees its groups, and the subgroups in a group, in reverse.
#pragma once

#include <cstdint>
#include <span>

#include "harness/program/spirv.h"

namespace gnomon {

struct OrderOptions {
  std::uint32_t subgroupSize = 0;  ///< the device's (GpuInfo::subgroupSize); at least 1
};

/// The same module with every entry point's built-ins permuted, so that a driver that starts with
/// group 0 and subgroup 0 (lavapipe) shows a missing barrier or traffic between groups. A kernel
/// that is right gives the same outputs: every invocation id is still taken exactly once.
///
/// Group g becomes NumWorkgroups - 1 - g on each axis. In a group of N invocations, with S the
/// subgroup size, LocalInvocationIndex i becomes
/// - S (N / S - 1 - i / S) + i % S where N > S and S divides N: subgroups swap places, and lanes
///   stay, for subgroup operations and SubgroupLocalInvocationId work on the device's lanes;
/// - N - 1 - i otherwise, in a module without subgroup operations;
/// - i otherwise: no permutation that keeps the lanes moves a partial subgroup, and one subgroup
///   has no other to swap with. So too with compute derivatives, whose quads may span rows.
/// LocalInvocationId and GlobalInvocationId follow from both, and SubgroupId becomes
/// NumSubgroups - 1 - SubgroupId in the first case. Which case holds is computed by the kernel, for
/// specialisation constants may give N.
///
/// Vulkan does not promise that subgroups are blocks of LocalInvocationIndex. lavapipe 22.3 cuts
/// each row of a group by itself, so there lanes stay only where S divides the group's x size. A
/// kernel that assumes nothing of the cut is right with any. Not for vkCmdDispatchBase.
///
/// Throws UsageError where the words do not parse or end too early, where an entry point is no
/// compute shader, or where a built-in stands in a struct; the twin of a valid module is valid.
SpirvWords orderTwin(std::span<const std::uint32_t> module, const OrderOptions& options);

/// Whether its threads can learn of each other by shared memory, atomics or subgroup operations; by
/// storage that is both read and written, its interface tells. Throws UsageError as orderTwin does.
bool threadsCommunicate(std::span<const std::uint32_t> module);

}  // namespace gnomon
