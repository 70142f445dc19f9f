#include "harness/cli/run.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "harness/isolate/sweep.h"

namespace gnomon {
namespace {

bool measuresTheDevice(const CaseName& c) { return c.kernel.starts_with("precision/"); }

std::string nameOf(const Turn& turn) {
  if (turn.width == 0) return turn.name.name;
  return fmt::format("{} in subgroups of {}", turn.name.name, lanesOf(turn.width));
}

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
  std::vector<Turn> turns, measuring, others;
  for (const CaseName& c : cases) {
    turns.push_back({c});
    (measuresTheDevice(c) ? measuring : others).push_back({c});
  }
  runAll(measuring, turns);
  if (hadEnough()) return tellTheRest();
  learnErrors(measuring);
  runAll(others, turns);
  if (hadEnough()) return tellTheRest();
  sweep();
}

void Run::runAll(const std::vector<Turn>& wanted, const std::vector<Turn>& counted) {
  const auto done = [&](const Turn& t) { return found.contains({t.width, t.name.name}); };
  std::vector<Turn> left;
  std::ranges::remove_copy_if(wanted, std::back_inserter(left), done);
  auto ended = static_cast<std::size_t>(std::ranges::count_if(counted, done));
  std::vector<std::string> running;
  const auto tell = [&] { options.observer.progress(ended, counted.size(), running); };
  const auto begin = [&](const Turn& turn) {
    running.push_back(nameOf(turn));
    tell();
  };
  const auto end = [&](unsigned width, CaseRecord record) {
    if (options.results) options.results->append({width, record});
    std::erase(running, nameOf({{record.name, record.kernel}, width}));
    found[{width, record.name}] = std::move(record);
    ++ended;
    tell();
    if (width == 0) tellInOrder();
  };
  runTurns({options.session, options.policy, options.jobs, errors}, left,
           {.begun = begin, .ended = end, .enough = options.observer.enough});
  tellInOrder();
}

/// Of as many cases as have a record and none before them is missing.
void Run::tellInOrder() {
  for (; all.size() < cases.size(); options.observer.ended(all.back())) {
    const auto next = found.find({0, cases[all.size()].name});
    if (next == found.end()) return;
    all.push_back(next->second);
  }
}

bool Run::hadEnough() const {
  return options.observer.enough && std::ranges::any_of(found, [&](const auto& f) {
           return options.observer.enough(f.second);
         });
}

/// Of the cases that have a record, whatever is missing before them.
void Run::tellTheRest() {
  for (std::size_t i = all.size(); i < cases.size(); ++i)
    if (const auto next = found.find({0, cases[i].name}); next != found.end()) {
      all.push_back(next->second);
      options.observer.ended(all.back());
    }
}

/// In the catalogue's order, so that what comes out does not depend on who came first.
void Run::learnErrors(const std::vector<Turn>& from) {
  for (const Turn& t : from)
    for (const auto& [operation, error] : found.at({0, t.name.name}).measured) {
      merge(errors, operation, error);
      measured = true;
    }
}

void Run::sweep() {
  const std::vector<unsigned> widths = otherWidths(options.prepared.gpu);
  std::vector<Turn> again;
  for (const unsigned width : widths)
    for (const CaseRecord& r : all)
      if (dependsOnWidth(r)) again.push_back({{r.name, r.kernel}, width});
  runAll(again, again);
  for (const unsigned width : widths)
    for (CaseRecord& r : all) {
      const auto there = found.find({width, r.name});
      if (there == found.end() || there->second.messages.empty()) continue;
      const bool passedSoFar = !r.failed;
      addFailures(r, width, there->second);
      if (passedSoFar) options.observer.ended(r);
    }
}

}  // namespace gnomon
