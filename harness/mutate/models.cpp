#include "harness/mutate/models.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

std::string firstLine(const CaseRecord& record) {
  if (record.messages.empty()) return {};
  return record.messages.front().substr(0, record.messages.front().find('\n'));
}

}  // namespace

ModelPlan planModel(Session& session, const std::string& kernel) {
  std::vector<CaseName> cases = selectCases({.stages = {kernel}});
  std::erase_if(cases, [](const CaseName& c) { return !judgesModel(c); });
  ModelPlan plan{.kernel = kernel};
  if (cases.empty()) return plan;

  using Clock = std::chrono::steady_clock;
  const CountedModels counted;
  Clock::time_point begun;
  session.forgetCases();
  runCases(session, cases,
           {.begin =
                [&](const CaseName& c, std::size_t, std::size_t) {
                  counted.takeEntries();
                  plan.cases.push_back({.name = c});
                  begun = Clock::now();
                },
            .end =
                [&](const CaseRecord&) {
                  ModelPlan::Case& c = plan.cases.back();
                  c.seconds = std::chrono::duration<double>(Clock::now() - begun).count();
                  c.entries = counted.takeEntries();
                },
            .endsCaseAtFailure = true});
  for (const CaseRecord& record : session.cases())
    if (record.failed)
      throw std::runtime_error(
          fmt::format("{} fails with nothing altered: {}", record.name, firstLine(record)));
  session.forgetCases();
  std::ranges::stable_sort(plan.cases, {}, &ModelPlan::Case::seconds);
  plan.mutants = counted.mutants();
  return plan;
}

ModelOutcome judgeMutant(Session& session, const ModelPlan& plan, const ModelMutant& mutant,
                         std::size_t sought) {
  const AlteredModel altered(mutant);
  ModelOutcome outcome;
  for (const ModelPlan::Case& c : plan.cases) {
    if (!c.entries.contains(mutant.entry)) continue;
    session.forgetCases();
    runCases(session, {c.name}, {.begin = {}, .end = {}, .endsCaseAtFailure = true});
    const CaseRecord& record = session.cases().back();
    if (!record.failed) continue;
    if (outcome.killers.empty()) outcome.message = firstLine(record);
    outcome.killers.push_back(record.name);
    if (outcome.killers.size() == sought) break;
  }
  session.forgetCases();
  return outcome;
}

std::map<std::string, std::string> explainedModelMutants(const std::filesystem::path& root,
                                                         const std::string& kernel) {
  const std::filesystem::path file = root / "tests/mutants/models.json";
  std::map<std::string, std::string> reasons;
  if (!std::filesystem::exists(file)) return reasons;
  try {
    std::ifstream in(file);
    const nlohmann::json all = nlohmann::json::parse(in);
    if (!all.contains(kernel)) return reasons;
    for (const nlohmann::json& explained : all.at(kernel))
      reasons[explained.at("id").get<std::string>()] = explained.at("reason").get<std::string>();
  } catch (const nlohmann::json::exception& error) {
    throw UsageError(fmt::format("{}: {}", file.string(), error.what()));
  }
  return reasons;
}

}  // namespace gnomon
