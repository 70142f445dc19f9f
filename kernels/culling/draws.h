// Host side of culling: how a list is drawn.
#pragma once

#include <variant>

#include "harness/vulkan/draw.h"

namespace gnomon::culling {

using ListCalls = decltype(Draw::calls);

/// As many draws of the list as its tally says, where the device can read a count from a buffer;
/// else all `capacity` of them: what is behind the list has to be zero then, which draws nothing.
ListCalls callsOf(const GpuInfo& device, const GpuBuffer& draws, const GpuBuffer& tally,
                  unsigned capacity);

/// The two by themselves.
DrawIndirectCount countedCalls(const GpuBuffer& draws, const GpuBuffer& tally, unsigned capacity);
DrawIndirect allCalls(const GpuBuffer& draws, unsigned capacity);

}  // namespace gnomon::culling
