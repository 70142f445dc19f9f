// Comparing a run of benchmarks with an earlier one.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "harness/report/terminal.h"

namespace gnomon {

/// Real time of each benchmark in nanoseconds: the median of its repetitions.
using Times = std::map<std::string, double>;

/// Of a file that `gnomon bench --json` wrote; throws UsageError where it is none.
Times readBaseline(const std::filesystem::path& file);

/// Prints both times of every benchmark; true where one is slower than the policy allows, or gone.
bool slowerThan(const Times& before, const Times& now, double allowed, Terminal& terminal);

}  // namespace gnomon
