// What the owner of a foreign kernel says of it: a JSON file that `--kernel STAGE/ENTRY=FILE`
// takes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace gnomon {

/// Every key is optional but "files". Names on the left of a colon are the contract's, on the right
/// the module's, as reflection spells them ("items[].n", "params.exposure").
struct Adapter {
  std::filesystem::path file{};  ///< the adapter itself; paths in it are relative to its folder

  std::string language{};           ///< "glsl", "hlsl" or "spirv"; else by the file's ending
  std::filesystem::path compute{};  ///< files.comp
  std::string entry = "main";       ///< entry point
  std::vector<std::filesystem::path> include{};
  std::map<std::string, std::string> defines{};
  std::map<std::string, double> specialization{};             ///< by name or id
  std::map<std::string, std::array<unsigned, 2>> bindings{};  ///< buffer or image: [set, binding]
  std::map<std::string, std::string> fields{};                ///< "samples.normal": "items[].n"
  /// Values of the module's own parameters, by member path; or of a push constant of the contract
  /// that the module does not have: it is then judged only where the cases use that value.
  std::map<std::string, double> constants{};
  /// What one group covers on each axis; else as many as it has threads.
  std::optional<std::array<unsigned, 3>> grid{};
  std::map<std::string, std::string> conventions{};
  /// Expressions that call functions of the file, by the record's slots: the harness writes the
  /// entry point. {"D": "DistributionGGX(n, h, roughness)"}
  std::map<std::string, std::string> functions{};
};

/// Reads an adapter. Throws UsageError with file, key and what stands there: no JSON, a key that
/// nobody knows, a value of the wrong kind, a file that is missing.
Adapter readAdapter(const std::filesystem::path& file);

}  // namespace gnomon
