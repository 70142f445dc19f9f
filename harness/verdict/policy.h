// The numbers that are a choice, not a derivation: tests/policy.json, each with its reason.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace gnomon {

class Policy {
 public:
  /// Reads {"name": {"value": number, "reason": text}}. Throws UsageError with file and name where
  /// an entry has no number or no reason.
  static Policy load(const std::filesystem::path& file);

  /// A value; throws std::logic_error for a name that is not in the file.
  double operator[](const std::string& name) const;

  /// The same with one value changed.
  Policy with(const std::string& name, double value) const {
    Policy changed = *this;
    changed.values[name] = value;
    return changed;
  }

 private:
  std::map<std::string, double> values;
};

}  // namespace gnomon
