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
  /// Cases that have ended and all of this pass.
  std::function<void(std::size_t ended, std::size_t all, const std::vector<std::string>& running)>
      progress{};
  /// Of every case, in the order of the catalogue; again if it fails at another width only.
  std::function<void(const CaseRecord&)> ended{};
  /// Whether the run is to stop with this case; null: never.
  std::function<bool(const CaseRecord&)> enough{};
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

  /// In the order of the catalogue; where the observer had enough, of as many as have run.
  const std::vector<CaseRecord>& records() const { return all; }
  /// What is known of the device now, and whether this run has measured any of it.
  const DeviceErrors& deviceErrors() const { return errors; }
  bool hasMeasured() const { return measured; }
  /// Cases that need not run.
  std::size_t takenFromFile() const { return taken; }

 private:
  using Key = std::pair<unsigned, std::string>;  // width and case

  /// Those of the turns that have no record yet.
  void runAll(const std::vector<Turn>& wanted, const std::vector<Turn>& counted);
  void tellInOrder();
  void tellTheRest();
  void learnErrors(const std::vector<Turn>& from);
  /// Again at other widths of a subgroup.
  void sweep();
  bool hadEnough() const;

  RunOptions options;
  std::vector<CaseName> cases;
  std::map<Key, CaseRecord> found{};
  std::vector<CaseRecord> all{};
  std::size_t taken = 0;
  DeviceErrors errors;
  bool measured = false;
};

}  // namespace gnomon
