#include <algorithm>
#include <cmath>
#include <regex>
#include <set>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bench/objects.h"
#include "bench/scaling.h"
#include "bench/stopwatch.h"
#include "harness/cli/baseline.h"
#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/isolate/worker.h"
#include "harness/program/kernel.h"
#include "harness/report/summary.h"

namespace gnomon {
namespace {

constexpr int kRepetitions = 5;
constexpr const char* kObjects = "objects";

/// Prints each benchmark as it ends and keeps its median.
class Reporter : public benchmark::BenchmarkReporter {
 public:
  explicit Reporter(Terminal& t) : terminal(t) {}

  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.error_occurred) {
        terminal.print(fmt::format("{:<32} skipped: {}", run.benchmark_name(), run.error_message));
      } else if (run.aggregate_name == "median") {
        keep(run);
      }
    }
  }

  const std::vector<Outcome>& medians() const { return outcomes; }

 private:
  void keep(const Run& run) {
    Outcome& outcome = outcomes.emplace_back();
    outcome.name = run.run_name.str();
    outcome.seconds = run.GetAdjustedRealTime() / benchmark::GetTimeUnitMultiplier(run.time_unit);
    for (const auto& [name, counter] : run.counters) outcome.counters[name] = counter.value;
    const auto rate = [&](const char* counter, double unit) {
      const auto found = outcome.counters.find(counter);
      return found == outcome.counters.end() ? 0.0 : found->second / unit;
    };
    terminal.print(fmt::format("{:<44} {:>10.2f} us  {:>9.2f} M items/s  {:>8.2f} GB/s",
                               outcome.name, outcome.seconds * 1e6, rate("items_per_second", 1e6),
                               rate("bytes_per_second", 1e9)));
  }

  Terminal& terminal;
  std::vector<Outcome> outcomes;
};

/// Leaves out counters that JSON has no number for: the coefficient of variation of what is always
/// 0 is NaN.
class FiniteJson : public benchmark::JSONReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> finite = runs;
    for (Run& run : finite)
      std::erase_if(run.counters, [](const auto& c) { return !std::isfinite(c.second.value); });
    JSONReporter::ReportRuns(finite);
  }
};

Times timesOf(const std::vector<Outcome>& outcomes) {
  Times times;
  for (const Outcome& o : outcomes) times[o.name] = o.seconds * 1e9;
  return times;
}

bool runsObjects(const std::vector<std::string>& wanted) {
  return wanted.empty() || std::ranges::find(wanted, kObjects) != wanted.end();
}

std::string pattern(const std::vector<std::string>& wanted) {
  if (wanted.empty()) return ".*";
  std::set<std::string> stages = {kObjects}, entries;
  for (const KernelRecord* r : catalogue()) {
    stages.insert(r->stage);
    entries.insert(r->name());
  }
  for (const std::string& s : wanted)
    if (!stages.contains(s) && !entries.contains(s))
      throw UsageError(fmt::format("there is no benchmark '{}'.\nThere are: {}, and STAGE/ENTRY", s,
                                   fmt::join(stages, ", ")));
  return fmt::format("^({})/", fmt::join(wanted, "|"));
}

void refuseWhatNeedsObjects(const BenchOptions& options) {
  if (runsObjects(options.stages)) return;
  if (!options.plot.empty()) throw UsageError("--plot shows `gnomon bench objects`");
  if (options.most) throw UsageError("--to is for `gnomon bench objects`");
}

/// The baseline's times of what is chosen, or nothing without one.
Times chosenOf(const std::filesystem::path& baseline, const std::string& filter) {
  if (baseline.empty()) return {};
  Times before = readBaseline(baseline);
  std::erase_if(before, [chosen = std::regex(filter)](const auto& b) {
    return !std::regex_search(b.first, chosen);
  });
  return before;
}

std::string contextOf(const Stopwatch& watch) {
  const auto text = [](double value) { return fmt::format("{:.6g}", value); };
  benchmark::AddCustomContext("empty_dispatch_seconds", text(watch.emptySeconds()));
  benchmark::AddCustomContext("copy_bytes_per_second", text(watch.copyBytesPerSecond()));
  return fmt::format("caches cold; an empty dispatch takes {:.2f} us, a copy moves {:.2f} GB/s",
                     watch.emptySeconds() * 1e6, watch.copyBytesPerSecond() * 1e-9);
}

/// Google Benchmark, told by its own flags.
void runBenchmarks(const std::string& filter, const std::string& json, Reporter& reporter) {
  std::vector<std::string> words = {"gnomon", "--benchmark_filter=" + filter,
                                    fmt::format("--benchmark_repetitions={}", kRepetitions),
                                    "--benchmark_min_time=0"};  // bench/timing.h repeats
  if (!json.empty()) words.push_back("--benchmark_out=" + json);
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  int argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());
  FiniteJson file;
  benchmark::RunSpecifiedBenchmarks(&reporter, json.empty() ? nullptr : &file);
}

}  // namespace

int bench(const BenchOptions& given) {
  BenchOptions options = given;
  options.session.root = sourceRoot();
  options.session.validation = false;  // its layer costs time that is not the kernel's
  const std::string filter = pattern(options.stages);
  refuseWhatNeedsObjects(options);
  const Times before = chosenOf(options.baseline, filter);
  for (const auto& [kernel, file] : options.session.kernels) findKernel(kernel);
  const std::string json = options.json == "-" ? "/dev/stdout" : options.json;
  // Says so now if a file cannot be written, not after the work.
  if (!json.empty()) writeText(json, "");
  if (!options.plot.empty()) writeText(options.plot, "");
  Session session(options.session);
  // Somebody's file may crash or hang whoever compiles it: a worker finds out first.
  if (!options.session.kernels.empty()) prepare(options.session, session.policy());
  Terminal terminal(options.json == "-" ? stderr : stdout);
  const std::string device =
      fmt::format("{}, {}", session.gpu().info().name, session.gpu().info().driver);
  Stopwatch watch(session);
  terminal.print(device + "\n" + contextOf(watch));
  if (runsObjects(options.stages))
    registerObjects(options.most.value_or(kMostObjects), options.session.seed);
  Reporter reporter(terminal);
  runBenchmarks(filter, json, reporter);
  if (const std::string report = scalingReport(reporter.medians()); !report.empty())
    terminal.print("\n" + report);
  if (!options.plot.empty())
    writeText(options.plot, svgOf(scalingPlot(reporter.medians(), device)));
  if (options.baseline.empty()) return kGood;
  return slowerThan(before, timesOf(reporter.medians()), session.policy()["benchRegression"],
                    terminal)
             ? kWrong
             : kGood;
}

}  // namespace gnomon
