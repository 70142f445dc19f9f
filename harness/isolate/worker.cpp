#include "harness/isolate/worker.h"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "harness/cases/runner.h"
#include "harness/error.h"
#include "harness/isolate/process.h"

namespace gnomon {
namespace {

// A driver may print too: lines of ours begin so.
constexpr std::string_view kBegun = "@begun ";
constexpr std::string_view kEnded = "@ended ";

void say(std::string_view what, const std::string& text) {
  fmt::print("{}{}\n", what, text);
  std::fflush(stdout);  // what a crash would take along
}

std::string lastLines(const std::string& text) {
  constexpr std::size_t kEnough = 600;
  return text.size() <= kEnough ? text : "..." + text.substr(text.size() - kEnough);
}

std::string deathOf(const ProcessResult& end) {
  std::string why = end.inWords();
  if (!end.errors.empty()) why += "; it said last:\n" + lastLines(end.errors);
  return why;
}

std::vector<CaseName> namedCases(const std::vector<std::string>& names) {
  std::vector<CaseName> chosen;
  for (const CaseName& c : selectCases({}))
    if (std::ranges::find(names, c.name) != names.end()) chosen.push_back(c);
  if (chosen.size() != names.size())
    throw UsageError("a worker was asked for cases that do not exist");
  return chosen;
}

}  // namespace

void serve(const WorkerTask& task) {
  const std::vector<CaseName> cases = namedCases(task.cases);
  Session session(task.session);
  runCases(session, cases,
           {.begin = [](const CaseName& c, std::size_t, std::size_t) { say(kBegun, c.name); },
            .end = [](const CaseRecord& r) { say(kEnded, toJson(r)); }});
}

WorkerReport runWorker(const WorkerTask& task, const WorkerOptions& options) {
  WorkerReport report;
  const auto listen = [&](std::string_view line) {
    if (line.starts_with(kBegun)) report.running = line.substr(kBegun.size());
    if (!line.starts_with(kEnded)) return;
    report.records.push_back(caseRecord(line.substr(kEnded.size())));
    report.running.clear();
    if (options.ended) options.ended(report.records.back());
  };
  const ProcessResult end = runProcess(thisExecutable(), {.arguments = {"worker", toJson(task)},
                                                          .environment = options.environment,
                                                          .limit = options.limit,
                                                          .onLine = listen});
  if (!end.succeeded() || report.records.size() != task.cases.size()) report.death = deathOf(end);
  return report;
}

}  // namespace gnomon
