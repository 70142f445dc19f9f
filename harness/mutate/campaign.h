// Which mutants of a kernel its cases tell from the kernel, and by which case.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/isolate/schedule.h"
#include "harness/mutate/fate.h"
#include "harness/mutate/mutants.h"

namespace gnomon {

/// A case that has passed on the kernel itself, and how long that took.
struct Witness {
  CaseName name{};
  double seconds = 0;
  bool communicates = false;  ///< CaseRecord::threadsCommunicate
};

/// The cases that run the kernel, or those of one such kind, cheapest first, after they have passed
/// on it. Throws CaseFailure where one does not: a kernel that is red already tells nothing about
/// its mutants. Cases that are skipped or unsupported here are left out.
struct CaseFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};
std::vector<Witness> witnessesOf(const Schedule& schedule, const std::string& kernel,
                                 std::optional<Kind> kind);

struct CampaignObserver {
  std::function<void(const Mutant&)> begun{};
  std::function<void(const Mutant&, const Fate&)> told{};  ///< once for each, in any order
};

/// Runs the witnesses on each mutant in workers until `sought` of them have failed or none is left,
/// the cheapest first, until a sixteenth of the mutants has shown which of them kill most; what
/// survives in kernels whose threads communicate, also in subgroups of other sizes. A mutant that
/// crashes, hangs or exhausts its worker is killed by the case that ran.
void judgeMutants(const Schedule& schedule, const GpuInfo& gpu, const std::string& kernel,
                  const std::vector<Mutant>& mutants, const std::vector<Witness>& witnesses,
                  unsigned sought, const CampaignObserver& observer);

}  // namespace gnomon
