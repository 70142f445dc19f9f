#include "harness/isolate/schedule.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "harness/isolate/sweep.h"
#include "harness/isolate/worker.h"

namespace gnomon {
namespace {

std::string stageOf(const CaseName& c) { return c.kernel.substr(0, c.kernel.find('/')); }

/// The batches, handed out one by one to threads that each keep one worker busy.
class Pool {
 public:
  Pool(const Schedule& s, std::vector<Batch> b, const ScheduleObserver& o)
      : schedule(s), batches(std::move(b)), observer(o) {}

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
    return error || stopped || next == batches.size() ? nullptr : &batches[next++];
  }

  /// One worker after another until every case of the batch has a record.
  void run(const Batch& batch) {
    std::vector<CaseName> left = batch.cases;
    while (!left.empty()) {
      const WorkerOptions options = optionsFor(batch, left);
      WorkerTask task{.session = sessionAt(batch.width, schedule.session),
                      .errors = schedule.errors};
      for (const CaseName& c : left) task.cases.push_back(c.name);
      const WorkerReport report = runWorker(task, options);
      if (stopped) return;
      if (report.running.empty() && report.ended > 0) continue;  // it let go of the rest
      if (report.ended == 0 && report.running.empty()) throwWhatItExitedWith(report);
      blame(batch, left, report.running, report.death(options));
    }
  }

  WorkerOptions optionsFor(const Batch& batch, std::vector<CaseName>& left) {
    const bool foreign = schedule.session.kernels.contains(left.front().kernel);
    return {.environment = environmentFor(batch.width),
            .limit = caseLimit(schedule.session, schedule.policy),
            .memoryBytes = foreign ? memoryLimit(schedule.policy, "foreignGibibytes") : 0,
            .stopped = [this] { return stopped.load(); },
            .begun =
                [this, &batch, &left](const std::string& name) {
                  const auto found = std::ranges::find(left, name, &CaseName::name);
                  const std::lock_guard lock(mutex);
                  if (found != left.end()) observer.begun({*found, batch.width});
                },
            .ended = [this, &batch,
                      &left](CaseRecord record) { settle(batch, left, std::move(record)); }};
  }

  /// A case has its record, and is no longer left; what nobody asked for is not heard.
  void settle(const Batch& batch, std::vector<CaseName>& left, CaseRecord record) {
    const auto found = std::ranges::find(left, record.name, &CaseName::name);
    if (found == left.end()) return;
    left.erase(found);
    const std::lock_guard lock(mutex);
    if (stopped) return;
    stopped = observer.enough && observer.enough(record);
    observer.ended(batch.width, std::move(record));
  }

  /// The case that ran, else the next one, failed because its worker died.
  void blame(const Batch& batch, std::vector<CaseName>& left, const std::string& running,
             const std::string& death) {
    const auto found = std::ranges::find(left, running, &CaseName::name);
    const CaseName guilty = found == left.end() ? left.front() : *found;
    const char* when = found == left.end() ? "before this case the worker " : "the case's worker ";
    settle(
        batch, left,
        {.name = guilty.name, .kernel = guilty.kernel, .failed = true, .messages = {when + death}});
  }

  const Schedule& schedule;
  const std::vector<Batch> batches;
  const ScheduleObserver& observer;
  std::mutex mutex{};
  std::size_t next = 0;
  std::exception_ptr error{};
  std::atomic<bool> stopped = false;
};

}  // namespace

std::vector<Batch> batchesOf(const std::vector<Turn>& turns, const SessionOptions& session,
                             unsigned jobs, std::size_t fewest) {
  const auto foreign = [&](const Turn& t) { return session.kernels.contains(t.name.kernel); };
  const auto together = [&](const Turn& a, const Turn& b) {
    return a.width == b.width && stageOf(a.name) == stageOf(b.name) && foreign(a) == foreign(b);
  };
  const auto endOfKernel = [&](std::size_t at) {
    std::size_t end = at;
    while (end < turns.size() && turns[end].name.kernel == turns[at].name.kernel &&
           turns[end].width == turns[at].width)
      ++end;
    return end;
  };
  std::vector<Batch> batches;
  for (std::size_t begin = 0, end = 0; begin < turns.size(); begin = end) {
    const std::size_t size = std::max(fewest, (turns.size() - begin) / (2 * std::size_t{jobs}));
    if (endOfKernel(begin) - begin > size + fewest) end = begin + size;  // a part of a kernel
    while (end < turns.size() && together(turns[begin], turns[end])) {
      const std::size_t whole = endOfKernel(end);
      if (end > begin && whole - begin > size) break;
      end = whole;
    }
    Batch& batch = batches.emplace_back(Batch{.width = turns[begin].width});
    for (std::size_t i = begin; i < end; ++i) batch.cases.push_back(turns[i].name);
  }
  return batches;
}

void runTurns(const Schedule& schedule, const std::vector<Turn>& turns,
              const ScheduleObserver& observer) {
  const auto fewest = static_cast<std::size_t>(schedule.policy["batchCases"]);
  Pool(schedule, batchesOf(turns, schedule.session, schedule.jobs, fewest), observer).run();
}

unsigned defaultJobs() {
  constexpr unsigned kMost = 8;
  return std::clamp(std::thread::hardware_concurrency(), 1u, kMost);
}

}  // namespace gnomon
