#include "harness/isolate/sweep.h"

#include <cstdlib>

#include <fmt/format.h>

namespace gnomon {
namespace {

constexpr const char* kWidthVariable = "LP_NATIVE_VECTOR_WIDTH";
constexpr unsigned kBitsPerLane = 32;
constexpr unsigned kMisreported = 1024;

}  // namespace

std::vector<unsigned> otherWidths(const GpuInfo& gpu) {
  if (!gpu.driver.starts_with("llvmpipe") || std::getenv(kWidthVariable) != nullptr) return {};
  std::vector<unsigned> widths = {128, 256, 512, 1024};
  std::erase(widths, gpu.subgroupSize * kBitsPerLane);
  return widths;
}

std::map<std::string, std::string> environmentFor(unsigned width) {
  return {{kWidthVariable, std::to_string(width)}};
}

unsigned lanesOf(unsigned width) { return width / kBitsPerLane; }

bool dependsOnWidth(const CaseRecord& record, unsigned width) {
  return record.threadsCommunicate && !record.unsupported &&
         !(width == kMisreported && record.usesSubgroups);
}

void addFailures(CaseRecord& record, unsigned width, const CaseRecord& there) {
  for (const std::string& message : there.messages) {
    record.failed = true;
    record.messages.push_back(fmt::format("in subgroups of {} ({}={}):\n{}", lanesOf(width),
                                          kWidthVariable, width, message));
  }
}

}  // namespace gnomon
