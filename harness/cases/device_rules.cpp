#include "harness/cases/device_rules.h"

#include <unistd.h>

#include <cctype>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/cache.h"
#include "harness/error.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

MeasuredError parseOne(const nlohmann::json& entry, const std::string& where) {
  for (const char* key : {"ulp", "absolute"})
    if (!entry.is_object() || !entry.contains(key) || !entry[key].is_number())
      throw UsageError(fmt::format("{}: \"{}\" is not a number", where, key));
  for (const char* key : {"ulp", "absolute"})
    if (const double x = entry[key]; !(x >= 0 && x < 1e6))
      throw UsageError(fmt::format("{}: {} is no error of an operation", where, x));
  return {.worst = {entry["ulp"], entry["absolute"]},
          .worstAt = entry.value("worstAt", 0.0),
          .arguments = entry.value("arguments", std::size_t{0}),
          .exhaustive = entry.value("exhaustive", false)};
}

DeviceErrors parse(const fs::path& file) {
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("operations") || !json["operations"].is_object())
    throw UsageError(
        fmt::format("{}: not a file of measured errors; `gnomon validate precision` "
                    "writes it anew",
                    file.string()));
  DeviceErrors errors;
  for (const auto& [name, entry] : json["operations"].items()) {
    const auto operation = operationNamed(name);
    if (!operation)
      throw UsageError(fmt::format("{}: there is no operation '{}'", file.string(), name));
    errors[*operation] = parseOne(entry, fmt::format("{}: {}", file.string(), name));
  }
  return errors;
}

}  // namespace

std::string deviceKey(const GpuInfo& gpu) {
  std::string key;
  for (const char c : gpu.name + " " + gpu.driver) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '.')
      key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!key.empty() && key.back() != '-')
      key += '-';
  }
  while (key.ends_with('-')) key.pop_back();
  return key;
}

std::optional<DeviceErrors> loadDeviceErrors(const GpuInfo& gpu, const fs::path& root) {
  for (const fs::path& folder : {cacheFolder() / "devices", root / "data/devices"}) {
    const fs::path file = folder / (deviceKey(gpu) + ".json");
    if (fs::exists(file)) return parse(file);
  }
  return std::nullopt;
}

void cacheDeviceErrors(const GpuInfo& gpu, const DeviceErrors& errors) {
  const fs::path folder = cacheFolder() / "devices", file = folder / (deviceKey(gpu) + ".json");
  std::error_code error;
  fs::create_directories(folder, error);
  // Renamed into place, so that a run beside this one never reads half a file.
  const fs::path draft = file.string() + "." + std::to_string(getpid());
  std::ofstream(draft) << deviceErrorsJson(gpu, errors);
  fs::rename(draft, file, error);
}

void merge(DeviceErrors& known, Operation operation, const MeasuredError& error) {
  const auto found = known.find(operation);
  if (found == known.end() || error.exhaustive || !found->second.exhaustive)
    known[operation] = error;
}

std::string deviceErrorsJson(const GpuInfo& gpu, const DeviceErrors& errors) {
  auto operations = nlohmann::json::object();
  for (const auto& [operation, e] : errors)
    operations[std::string(nameOf(operation))] = {{"ulp", e.worst.ulp},
                                                  {"absolute", e.worst.absolute},
                                                  {"worstAt", e.worstAt},
                                                  {"arguments", e.arguments},
                                                  {"exhaustive", e.exhaustive}};
  return nlohmann::json{{"schema", 1},
                        {"device", {{"name", gpu.name}, {"driver", gpu.driver}, {"api", gpu.api}}},
                        {"command", "gnomon validate precision --out DIR"},
                        {"operations", operations}}
             .dump(1) +
         "\n";
}

Rules deviceRules(const Rules& specification, const DeviceErrors& errors) {
  Rules rules = specification;
  for (const auto& [operation, e] : errors) rules.measure(operation, e.worst);
  return rules;
}

}  // namespace gnomon
