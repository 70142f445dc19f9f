#include "harness/isolate/schedule.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "harness/isolate/worker.h"

namespace gnomon {
namespace {

std::string stageOf(const CaseName& c) { return c.kernel.substr(0, c.kernel.find('/')); }

/// The batches, handed out one by one to threads that each keep one worker busy.
class Pool {
 public:
  Pool(const Schedule& s, const std::vector<Batch>& b, const ScheduleObserver& o)
      : schedule(s), batches(b), observer(o) {}

  void run() {
    {
      std::vector<std::jthread> threads;
      for (std::size_t i = 0; i < std::min<std::size_t>(schedule.jobs, batches.size()); ++i)
        threads.emplace_back([this] { work(); });
    }
    if (error) std::rethrow_exception(error);
  }

 private:
  void work() try {
    while (const Batch* batch = take()) run(*batch);
  } catch (...) {
    const std::lock_guard lock(mutex);
    if (!error) error = std::current_exception();
  }

  const Batch* take() {
    const std::lock_guard lock(mutex);
    return error || next == batches.size() ? nullptr : &batches[next++];
  }

  /// One worker after another until every case of the batch has a record.
  void run(const Batch& batch) {
    std::vector<CaseName> left = batch.cases;
    while (!left.empty()) {
      const WorkerOptions options = optionsFor(batch, left);
      WorkerTask task{.session = schedule.session, .errors = schedule.errors};
      for (const CaseName& c : left) task.cases.push_back(c.name);
      const WorkerReport report = runWorker(task, options);
      if (report.running.empty() && report.ended > 0) continue;  // it let go of the rest
      if (report.ended == 0 && report.running.empty()) throwWhatItExitedWith(report);
      blame(left, report.running, report.death(options));
    }
  }

  WorkerOptions optionsFor(const Batch& batch, std::vector<CaseName>& left) {
    const bool foreign = schedule.session.kernels.contains(left.front().kernel);
    return {.environment = batch.environment,
            .limit = caseLimit(schedule.session, schedule.policy),
            .memoryBytes = foreign ? memoryLimit(schedule.policy, "foreignGibibytes") : 0,
            .begun =
                [this, &left](const std::string& name) {
                  const auto found = std::ranges::find(left, name, &CaseName::name);
                  const std::lock_guard lock(mutex);
                  if (found != left.end()) observer.begun(*found);
                },
            .ended = [this, &left](CaseRecord record) { settle(left, std::move(record)); }};
  }

  /// A case has its record, and is no longer left; what nobody asked for is not heard.
  void settle(std::vector<CaseName>& left, CaseRecord record) {
    const auto found = std::ranges::find(left, record.name, &CaseName::name);
    if (found == left.end()) return;
    left.erase(found);
    const std::lock_guard lock(mutex);
    observer.ended(std::move(record));
  }

  /// The case that ran, else the next one, failed because its worker died.
  void blame(std::vector<CaseName>& left, const std::string& running, const std::string& death) {
    const auto found = std::ranges::find(left, running, &CaseName::name);
    const CaseName guilty = found == left.end() ? left.front() : *found;
    const char* when = found == left.end() ? "before this case the worker " : "the case's worker ";
    settle(
        left,
        {.name = guilty.name, .kernel = guilty.kernel, .failed = true, .messages = {when + death}});
  }

  const Schedule& schedule;
  const std::vector<Batch>& batches;
  const ScheduleObserver& observer;
  std::mutex mutex{};
  std::size_t next = 0;
  std::exception_ptr error{};
};

}  // namespace

std::vector<Batch> batchesOf(const std::vector<CaseName>& cases, const SessionOptions& session,
                             std::size_t atMost) {
  const auto foreign = [&](const CaseName& c) { return session.kernels.contains(c.kernel); };
  std::vector<Batch> batches;
  for (const CaseName& c : cases) {
    const CaseName* last = batches.empty() ? nullptr : &batches.back().cases.front();
    if (last == nullptr || batches.back().cases.size() >= atMost || stageOf(*last) != stageOf(c) ||
        foreign(*last) != foreign(c))
      batches.emplace_back();
    batches.back().cases.push_back(c);
  }
  return batches;
}

void runBatches(const Schedule& schedule, const std::vector<Batch>& batches,
                const ScheduleObserver& observer) {
  Pool(schedule, batches, observer).run();
}

unsigned defaultJobs() {
  constexpr unsigned kMost = 8;
  return std::clamp(std::thread::hardware_concurrency(), 1u, kMost);
}

}  // namespace gnomon
