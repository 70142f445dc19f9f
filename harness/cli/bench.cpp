#include <algorithm>
#include <fstream>
#include <map>
#include <regex>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/isolate/worker.h"
#include "harness/program/kernel.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

constexpr int kRepetitions = 5;

/// Real time of each benchmark in nanoseconds: the median of its repetitions.
using Times = std::map<std::string, double>;

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

  const Times& medians() const { return times; }

 private:
  void keep(const Run& run) {
    const std::string name = run.run_name.str();
    const double ns =
        run.GetAdjustedRealTime() / benchmark::GetTimeUnitMultiplier(run.time_unit) * 1e9;
    times[name] = ns;
    const auto rate = [&](const char* counter, double unit) {
      const auto found = run.counters.find(counter);
      return found == run.counters.end() ? 0.0 : found->second.value / unit;
    };
    terminal.print(fmt::format("{:<44} {:>10.2f} us  {:>9.2f} M items/s  {:>8.2f} GB/s", name,
                               ns / 1000, rate("items_per_second", 1e6),
                               rate("bytes_per_second", 1e9)));
  }

  Terminal& terminal;
  Times times;
};

Times readBaseline(const std::filesystem::path& file) {
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("benchmarks"))
    throw UsageError(fmt::format("{}: not a Google Benchmark JSON file", file.string()));
  Times times;
  static const std::map<std::string, double> kUnits = {
      {"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}};
  for (const auto& b : json["benchmarks"]) {
    if (!b.is_object() || b.value("aggregate_name", std::string()) != "median") continue;
    const auto unit = kUnits.find(b.value("time_unit", std::string("ns")));
    if (unit == kUnits.end() || !b.contains("real_time")) continue;
    times[b.value("run_name", std::string())] = b.value("real_time", 0.0) * unit->second;
  }
  if (times.empty())
    throw UsageError(
        fmt::format("{}: holds no medians; write it with `gnomon bench --json`", file.string()));
  return times;
}

/// Prints both times of every benchmark; true where one is slower than the policy allows.
bool slowerThan(const Times& before, const Times& now, double allowed, Terminal& terminal) {
  std::vector<std::vector<std::string>> rows = {{"benchmark", "baseline", "now", "ratio"}};
  bool slower = false;
  for (const auto& [name, ns] : now) {
    const auto found = before.find(name);
    if (found == before.end()) {
      rows.push_back({name, "none", fmt::format("{:.2f} us", ns / 1000), ""});
      continue;
    }
    const double ratio = ns / found->second;
    slower |= ratio > allowed;
    rows.push_back({name, fmt::format("{:.2f} us", found->second / 1000),
                    fmt::format("{:.2f} us", ns / 1000),
                    terminal.paint(ratio > allowed ? Colour::kRed : Colour::kGreen,
                                   fmt::format("{:.2f}", ratio))});
  }
  for (const auto& [name, ns] : before)
    if (!now.contains(name)) {
      rows.push_back({name, fmt::format("{:.2f} us", ns / 1000), "none", ""});
      slower = true;
    }
  terminal.print(table(rows, "lrrr"));
  if (slower)
    terminal.print(fmt::format("slower than the baseline by more than {:.2f}, or gone", allowed));
  return slower;
}

std::string pattern(const std::vector<std::string>& stages) {
  if (stages.empty()) return ".*";
  std::vector<std::string> known;
  for (const KernelRecord* r : catalogue()) known.push_back(r->stage);
  for (const std::string& s : stages)
    if (std::ranges::find(known, s) == known.end())
      throw UsageError(
          fmt::format("there is no benchmark '{}'.\nStages: {}", s, fmt::join(known, ", ")));
  return fmt::format("^({})/", fmt::join(stages, "|"));
}

}  // namespace

int bench(const BenchOptions& given) {
  BenchOptions options = given;
  options.session.root = sourceRoot();
  options.session.validation = false;  // its layer costs time that is not the kernel's
  const std::string filter = pattern(options.stages);
  Times before = options.baseline.empty() ? Times{} : readBaseline(options.baseline);
  std::erase_if(before, [chosen = std::regex(filter)](const auto& b) {
    return !std::regex_search(b.first, chosen);
  });
  for (const auto& [kernel, file] : options.session.kernels) findKernel(kernel);
  Session session(options.session);
  // Somebody's file may crash or hang whoever compiles it: a worker finds out first.
  if (!options.session.kernels.empty()) prepare(options.session, session.policy());
  Terminal terminal(options.json == "-" ? stderr : stdout);
  terminal.print(fmt::format("{}, {}", session.gpu().info().name, session.gpu().info().driver));

  const std::string out = options.json == "-" ? "/dev/stdout" : options.json;
  std::vector<std::string> words = {"gnomon", "--benchmark_filter=" + filter,
                                    fmt::format("--benchmark_repetitions={}", kRepetitions),
                                    "--benchmark_min_time=0.05"};
  if (!out.empty()) {
    writeText(out, "");  // says so now if it cannot be written, not after the work
    words.push_back("--benchmark_out=" + out);
  }
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  int argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());
  Reporter reporter(terminal);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  if (options.baseline.empty()) return kGood;
  return slowerThan(before, reporter.medians(), session.policy()["benchRegression"], terminal)
             ? kWrong
             : kGood;
}

}  // namespace gnomon
