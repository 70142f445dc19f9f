#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/program/kernel.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"
#include "harness/vulkan/gpu.h"

namespace gnomon {
namespace {

std::string text(const GpuInfo& gpu) {
  std::string lines =
      fmt::format("{}  {}\n   {}, Vulkan {}, subgroup {}{}\n", gpu.index, gpu.name, gpu.driver,
                  gpu.api, gpu.subgroupSize, gpu.software ? ", software" : "");
  lines += fmt::format("   float32: round to nearest even {}, signed zero, Inf and NaN kept {}\n",
                       gpu.roundingRteFloat32 ? "yes" : "no",
                       gpu.signedZeroInfNanFloat32 ? "yes" : "no");
  std::size_t lacking = 0;
  for (const KernelRecord* kernel : catalogue())
    if (const auto why = gpu.lacks(kernel->features)) {
      lines += fmt::format("   cannot run {}: {}\n", kernel->name(), *why);
      ++lacking;
    }
  if (lacking == 0) lines += "   runs every stage\n";
  return lines;
}

nlohmann::json json(const GpuInfo& gpu) {
  auto cannot = nlohmann::json::object();
  for (const KernelRecord* kernel : catalogue())
    if (const auto why = gpu.lacks(kernel->features)) cannot[kernel->name()] = *why;
  return {{"index", gpu.index},       {"name", gpu.name},
          {"driver", gpu.driver},     {"api", gpu.api},
          {"software", gpu.software}, {"subgroupSize", gpu.subgroupSize},
          {"features", gpu.features}, {"unsupported", cannot}};
}

}  // namespace

int devices(const DevicesOptions& options) {
  const std::vector<GpuInfo> all = listGpus();
  if (all.empty())
    throw DeviceError(
        "no Vulkan device on this machine.\nA software device comes with Debian's package "
        "mesa-vulkan-drivers");
  if (options.json != "-")
    for (const GpuInfo& gpu : all) fmt::print("{}", text(gpu));
  if (!options.json.empty()) {
    auto list = nlohmann::json::array();
    for (const GpuInfo& gpu : all) list.push_back(json(gpu));
    writeText(options.json, nlohmann::json{{"schema", 1}, {"devices", list}}.dump(1) + "\n");
  }
  return kGood;
}

}  // namespace gnomon
