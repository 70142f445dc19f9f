#include "harness/mutate/models.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Json = nlohmann::json;

std::string firstLine(const CaseRecord& record) {
  if (record.messages.empty()) return {};
  return record.messages.front().substr(0, record.messages.front().find('\n'));
}

}  // namespace

ModelPlan planModel(Session& session, const std::string& kernel) {
  std::vector<CaseName> cases = selectCases({.stages = {kernel}});
  std::erase_if(cases, [](const CaseName& c) { return !judgesModel(kindOf(c)); });
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

std::string toJson(const std::vector<ModelMutant>& mutants) {
  Json list = Json::array();
  for (const ModelMutant& m : mutants)
    list.push_back({m.id(), m.entry, std::string(nameOf(m.operation.kind))});
  return list.dump();
}

std::string toJson(const ModelOutcome& outcome) {
  return Json{{"killers", outcome.killers}, {"message", outcome.message}}.dump(
      -1, ' ', false, Json::error_handler_t::replace);
}

std::vector<NamedModelMutant> modelMutants(std::string_view json) try {
  std::vector<NamedModelMutant> all;
  for (const Json& m : Json::parse(json)) all.push_back({m.at(0), m.at(1), m.at(2)});
  return all;
} catch (const Json::exception& error) {
  throw UsageError(fmt::format("this is no list of a model's mutants: {}", error.what()));
}

ModelOutcome modelOutcome(std::string_view json) try {
  const Json j = Json::parse(json);
  return {.killers = j.at("killers"), .message = j.at("message")};
} catch (const Json::exception& error) {
  throw UsageError(fmt::format("this is no outcome of a model's mutant: {}", error.what()));
}

}  // namespace gnomon
