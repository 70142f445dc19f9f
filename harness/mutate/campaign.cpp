#include "harness/mutate/campaign.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "harness/isolate/sweep.h"
#include "harness/isolate/worker.h"

namespace gnomon {
namespace {

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

/// The line of a case's message that says most: what is wrong, not that something is.
std::string gist(const CaseRecord& record) {
  if (record.messages.empty()) return "failed";
  const std::string& message = record.messages.front();
  const std::string head = firstLine(message);
  if (head.size() == message.size()) return head;
  const std::string second = firstLine(message.substr(head.size() + 1));
  return head.ends_with(" is wrong") && !second.empty() ? second : head;
}

/// Mutants that one worker judges, and the cases that are left for them.
struct Chunk {
  std::vector<std::size_t> mutants{};
  std::vector<CaseName> cases{};
  unsigned width = 0;  ///< of a subgroup, as harness/isolate/sweep.h counts it

  std::string where() const {
    return width == 0 ? "" : fmt::format(" in subgroups of {}", lanesOf(width));
  }
};

class Campaign {
 public:
  Campaign(const Schedule& s, const std::string& k, const std::vector<Mutant>& m,
           const std::vector<Witness>& w, unsigned n, const CampaignObserver& o)
      : schedule(s), kernel(k), mutants(m), witnesses(w), sought(n), observer(o), fates(m.size()) {
    for (Fate& f : fates) f.sought = sought;
  }

  void run(const GpuInfo& gpu) {
    // Some go first and show which cases kill most: the others meet those first.
    constexpr std::size_t kOneOf = 16;
    std::vector<std::size_t> first, others;
    for (std::size_t i = 0; i < mutants.size(); ++i)
      (i % kOneOf == 0 ? first : others).push_back(i);
    std::vector<unsigned> widths = otherWidths(gpu);
    if (casesOfCommunicating().empty()) widths.clear();
    last = widths.empty();
    runAll(first, allCases());
    putKillersFirst();
    runAll(others, allCases());
    for (const unsigned width : widths) {
      last = width == widths.back();
      runAll(survivors(), casesOfCommunicating(), width);
    }
  }

 private:
  std::vector<CaseName> allCases() const {
    std::vector<CaseName> cases;
    for (const Witness& w : witnesses) cases.push_back(w.name);
    return cases;
  }

  /// Those that have killed as many stay as they are, the cheapest first.
  void putKillersFirst() {
    std::map<std::string, std::size_t> kills;
    for (const Fate& f : fates)
      if (!f.kills.empty()) ++kills[f.kills.front().by];
    std::ranges::stable_sort(witnesses, std::greater{},
                             [&](const Witness& w) { return kills[w.name.name]; });
  }

  std::vector<CaseName> casesOfCommunicating() const {
    std::vector<CaseName> cases;
    for (const Witness& w : witnesses)
      if (w.communicates) cases.push_back(w.name);
    return cases;
  }

  std::vector<std::size_t> survivors() const {
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < fates.size(); ++i)
      if (fates[i].survived()) left.push_back(i);
    return left;
  }

  /// Chunks of at most so many mutants: starting a worker costs as much as judging two or three,
  /// and at the end every core should have something to do.
  void runAll(const std::vector<std::size_t>& chosen, const std::vector<CaseName>& cases,
              unsigned width = 0) {
    constexpr std::size_t kMost = 16;
    const std::size_t share = chosen.size() / (2 * std::size_t{schedule.jobs}) + 1;
    const std::size_t size = std::min(kMost, share);
    for (std::size_t begin = 0; begin < chosen.size(); begin += size) {
      const auto from = chosen.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto to =
          chosen.begin() + static_cast<std::ptrdiff_t>(std::min(begin + size, chosen.size()));
      chunks.push_back({.mutants = {from, to}, .cases = cases, .width = width});
    }
    {
      std::vector<std::jthread> threads;
      for (unsigned i = 0; i < schedule.jobs; ++i) threads.emplace_back([this] { work(); });
    }
    if (error) std::rethrow_exception(error);
  }

  void work() try {
    for (Chunk chunk; take(chunk);) run(std::move(chunk));
  } catch (...) {
    const std::lock_guard lock(mutex);
    if (!error) error = std::current_exception();
  }

  bool take(Chunk& chunk) {
    const std::lock_guard lock(mutex);
    if (error || chunks.empty()) return false;
    chunk = std::move(chunks.front());
    chunks.pop_front();
    return true;
  }

  /// One worker after another until every mutant of the chunk has its fate.
  void run(Chunk chunk) {
    while (!chunk.mutants.empty()) {
      const WorkerOptions options = optionsFor(chunk);
      WorkerTask task{.session = sessionAt(chunk.width, schedule.session),
                      .errors = schedule.errors,
                      .mutated = kernel,
                      .kills = sought};
      for (const CaseName& c : chunk.cases) task.cases.push_back(c.name);
      for (const std::size_t m : chunk.mutants) task.mutants.push_back(mutants[m].id);
      const std::size_t before = chunk.mutants.size();
      const WorkerReport report = runWorker(task, options);
      if (chunk.mutants.empty()) return;
      if (report.mutant.empty() && chunk.mutants.size() == before) throwWhatItExitedWith(report);
      afterDeath(chunk, report, report.death(options));
    }
  }

