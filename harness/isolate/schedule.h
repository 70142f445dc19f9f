// Runs cases in workers, several at a time, so that nothing a case does can end the run.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/cases/runner.h"
#include "harness/isolate/messages.h"
#include "harness/verdict/policy.h"

namespace gnomon {

/// A case, and the width of a subgroup that it runs at, in bits, as harness/isolate/sweep.h counts
/// them; 0: the device's own.
struct Turn {
  CaseName name{};
  unsigned width = 0;
};

/// Cases for one worker.
struct Batch {
  std::vector<CaseName> cases{};
  unsigned width = 0;  ///< as Turn::width
};

/// Cuts turns into batches of one stage and one width, in order. The first hold most, so that few
/// workers are started and all end at about the same time: each takes half of what a worker's even
/// share of all that is left would be, or `fewest`. A kernel is cut in two only where it would make
/// a batch longer than that by more than `fewest`: each worker compiles it again. Cases of a
/// foreign kernel stay by themselves: their workers have a limit of memory.
std::vector<Batch> batchesOf(const std::vector<Turn>& turns, const SessionOptions& session,
                             unsigned jobs, std::size_t fewest);

/// Told by one worker at a time.
struct ScheduleObserver {
  std::function<void(const Turn&)> begun{};
  std::function<void(unsigned width, CaseRecord)> ended{};  ///< once for each turn
  /// Whether this record is all that was wanted: then nothing more is heard, workers are stopped as
  /// soon as they say something, and what has not run by then does not run.
  std::function<bool(const CaseRecord&)> enough{};
};

struct Schedule {
  const SessionOptions& session;
  const Policy& policy;
  unsigned jobs = 1;                     ///< workers at a time
  std::optional<DeviceErrors> errors{};  ///< of the device, known so far
};

/// Runs every turn, in batches. A case that takes its worker along, or does not end in time, has
/// failed with a message that says so; the rest of its batch goes on in a fresh worker. Throws
/// UsageError and DeviceError where a worker exits so before its first case.
void runTurns(const Schedule& schedule, const std::vector<Turn>& turns,
              const ScheduleObserver& observer);

/// How many workers run at a time where nobody says: one a core, since a case waits for one thing
/// after another (compiler, device, judge), but at most 8, since each may take half a gibibyte.
unsigned defaultJobs();

}  // namespace gnomon
