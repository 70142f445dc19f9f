// The worst errors of a device's operations, as measured by `gnomon validate precision`: what makes
// the device bound of every other stage.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "harness/vulkan/gpu.h"
#include "reference/bound/rules.h"

namespace gnomon {

struct MeasuredError {
  Error worst;         ///< over the operation's domain, against double
  double worstAt = 0;  ///< the first argument there
  std::size_t arguments = 0;
  bool exhaustive = false;  ///< every float of the domain, not a stratified sample
};

using DeviceErrors = std::map<Operation, MeasuredError>;

/// What a device's errors are filed under: its name and driver, in lower case with dashes.
std::string deviceKey(const GpuInfo& gpu);

/// Reads what was measured on this device: the user's cache ($XDG_CACHE_HOME/gnomon/devices), else
/// data/devices/ under root. Nothing if neither knows the device; throws UsageError for a file that
/// is there and cannot be understood.
std::optional<DeviceErrors> loadDeviceErrors(const GpuInfo& gpu, const std::filesystem::path& root);

/// Takes in one operation's error; a sample never replaces what was measured over every float.
void merge(DeviceErrors& known, Operation operation, const MeasuredError& error);

/// Writes to the user's cache; a cache that cannot be written is no error.
void cacheDeviceErrors(const GpuInfo& gpu, const DeviceErrors& errors);

/// The file's text: {"schema", "device", "operations": {name: {"ulp", "absolute", "worstAt",
/// "arguments", "exhaustive"}}}.
std::string deviceErrorsJson(const GpuInfo& gpu, const DeviceErrors& errors);

/// The specification's rules with every measured operation's error in place of the specified one.
Rules deviceRules(const Rules& specification, const DeviceErrors& errors);

}  // namespace gnomon