  WorkerOptions optionsFor(Chunk& chunk) {
    return {.environment = environmentFor(chunk.width),
            .limit = caseLimit(schedule.session, schedule.policy),
            .limitOf = [this](const std::string& name) { return patience(name); },
            .memoryBytes = memoryLimit(schedule.policy, "foreignGibibytes"),
            .ended =
                [this, &chunk](CaseRecord record) {
                  if (record.failed && !chunk.mutants.empty())
                    fates[chunk.mutants.front()].kills.push_back(
                        {record.name + chunk.where(), gist(record)});
                },
            .mutant =
                [this, &chunk](const std::string& id) {
                  if (chunk.mutants.empty() || mutants[chunk.mutants.front()].id != id)
                    throw std::logic_error("a worker judges a mutant out of turn");
                  const std::lock_guard lock(mutex);
                  if (observer.begun) observer.begun(mutants[chunk.mutants.front()]);
                },
            .told = [this, &chunk](const std::string&, const std::string&) { settle(chunk); }};
  }

  /// A mutant may hang: ten times what a case needs for the kernel itself is enough, and what it
  /// takes to compile the mutant, which the case may have found compiled, on a busy machine.
  std::chrono::milliseconds patience(const std::string& name) const {
    constexpr double kTimes = 10, kLeast = 15;
    const auto w = std::ranges::find(witnesses, name, [](const Witness& x) { return x.name.name; });
    const double seconds = w == witnesses.end() ? 0 : w->seconds;
    return std::min(
        caseLimit(schedule.session, schedule.policy),
        std::chrono::milliseconds(std::lround(1000 * std::max(kLeast, kTimes * seconds))));
  }

  void settle(Chunk& chunk) {
    const std::size_t done = chunk.mutants.front();
    chunk.mutants.erase(chunk.mutants.begin());
    const std::lock_guard lock(mutex);
    if (observer.told && (last || !fates[done].survived()))
      observer.told(mutants[done], fates[done]);
  }

  /// The worker died over its mutant: that is a kill, and the cases behind may find another.
  void afterDeath(Chunk& chunk, const WorkerReport& report, const std::string& death) {
    Fate& fate = fates[chunk.mutants.front()];
    const bool recorded = !fate.kills.empty() && report.running.empty();
    if (!recorded) {
      const std::string by = report.running.empty() ? chunk.cases.front().name : report.running;
      fate.kills.push_back({by + chunk.where(), "the worker " + firstLine(death)});
    }
    const std::string& by = fate.kills.back().by;
    auto next = std::ranges::find_if(chunk.cases,
                                     [&](const CaseName& c) { return by.starts_with(c.name); });
    if (next != chunk.cases.end()) ++next;
    if (fate.kills.size() < sought && next != chunk.cases.end()) {
      Chunk rest{.mutants = {chunk.mutants.front()},
                 .cases = {next, chunk.cases.end()},
                 .width = chunk.width};
      chunk.mutants.erase(chunk.mutants.begin());
      run(std::move(rest));
    } else {
      settle(chunk);
    }
  }

  const Schedule& schedule;
  const std::string& kernel;
  const std::vector<Mutant>& mutants;
  std::vector<Witness> witnesses;
  const unsigned sought;
  const CampaignObserver& observer;
  std::vector<Fate> fates;
  std::mutex mutex{};
  std::deque<Chunk> chunks{};
  bool last = true;  ///< of the passes: who survives it, survives
  std::exception_ptr error{};
};

}  // namespace

std::vector<Witness> witnessesOf(const Schedule& schedule, const std::string& kernel,
                                 std::optional<Kind> kind) {
  std::vector<CaseName> cases = selectCases({.stages = {kernel}});
  std::erase_if(cases, [&](const CaseName& c) {
    return !runsKernel(kindOf(c)) || (kind && kindOf(c) != *kind);
  });
  std::vector<Witness> witnesses;
  std::string broken;
  std::vector<Turn> turns;
  for (const CaseName& c : cases) turns.push_back({c});
  runTurns(schedule, turns,
           {.begun = [](const Turn&) {},
            .ended =
                [&](unsigned, CaseRecord r) {
                  if (r.failed) broken += (broken.empty() ? "" : ", ") + r.name;
                  if (r.skipped || r.unsupported) return;
                  witnesses.push_back({{r.name, r.kernel}, r.seconds, r.threadsCommunicate});
                },
            .enough = {}});
  if (!broken.empty())
    throw CaseFailure(
        fmt::format("{} fails {} without being mutated, so nothing can be said of its mutants.\n"
                    "`gnomon validate {}` says why",
                    kernel, broken, kernel));
  std::ranges::sort(witnesses, {},
                    [](const Witness& w) { return std::pair(w.seconds, w.name.name); });
  return witnesses;
}

void judgeMutants(const Schedule& schedule, const GpuInfo& gpu, const std::string& kernel,
                  const std::vector<Mutant>& mutants, const std::vector<Witness>& witnesses,
                  unsigned sought, const CampaignObserver& observer) {
  Campaign(schedule, kernel, mutants, witnesses, sought, observer).run(gpu);
}

}  // namespace gnomon
