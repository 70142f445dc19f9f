#include "harness/mutate/model_campaign.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/isolate/worker.h"
#include "harness/mutate/campaign.h"

namespace gnomon {
namespace {

WorkerOptions optionsFor(const Schedule& schedule) {
  return {.limit = caseLimit(schedule.session, schedule.policy),
          .memoryBytes = memoryLimit(schedule.policy, "foreignGibibytes")};
}

Fate fateOf(const ModelOutcome& outcome, unsigned sought) {
  Fate fate{.sought = sought};
  for (const std::string& killer : outcome.killers)
    fate.kills.push_back({killer, fate.kills.empty() ? outcome.message : ""});
  return fate;
}

}  // namespace

std::vector<NamedModelMutant> listModelMutants(const Schedule& schedule,
                                               const std::string& kernel) {
  const WorkerOptions options = optionsFor(schedule);
  const WorkerReport report =
      runWorker({.session = schedule.session, .mutated = kernel, .models = true}, options);
  if (!report.plan.empty()) return modelMutants(report.plan);
  throw CaseFailure(fmt::format("the model of {} could not be counted: its worker {}", kernel,
                                report.death(options)));
}

void judgeModelMutants(const Schedule& schedule, const std::string& kernel,
                       const std::vector<std::string>& ids, std::optional<Kind> kind,
                       unsigned sought,
                       const std::function<void(const std::string& id, const Fate&)>& told) {
  std::vector<std::string> cases;
  for (const CaseName& c : selectCases({.stages = {kernel}}))
    if (kind ? kindOf(c) == *kind : judgesModel(kindOf(c))) cases.push_back(c.name);
  std::mutex mutex;
  std::exception_ptr error;
  const auto judge = [&](std::vector<std::string> left) {
    while (!left.empty()) {
      WorkerOptions options = optionsFor(schedule);
      const auto settle = [&](const Fate& fate) {
        const std::lock_guard lock(mutex);
        told(left.front(), fate);
        left.erase(left.begin());
      };
      options.told = [&](const std::string&, const std::string& outcome) {
        settle(fateOf(modelOutcome(outcome), sought));
      };
      const WorkerReport report = runWorker({.session = schedule.session,
                                             .cases = cases,
                                             .mutated = kernel,
                                             .mutants = left,
                                             .models = true,
                                             .kills = sought},
                                            options);
      if (left.empty()) return;
      if (report.mutant.empty()) throwWhatItExitedWith(report);
      // Which of its tests ran, it has not said: a death counts for none alone.
      settle({.kills = {{kernel + " model", "the worker " + report.death(options)}}, .sought = 1});
    }
  };
  const std::size_t lanes = std::min<std::size_t>(schedule.jobs, ids.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t lane = 0; lane < lanes; ++lane)
      threads.emplace_back([&, lane] {
        try {
          std::vector<std::string> mine;  // dealt out, so that dear entries are shared
          for (std::size_t i = lane; i < ids.size(); i += lanes) mine.push_back(ids[i]);
          judge(std::move(mine));
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (!error) error = std::current_exception();
        }
      });
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace gnomon
