// Culling one world: what each entry is given, and what it leaves to the next one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/timing.h"
#include "tests/culling/worlds.h"

namespace gnomon::culling {

/// A world before a screen of 1920 x 1080, and what is left after each entry.
struct Case {
  Case(WorldKind kind, std::size_t objects, std::uint64_t seed);

  WorldKind kind;
  std::size_t objects;
  std::uint64_t seed;
  World world;
  std::unique_ptr<SphereTree> tree{};
  double buildSeconds = 0;               ///< of the tree
  std::vector<DrawCommand> survivors{};  ///< of the frustum
  std::vector<float> depth{};
  std::vector<float> mips{};  ///< of its pyramid, levels from 1 on
};

/// Kept until another one is asked for: casting its depth takes longer than what is timed.
const Case& caseOf(WorldKind kind, std::size_t objects, std::uint64_t seed);

/// Time one of culling/frustum and culling/frustum_subgroups, or of culling/occlusion and
/// culling/occlusion_subgroups, on what the frustum leaves.
void timeFrustum(benchmark::State& state, const std::string& kernel, const Case& c);
void timeOcclusion(benchmark::State& state, const std::string& kernel, const Case& c);

/// culling/hiz on the depth buffer.
void timeHiz(benchmark::State& state, const std::string& kernel, const Case& c);

/// The same with every object a candidate, whatever the frustum says of it.
void timeOcclusionOfAll(benchmark::State& state, const std::string& kernel, const Case& c);

/// Counters draws_before, draws_after, survivors (the same, by its usual name) and the share that
/// is culled.
void countDraws(benchmark::State& state, std::size_t before, std::size_t after);

}  // namespace gnomon::culling
