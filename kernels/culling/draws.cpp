#include "kernels/culling/draws.h"

#include <cstddef>

#include "kernels/culling/culling.h"

namespace gnomon::culling {

static_assert(sizeof(DrawCommand) == sizeof(DrawIndexed));

DrawIndirectCount countedCalls(const GpuBuffer& draws, const GpuBuffer& tally, unsigned capacity) {
  return {.buffer = &draws,
          .counter = &tally,
          .counterOffset = offsetof(Tally, listed),
          .most = capacity};
}

DrawIndirect allCalls(const GpuBuffer& draws, unsigned capacity) {
  return {.buffer = &draws, .count = capacity};
}

ListCalls callsOf(const GpuInfo& device, const GpuBuffer& draws, const GpuBuffer& tally,
                  unsigned capacity) {
  const auto feature = device.features.find("drawIndirectCount");
  if (feature != device.features.end() && feature->second)
    return countedCalls(draws, tally, capacity);
  return allCalls(draws, capacity);
}

}  // namespace gnomon::culling
