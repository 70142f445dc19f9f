// Runs a kernel so that whatever it leaves undone or does out of place is seen (design: hygiene).
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "harness/hygiene/resources.h"

namespace gnomon {

/// What it did: outputs by name. An image is 32-bit scalars, r g b a of each pixel, written into a
/// float image; where its format is narrow, it is there a second time as stored in that format and
/// read back, under narrowName().
struct Observation {
  bool applies = true;  ///< false: a foreign kernel does not stand for this stimulus; nothing ran
  std::map<std::string, Bytes> plain{};  ///< outputs of the module as it is
  std::map<std::string, Bytes> twin{};   ///< outputs of its strict twin
  std::set<std::string> unmapped{};      ///< "results.F": outputs that the module does not give; 0
  std::vector<std::string> findings{};   ///< hygiene: one sentence each; empty if clean
  /// What ran, where it may have to run again with probes; else null.
  std::shared_ptr<const KeptStimulus> stimulus{};
};

/// How much is watched.
enum class Watch {
  kAll,
  kInOrder,   ///< all but the order twin
  kTwins,     ///< all but the module as it is: `plain` repeats what its strict twin gave
  kTwinAlone  ///< the strict twin into float images, in its own order; `plain` repeats what it gave
};

/// Outputs and guard bands are poisoned before every run, with one pattern in the first and another
/// in the second run of each module, so a word that keeps its poison twice was never written, and
/// any other difference depends on memory the kernel does not own or on the order of its threads.
/// Inputs end in a guard band of NaN, so reading past the end poisons a result. Guard bands lie
/// inside the bound range: a driver that clips accesses to the range must not hide a stray write.
///
/// A kernel whose threads communicate also runs as its order twin (harness/program/order.h), which
/// has to give the same words: where it does not, a barrier is missing or groups race.
///
/// Findings: words not written, writes outside, writes into inputs, scratch that is not left as
/// zeros, runs that differ though the contract says deterministic, an order twin that differs,
/// validation messages. Throws GpuError
/// when the device is lost or the limit passes.
Observation observe(const Subject& subject, const Stimulus& stimulus, Watch watch = Watch::kAll);

/// Outputs of one run of the strict twin, without any of these checks: for measuring over inputs so
/// many that checking each would take hours. What is measured so has to be observed on a part
/// first. `poison` is the run whose pattern fills the outputs: the first or the second.
std::map<std::string, Bytes> runTwinOnce(const Subject& subject, const Stimulus& stimulus,
                                         unsigned poison = 0);

/// The word that an output buffer is filled with before that run.
std::uint32_t poisonOf(unsigned run);

}  // namespace gnomon
