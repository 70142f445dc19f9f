// What a run of objects/... comes to: a table, laws of growth, a plot.
#pragma once

#include <map>
#include <span>
#include <string>

#include "harness/report/plot.h"

namespace gnomon {

/// A benchmark's median.
struct Outcome {
  std::string name{};  ///< "objects/city/frustum/1000", and what Google Benchmark appends
  double seconds = 0;
  std::map<std::string, double> counters{};
};

/// For each world and entry the largest number of objects that was timed, and the law t = c + a n^b
/// of all of them with the 95 % interval of b (reference/truth/power_law.h). Outcomes of another
/// name are left out; empty where there is none of objects.
std::string scalingReport(std::span<const Outcome> outcomes);

/// A panel a world, a line an entry; what runs on the CPU is dashed.
Plot scalingPlot(std::span<const Outcome> outcomes, const std::string& device);

}  // namespace gnomon
