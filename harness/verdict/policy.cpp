#include "harness/verdict/policy.h"

#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {

Policy Policy::load(const std::filesystem::path& file) {
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object())
    throw UsageError(fmt::format("{}: not a readable JSON object", file.string()));
  Policy policy;
  for (const auto& [name, entry] : json.items()) {
    if (!entry.is_object() || !entry.contains("value") || !entry["value"].is_number() ||
        entry.value("reason", std::string()).empty())
      throw UsageError(
          fmt::format("{}: '{}' needs a number \"value\" and a \"reason\"", file.string(), name));
    policy.values[name] = entry["value"].get<double>();
  }
  return policy;
}

double Policy::operator[](const std::string& name) const {
  const auto found = values.find(name);
  if (found == values.end())
    throw std::logic_error(fmt::format("tests/policy.json has no '{}'", name));
  return found->second;
}

}  // namespace gnomon
