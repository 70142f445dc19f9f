// The commands. Each reads its options, does one thing and returns an exit status:
// 0 all good; 1 something is wrong with a kernel, a frame or against a baseline; 2 usage or bad
// input file; 3 no usable device.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/cases/runner.h"
#include "harness/cases/session.h"

namespace gnomon {

inline constexpr int kGood = 0;
inline constexpr int kWrong = 1;
inline constexpr int kUsage = 2;
inline constexpr int kNoDevice = 3;

/// The source tree: $GNOMON_ROOT, else where the command was built from, else a folder above the
/// command. Throws UsageError if none holds tests/policy.json.
std::filesystem::path sourceRoot();

struct DevicesOptions {
  std::string json;  ///< file, "-" or empty
};
int devices(const DevicesOptions& options);

struct ListOptions {
  std::string what;    ///< stages, kernels or cases
  bool kills = false;  ///< of cases: which mutants each kills
  std::vector<std::string> stages;
  std::vector<std::string> kinds{};    ///< of cases, by name; none: all
  std::vector<std::string> mutants{};  ///< that --kills asks about, by id; none: all
  SessionOptions session;              ///< where --kills has to find out
  std::optional<unsigned> jobs{};      ///< the same
  std::string json;
};
int list(const ListOptions& options);
/// The cases that it is about.
std::vector<CaseName> casesOf(const ListOptions& options);
/// The part of it that runs kernels.
int listKills(const ListOptions& options);

struct ValidateOptions {
  SessionOptions session;
  Selection selection;
  std::string json;
  std::filesystem::path out;  ///< folder for what each case found
  std::filesystem::path junit;
  bool require = false;            ///< unsupported and skipped cases are failures
  bool failFast = false;           ///< stop at the first failure
  std::optional<unsigned> jobs{};  ///< workers at a time
};
int validate(const ValidateOptions& options);

struct MutateOptions {
  SessionOptions session;
  std::vector<std::string> stages;
  std::vector<std::string> operators;
  std::optional<std::size_t> sample{};  ///< mutants of each kernel
  std::optional<unsigned> jobs{};
  bool bless = false;  ///< write the scores into tests/mutants/ and README.md
  std::string json;
};
int mutate(const MutateOptions& options);

struct BenchOptions {
  SessionOptions session;
  std::vector<std::string> stages;
  std::filesystem::path baseline;
  std::optional<std::size_t> most{};  ///< objects
  std::filesystem::path plot;         ///< SVG, where not empty
  std::optional<unsigned> jobs{};     ///< taken, and not used: benchmarks run one at a time
  std::string json;
};
int bench(const BenchOptions& options);

struct CompareOptions {
  std::filesystem::path reference, test;  ///< OpenEXR files
  std::filesystem::path heatmap;          ///< PNG, where not empty
  std::optional<double> max, flip;        ///< limits of the largest error and of FLIP's mean
  std::string json;
};
int compare(const CompareOptions& options);

/// Runs cases for a parent process; `task` is its JSON (harness/isolate/messages.h).
int worker(const std::string& task);

/// Runs ctest in the folder that the command was built in.
int test(const std::vector<std::string>& arguments);

}  // namespace gnomon
