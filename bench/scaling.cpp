#include "bench/scaling.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "harness/report/terminal.h"
#include "reference/truth/power_law.h"

namespace gnomon {
namespace {

constexpr double kConfidence = 0.95;

struct Point {
  std::size_t objects = 0;
  const Outcome* outcome = nullptr;
};

/// An entry in a world.
struct Curve {
  std::string world{}, entry{};
  std::vector<Point> points{};  ///< ascending
};

/// In the order of the run.
std::vector<Curve> curvesOf(std::span<const Outcome> outcomes) {
  std::vector<Curve> curves;
  for (const Outcome& o : outcomes) {
    std::istringstream words(o.name);
    std::string group, world, entry, objects;
    std::getline(words, group, '/');
    std::getline(words, world, '/');
    std::getline(words, entry, '/');
    std::getline(words, objects, '/');
    if (group != "objects" || objects.empty()) continue;
    auto found = std::ranges::find_if(
        curves, [&](const Curve& c) { return c.world == world && c.entry == entry; });
    if (found == curves.end()) found = curves.insert(found, {world, entry, {}});
    found->points.push_back({std::stoul(objects), &o});
  }
  for (Curve& c : curves) std::ranges::sort(c.points, {}, &Point::objects);
  return curves;
}

std::string timeText(double seconds) {
  if (seconds < 1e-6) return fmt::format("{:.3g} ns", seconds * 1e9);
  if (seconds < 1e-3) return fmt::format("{:.3g} us", seconds * 1e6);
  return fmt::format("{:.3g} ms", seconds * 1e3);
}

std::string lawText(const Curve& curve) {
  std::vector<truth::Sample> samples;
  for (const Point& p : curve.points)
    samples.push_back({static_cast<double>(p.objects), p.outcome->seconds});
  if (samples.size() < truth::kFewestSamples) return "too few sizes";
  const auto law = truth::fitPowerLaw(samples, kConfidence);
  if (!law) return "no growth found";
  return fmt::format("{} + {} n^{:.2f}  [{:.2f}, {:.2f}]", timeText(law->fixed),
                     timeText(law->factor), law->exponent, law->lower, law->upper);
}

/// A counter's text, or nothing where the benchmark has none.
std::string counterText(const Outcome& outcome, const char* name, const char* format, double unit) {
  const auto found = outcome.counters.find(name);
  return found == outcome.counters.end() ? ""
                                         : fmt::format(fmt::runtime(format), found->second * unit);
}

/// Gigabytes a second: three digits, or all before the point.
std::string rateText(const Outcome& outcome) {
  const auto found = outcome.counters.find("bytes_per_second");
  if (found == outcome.counters.end()) return "";
  const double rate = found->second * 1e-9;
  return rate < 999.5 ? fmt::format("{:.3g}", rate) : fmt::format("{:.0f}", rate);
}

std::vector<std::string> rowOf(const Curve& curve) {
  const auto& [objects, outcome] = curve.points.back();
  const auto draws = [&last = *outcome](const char* name) {
    const auto found = last.counters.find(name);
    return found == last.counters.end() ? "" : grouped(static_cast<std::size_t>(found->second));
  };
  return {curve.world,
          curve.entry,
          grouped(objects),
          timeText(outcome->seconds),
          draws("draws_before"),
          draws("draws_after"),
          counterText(*outcome, "culled", "{:.1f} %", 100),
          rateText(*outcome),
          counterText(*outcome, "share_of_copy", "{:.1f} %", 100),
          lawText(curve)};
}

std::string countTick(double value) {
  if (value >= 0.999e6) return fmt::format("{:.0f}M", value * 1e-6);
  return value >= 0.999e3 ? fmt::format("{:.0f}k", value * 1e-3) : fmt::format("{:g}", value);
}

std::string timeTick(double seconds) {
  if (seconds < 0.999e-6) return fmt::format("{:.0f} ns", seconds * 1e9);
  if (seconds < 0.999e-3) return fmt::format("{:.0f} µs", seconds * 1e6);
  if (seconds < 0.999) return fmt::format("{:.0f} ms", seconds * 1e3);
  return fmt::format("{:.0f} s", seconds);
}

}  // namespace

std::string scalingReport(std::span<const Outcome> outcomes) {
  const std::vector<Curve> curves = curvesOf(outcomes);
  if (curves.empty()) return "";
  std::vector<std::vector<std::string>> rows = {{"world", "entry", "objects", "time", "draws",
                                                 "after", "culled", "GB/s", "of copy",
                                                 "t = c + a n^b  [95 % of b]"}};
  for (const Curve& c : curves) rows.push_back(rowOf(c));
  return table(rows, "llrrrrrrrl");
}

Plot scalingPlot(std::span<const Outcome> outcomes, const std::string& device) {
  Plot plot{.title = "Time of culling by number of objects",
            .subtitle = device,
            .xLabel = "objects",
            .yLabel = "time",
            .xTick = countTick,
            .yTick = timeTick};
  for (const Curve& c : curvesOf(outcomes)) {
    auto panel = std::ranges::find(plot.panels, c.world, &PlotPanel::title);
    if (panel == plot.panels.end()) panel = plot.panels.insert(panel, {c.world, {}});
    PlotLine& line = panel->lines.emplace_back();
    line.name = c.entry;
    line.dashed = c.entry.starts_with("cpu_");
    for (const Point& p : c.points)
      line.points.push_back({static_cast<double>(p.objects), p.outcome->seconds});
  }
  return plot;
}

}  // namespace gnomon
