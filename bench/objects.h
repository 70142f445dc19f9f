// How culling scales with the number of objects.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gnomon {

/// The largest number of objects: what the contract's kernels are meant for.
inline constexpr std::size_t kMostObjects = 1'000'000;

/// Registers objects/WORLD/ENTRY/N for every world of tests/culling/worlds.h, what the CPU does
/// (cpu_none, cpu_frustum, cpu_bvh) and every entry of stage culling, and N = 100, 316, 1,000, ...
/// up to `most`. The seed makes the worlds.
void registerObjects(std::size_t most, std::uint64_t seed);

}  // namespace gnomon
