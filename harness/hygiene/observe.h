// Runs a kernel so that whatever it leaves undone or does out of place is seen (design: hygiene).
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "harness/hygiene/subject.h"

namespace gnomon {

struct InputBytes {
  std::string buffer{};
  std::span<const std::byte> bytes{};
};

struct OutputCount {
  std::string buffer{};
  std::size_t elements = 0;
};

/// What one kernel is to do: inputs by buffer name, how many elements each output has.
struct Stimulus {
  std::vector<InputBytes> inputs{};
  std::vector<OutputCount> outputs{};
  std::span<const std::byte> push{};
  std::size_t items = 0;  ///< for the grid rule
  std::chrono::milliseconds limit{60'000};
};

/// What it did.
struct Observation {
  std::map<std::string, std::vector<std::byte>> plain{};  ///< outputs of the module as it is
  std::map<std::string, std::vector<std::byte>> twin{};   ///< outputs of its strict twin
  std::vector<std::string> findings{};  ///< hygiene: one sentence each; empty if clean
};

/// Outputs and guard bands are poisoned before every run, with one pattern in the first and another
/// in the second run of each module, so a word that keeps its poison twice was never written, and
/// any other difference depends on memory the kernel does not own or on the order of its threads.
/// Inputs end in a guard band of NaN, so reading past the end poisons a result. Guard bands lie
/// inside the bound range: a driver that clips accesses to the range must not hide a stray write.
///
/// Findings: words not written, writes outside, writes into inputs, runs that differ though the
/// contract says deterministic, validation messages. Throws GpuError when the device is lost or the
/// limit passes.
Observation observe(const Subject& subject, const Stimulus& stimulus);

/// Outputs of one run of the strict twin, without any of these checks: for measuring over inputs so
/// many that checking each would take hours. What is measured so has to be observed on a part
/// first.
std::map<std::string, std::vector<std::byte>> runTwinOnce(const Subject& subject,
                                                          const Stimulus& stimulus);

}  // namespace gnomon
