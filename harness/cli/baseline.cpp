#include "harness/cli/baseline.h"

#include <fstream>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {

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

}  // namespace gnomon
