// Fates of mutants that are known from earlier runs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "harness/mutate/fate.h"

namespace gnomon {

/// A file of one line of JSON a fate: {"key", "sought", "kills": [[case, how]]}. The key stands for
/// the mutant and everything that its fate depends on.
class FateCache {
 public:
  /// Reads the file if there is one; a line that cannot be read is no fate. Without a path, and
  /// where the file cannot be written, nothing is kept.
  explicit FateCache(std::filesystem::path file);

  /// A fate for which at least so many kills were sought, or found.
  std::optional<Fate> find(std::uint64_t key, unsigned sought) const;
  /// Written before it returns, as far as the death of this process is concerned.
  void keep(std::uint64_t key, const Fate& fate);
  /// Forgets the rest: what belongs to sources that are no more.
  void keepOnly(const std::set<std::uint64_t>& keys);

 private:
  void write(std::uint64_t key, const Fate& fate);

  std::filesystem::path path;
  std::map<std::uint64_t, Fate> fates;
  std::ofstream out;
};

/// A hash of all sources that decide what a stage's cases say of a kernel: the stage's tests,
/// models and records, the harness, bounds, truth, policy and data. Empty where one of them is
/// younger than the running command, which then is not made of them.
std::optional<std::uint64_t> evidenceHash(const std::filesystem::path& root,
                                          const std::string& stage);

}  // namespace gnomon
