#include "harness/isolate/sweep.h"

#include <cstdlib>

#include <fmt/format.h>

namespace gnomon {
namespace {

constexpr const char* kWidthVariable = "LP_NATIVE_VECTOR_WIDTH";
constexpr unsigned kBitsPerLane = 32;

}  // namespace

std::vector<unsigned> otherWidths(const GpuInfo& gpu) {
  if (!gpu.driver.starts_with("llvmpipe") || std::getenv(kWidthVariable) != nullptr) return {};
  std::vector<unsigned> widths = {128, 256, 512};
  std::erase(widths, gpu.subgroupSize * kBitsPerLane);
  return widths;
}

std::map<std::string, std::string> environmentFor(unsigned width) {
  if (width == 0) return {};
  return {{kWidthVariable, std::to_string(width)}};
}

unsigned lanesOf(unsigned width) { return width / kBitsPerLane; }

SessionOptions sessionAt(unsigned width, SessionOptions session) {
  if (width == 0) return session;
  session.watch = Watch::kTwins;
  session.shrinks = false;
  return session;
}

bool dependsOnWidth(const CaseRecord& record) {
  return record.threadsCommunicate && !record.unsupported;
}

void addFailures(CaseRecord& record, unsigned width, const CaseRecord& there) {
  for (const std::string& message : there.messages) {
    record.failed = true;
    record.messages.push_back(fmt::format("in subgroups of {} ({}={}):\n{}", lanesOf(width),
                                          kWidthVariable, width, message));
  }
}

}  // namespace gnomon
