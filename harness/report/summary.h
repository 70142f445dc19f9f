// Case records summed up by kernel: the table at the end, the JSON, the JUnit file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/cases/session.h"
#include "harness/report/terminal.h"

namespace gnomon {

struct KernelSummary {
  std::string stage{};
  std::string kernel{};
  Class verdict = Class::kConforms;
  int widening = 0;
  std::size_t cases = 0, failed = 0, skipped = 0, waived = 0;
  std::size_t elements = 0, outside = 0, ambiguous = 0, reassociated = 0;
  std::optional<double> maxBudget{};  ///< none: nothing was judged
  bool exact = true;                  ///< every output was to be exact
  double seconds = 0;
  std::optional<std::string> unsupported{};
  std::vector<const CaseRecord*> records{};
  std::vector<std::string> unmapped{};  ///< outputs that a foreign kernel does not give
};

/// One summary for each kernel, in the order of the records.
std::vector<KernelSummary> summarise(const std::vector<CaseRecord>& records);

/// How to see a case again: the command with device, seed and filter; of a failure that was
/// shrunk, or replayed, with the file of its input.
std::string reproduceCommand(const CaseRecord& record, const SessionOptions& options);

/// The table that ends `validate`.
std::string summaryTable(const std::vector<KernelSummary>& kernels, const Terminal& terminal);

/// `validate --json` (keys are fixed; "domains" holds what each case measured of each field).
std::string summaryJson(const std::vector<KernelSummary>& kernels, const SessionOptions& options,
                        const GpuInfo& gpu);

/// JUnit XML; skipped, unsupported and waived cases are <skipped>, never failures.
std::string summaryJunit(const std::vector<KernelSummary>& kernels);

/// Writes a file whole or throws UsageError naming it; "-" is standard output.
void writeText(const std::filesystem::path& file, const std::string& text);

}  // namespace gnomon
