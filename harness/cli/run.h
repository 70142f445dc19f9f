// The run of `gnomon validate`: which cases run when, in workers, and what has become of them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/isolate/results.h"
#include "harness/isolate/schedule.h"

namespace gnomon {

/// Told of the run as it goes on.
struct RunObserver {
  /// Cases that have ended and all of this pass; lanes of a subgroup, 0 for the device's own.
  std::function<void(std::size_t ended, std::size_t all, unsigned lanes,
                     const std::vector<std::string>& running)>
      progress{};
  /// Of every case, in the order of the catalogue; again if it fails at another width only.
  std::function<void(const CaseRecord&)> ended{};
};

/// Everything that a run is made of; `results` may be null.
struct RunOptions {
  const SessionOptions& session;
  const Policy& policy;
  const Preparation& prepared;
  unsigned jobs = 1;
  Results* results = nullptr;
  RunObserver observer{};
};

class Run {
 public:
  Run(RunOptions o, std::vector<CaseName> c);

  /// Runs every case that `results` has not found; those that measure the device come first, so
  /// that the others know its errors. Then again at every other width where that may matter.
  void judge();

  /// In the order of the catalogue.
  const std::vector<CaseRecord>& records() const { return all; }
  /// What is known of the device now, and whether this run has measured any of it.
  const DeviceErrors& deviceErrors() const { return errors; }
  bool hasMeasured() const { return measured; }
  /// Cases that need not run.
  std::size_t takenFromFile() const { return taken; }

 private:
  using Key = std::pair<unsigned, std::string>;  // width and case

  /// Those of the cases that have no record yet.
  void runAt(unsigned width, const std::vector<CaseName>& wanted);
  void tellInOrder();
  void learnErrors(const std::vector<CaseName>& from);
  void sweep(unsigned width);

  RunOptions options;
  std::vector<CaseName> cases;
  std::map<Key, CaseRecord> found{};
  std::vector<CaseRecord> all{};
  std::size_t taken = 0;
  DeviceErrors errors;
  bool measured = false;
};

}  // namespace gnomon
