// Runs cases in workers, several at a time, so that nothing a case does can end the run.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/cases/runner.h"
#include "harness/isolate/messages.h"
#include "harness/verdict/policy.h"

namespace gnomon {

/// Cases for one worker.
struct Batch {
  std::vector<CaseName> cases{};
  std::map<std::string, std::string> environment{};  ///< on top of ours
};

/// Cuts cases into batches of one stage and at most so many, in order. Those of a foreign kernel
/// stay by themselves: their workers have a limit of memory.
std::vector<Batch> batchesOf(const std::vector<CaseName>& cases, const SessionOptions& session,
                             std::size_t atMost);

/// Told by one worker at a time.
struct ScheduleObserver {
  std::function<void(const CaseName&)> begun{};
  std::function<void(CaseRecord)> ended{};  ///< once for each case
};

struct Schedule {
  const SessionOptions& session;
  const Policy& policy;
  unsigned jobs = 1;                     ///< workers at a time
  std::optional<DeviceErrors> errors{};  ///< of the device, known so far
};

/// Runs every case of the batches. One that takes its worker along, or does not end in time, has
/// failed with a message that says so; the rest of its batch goes on in a fresh worker. Throws
/// UsageError and DeviceError where a worker exits so before its first case.
void runBatches(const Schedule& schedule, const std::vector<Batch>& batches,
                const ScheduleObserver& observer);

/// How many workers run at a time where nobody says: one a core, since a case waits for one thing
/// after another (compiler, device, judge), but at most 8, since each may take half a gibibyte.
unsigned defaultJobs();

}  // namespace gnomon
