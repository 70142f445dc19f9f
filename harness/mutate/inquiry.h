// Everything that is to be known of a kernel's mutants, found out as far as it is not known
// already.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "harness/mutate/campaign.h"
#include "harness/mutate/fates.h"

namespace gnomon {

/// What is asked.
struct Question {
  std::string kernel{};                 ///< "brdf/evaluate"
  std::set<std::string> operators{};    ///< by name; empty: all
  std::set<std::string> mutants{};      ///< by id; empty: all
  std::optional<std::size_t> sample{};  ///< so many of the mutants, chosen by the session's seed
  bool ofModel = false;                 ///< of the kernel's model, whose operators are its own
  std::optional<Kind> by{};             ///< cases of this kind alone, which judge one or the other
  unsigned sought = 1;                  ///< kills of each: 2 tells whether a case kills alone
};

/// What is answered.
struct Answer {
  std::string kernel{};              ///< "brdf/evaluate", "brdf/evaluate model"
  std::vector<Mutant> mutants{};     ///< that were judged; of a model, without a module
  std::vector<Fate> fates{};         ///< of each
  std::vector<Mutant> equivalent{};  ///< that need not be
  std::size_t invalid = 0, duplicates = 0;
  std::size_t remembered = 0;  ///< fates that an earlier run has found
  double seconds = 0;
};

/// Told as it goes on: fates known and mutants in all, killed of them, and what is judged now.
struct InquiryObserver {
  std::function<void(std::size_t known, std::size_t all, std::size_t killed,
                     const std::string& now)>
      progress{};
};

/// The kernels of these stages (STAGE or STAGE/ENTRY; none: all) that mutation is for. Throws
/// UsageError where one does not exist or none is left.
std::vector<std::string> mutatedKernels(const std::vector<std::string>& stages);

/// Finds out what earlier runs have not: fates are kept in the user's cache. Throws CaseFailure
/// where cases fail on the kernel, or the model, as it is; UsageError, DeviceError.
Answer inquire(const Schedule& schedule, const Preparation& prepared, const Question& question,
               const InquiryObserver& observer);

}  // namespace gnomon
