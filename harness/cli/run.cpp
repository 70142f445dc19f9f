#include "harness/cli/run.h"

#include <algorithm>
#include <iterator>

#include "harness/isolate/sweep.h"

namespace gnomon {
namespace {

bool measuresTheDevice(const CaseName& c) { return c.kernel.starts_with("precision/"); }

}  // namespace

Run::Run(RunOptions o, std::vector<CaseName> c)
    : options(std::move(o)), cases(std::move(c)), errors(options.prepared.errors) {
  if (options.results == nullptr) return;
  for (const Result& r : options.results->found()) {
    taken += r.width == 0;
    found[{r.width, r.record.name}] = r.record;
  }
}

void Run::judge() {
  std::vector<CaseName> measuring, others;
  for (const CaseName& c : cases) (measuresTheDevice(c) ? measuring : others).push_back(c);
  runAt(0, measuring);
  learnErrors(measuring);
  runAt(0, others);
  for (const unsigned width : otherWidths(options.prepared.gpu)) sweep(width);
}

void Run::runAt(unsigned width, const std::vector<CaseName>& wanted) {
  const auto done = [&](const CaseName& c) { return found.contains({width, c.name}); };
  const std::vector<CaseName>& counted = width == 0 ? cases : wanted;
  std::vector<CaseName> left;
  std::ranges::remove_copy_if(wanted, std::back_inserter(left), done);
  std::vector<Batch> batches =
      batchesOf(left, options.session, static_cast<std::size_t>(options.policy["batchCases"]));
  if (width != 0)
    for (Batch& b : batches) b.environment = environmentFor(width);

  std::vector<std::string> running;
  const auto tell = [&] {
    options.observer.progress(static_cast<std::size_t>(std::ranges::count_if(counted, done)),
                              counted.size(), lanesOf(width), running);
  };
  const auto begin = [&](const CaseName& c) {
    running.push_back(c.name);
    tell();
  };
  const auto end = [&](CaseRecord record) {
    if (options.results) options.results->append({width, record});
    std::erase(running, record.name);
    found[{width, record.name}] = std::move(record);
    tell();
    if (width == 0) tellInOrder();
  };
  SessionOptions session = options.session;
  if (width != 0) session.shrinks = false;  // at that width a replay would need its environment
  runBatches({session, options.policy, options.jobs, errors}, batches,
             {.begun = begin, .ended = end});
  if (width == 0) tellInOrder();
}

/// Of as many cases as have a record and none before them is missing.
void Run::tellInOrder() {
  for (; all.size() < cases.size(); options.observer.ended(all.back())) {
    const auto next = found.find({0, cases[all.size()].name});
    if (next == found.end()) return;
    all.push_back(next->second);
  }
}

/// In the catalogue's order, so that what comes out does not depend on who came first.
void Run::learnErrors(const std::vector<CaseName>& from) {
  for (const CaseName& c : from)
    for (const auto& [operation, error] : found.at({0, c.name}).measured) {
      merge(errors, operation, error);
      measured = true;
    }
}

void Run::sweep(unsigned width) {
  std::vector<CaseName> again;
  for (const CaseRecord& r : all)
    if (dependsOnWidth(r, width)) again.push_back({r.name, r.kernel});
  runAt(width, again);
  for (CaseRecord& r : all) {
    const auto there = found.find({width, r.name});
    if (there == found.end() || there->second.messages.empty()) continue;
    const bool passedSoFar = !r.failed;
    addFailures(r, width, there->second);
    if (passedSoFar) options.observer.ended(r);
  }
}

}  // namespace gnomon
