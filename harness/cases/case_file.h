// An input as a small file: what a failure is replayed from.
#pragma once

#include <filesystem>
#include <string>

#include "harness/cases/case_input.h"

namespace gnomon {

struct CaseFile {
  std::string name{};         ///< of the case
  std::string kernel{};       ///< "brdf/evaluate"
  std::uint64_t seed = 0;     ///< of the run that found it
  std::string device{};       ///< that it was found on, for a reader
  std::string output{};       ///< that failed, likewise
  std::string field{};        ///< of it; empty for a finding of hygiene
  std::size_t judgement = 0;  ///< which of the inputs that the case judges it replaces, from 0
  CaseInput input{};
};

/// {"schema": 1, "case", "kernel", "seed", "device", "output", "field", "judgement", "input":
/// {"push": {FIELD: number or list}, "buffers": {NAME: [{FIELD: ...}]}, "images": {NAME: {"size",
/// "ofExtent", "texels"}}}}. Numbers read back as the same bits; what JSON cannot say is text:
/// "NaN 0x7fc00000", "Infinity", "-Infinity".
std::string caseFileJson(const CaseFile& file);

/// Throws UsageError with the file, what is wrong with it and where, and what to do.
CaseFile readCaseFile(const std::filesystem::path& file);

/// Whole or not at all, and never half over an earlier one. False where it cannot be written.
bool writeCaseFile(const std::filesystem::path& file, const CaseFile& content);

/// FOLDER/CASE.json.
std::filesystem::path caseFileIn(const std::filesystem::path& folder, const std::string& name);

/// Of the user's cache ($XDG_CACHE_HOME or ~/.cache): gnomon/failures. Empty without a home.
std::filesystem::path failuresCache();

/// Numbers in the largest input that is written: some ten megabytes. What cannot be made smaller
/// is replayed from its seed.
inline constexpr std::size_t kMostNumbers = 1'000'000;

}  // namespace gnomon
