// Cases in a process of their own: the command itself, started again as `gnomon worker TASK`.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/isolate/messages.h"
#include "harness/isolate/process.h"

namespace gnomon {

/// In the worker: runs the task's cases and prints a line as each begins and ends; without cases,
/// opens the device, loads the foreign kernels and says what it found. After a case that has lost
/// the device it ends early, since another one may not be had in this process. With mutants, the
/// cases run on each of them, in the task's order, to the first that fails.
void serve(const WorkerTask& task);

/// What a case may take longer, as its parent sees it, than what it may wait for the device: time
/// in which the worker itself says what hung, which it knows better.
inline constexpr std::chrono::seconds kGrace{5};

struct WorkerOptions {
  std::map<std::string, std::string> environment{};  ///< on top of ours
  std::chrono::milliseconds limit{60'000};  ///< of each case, of what comes before and after it
  /// Of one case, where that it hangs is all that is asked: no grace.
  std::function<std::chrono::milliseconds(const std::string& name)> limitOf{};
  std::uint64_t memoryBytes = 0;    ///< as ProcessOptions::memoryBytes
  std::function<bool()> stopped{};  ///< whether to stop it as soon as it has something to say
  std::function<void(const std::string& name)> begun{};  ///< told of every case as it begins
  std::function<void(CaseRecord)> ended{};               ///< ... and as it ends
  std::function<void(const std::string& id)> mutant{};   ///< told of every mutant as it begins
  /// ... and when no case is left for it; with what has become of a model's.
  std::function<void(const std::string& id, const std::string& outcome)> told{};
};

/// What became of a task.
struct WorkerReport {
  std::size_t ended = 0;                     ///< cases that have
  std::string running{};                     ///< the case that had begun but not ended; or none
  std::string mutant{};                      ///< the same of a mutant
  std::optional<Preparation> preparation{};  ///< of a task without cases
  std::string plan{};                        ///< a model's mutants, as modelMutants() reads them
  ProcessResult process{};

  /// Why it ended before its task did, in words: "was killed by signal 11 (Segmentation fault)",
  /// and what it printed last.
  std::string death(const WorkerOptions& options) const;
};

/// In the parent: runs the task in a worker. Waits no longer for any step than limit and kGrace.
WorkerReport runWorker(const WorkerTask& task, const WorkerOptions& options);

/// In the parent: lets a worker open the device and load the foreign kernels, within the case's
/// limit and the policy's memory. Throws what the worker reports: UsageError, DeviceError.
Preparation prepare(const SessionOptions& session, const Policy& policy);

/// Throws again, as UsageError or DeviceError, what a worker exited with before its first case.
void throwWhatItExitedWith(const WorkerReport& report);

/// A policy's number of gibibytes, as a limit for a worker; none under sanitizers, whose shadow
/// would count.
std::uint64_t memoryLimit(const Policy& policy, const char* name);

}  // namespace gnomon
