// Survivors that somebody has explained, and the scores on record: tests/mutants/<stage>.json.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace gnomon {

/// Why no case can, or need, tell a mutant from the kernel.
struct Explanation {
  std::string id{};
  std::string text{};    ///< the source line that it was written for
  std::string change{};  ///< as Mutant::change
  std::string reason{};  ///< that a reviewer can check
  /// Whether it survives is chance: two threads would have to meet. It then counts as a survivor
  /// also in a run in which they did, so that the score is one number.
  bool race = false;
};

/// The outcome of a full run.
struct Score {
  std::size_t mutants = 0;     ///< equivalent ones included
  std::size_t equivalent = 0;  ///< found so by their normal form
  std::size_t killed = 0;

  /// killed / (mutants - equivalent), in [0, 1]; 1 where there is nothing to kill.
  double value() const;
  bool operator==(const Score&) const = default;
};

struct MutantRecord {
  std::optional<Score> score{};  ///< written by `gnomon mutate --bless`
  std::vector<Explanation> survivors{};

  const Explanation* find(const std::string& id) const;
};

/// By what is mutated: "brdf/evaluate", "brdf/evaluate model".
using MutantRecords = std::map<std::string, MutantRecord>;

/// Reads {"brdf/evaluate": {"score": {"mutants", "equivalent", "killed"}, "survivors": [{"id",
/// "change", "text", "reason", "race" where true}]}}; empty if there is no file. Throws UsageError
/// naming file and entry where one lacks something or gives no reason.
MutantRecords loadMutantRecords(const std::filesystem::path& file);

/// Throws UsageError where it cannot be written.
void saveMutantRecords(const std::filesystem::path& file, const MutantRecords& records);

/// The README with these scores in the last column of its table of stages, by the stage and entry
/// in a row's first two cells; rows of others keep theirs. Throws UsageError where there is no such
/// table.
std::string withScores(const std::string& readme, const std::map<std::string, std::string>& cells);

}  // namespace gnomon
