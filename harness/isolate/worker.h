// Cases in a process of their own: the command itself, started again as `gnomon worker TASK`.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/isolate/messages.h"

namespace gnomon {

/// In the worker: runs the task's cases and prints a line as each begins and ends.
void serve(const WorkerTask& task);

/// What became of a task.
struct WorkerReport {
  std::vector<CaseRecord> records{};  ///< of the cases that ended, in their order
  /// Why the worker ended before its task did, "was killed by signal 11 (Segmentation fault)", and
  /// what it printed last.
  std::optional<std::string> death{};
  std::string running{};  ///< the case that had begun then; empty: none
};

struct WorkerOptions {
  std::map<std::string, std::string> environment{};  ///< on top of ours
  std::chrono::milliseconds limit{60'000};           ///< for the whole task
  std::function<void(const CaseRecord&)> ended{};    ///< told of every case as it ends
};

/// In the parent: runs the task in a worker and waits, at most the limit.
WorkerReport runWorker(const WorkerTask& task, const WorkerOptions& options);

}  // namespace gnomon
