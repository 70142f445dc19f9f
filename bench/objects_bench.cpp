// Culling over worlds of 100 to 1,000,000 objects: every entry by itself, on what the one before it
// has left, and the CPU's modes on the same worlds. Counters: what is drawn before and after.
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "bench/culling_case.h"
#include "bench/objects.h"

namespace gnomon {
namespace culling {
namespace {

/// What the kernel does: a list of draws, here of those that the mode finds.
void onCpu(benchmark::State& state, const Case& c, CullMode mode) {
  std::vector<DrawCommand> draws;
  timeCpu(state, c.objects, [&] {
    draws.clear();
    for (const std::uint32_t i : c.tree->cull(mode, c.world.query())) {
      draws.push_back(c.world.commands[i]);
      draws.back().firstInstance = i;
    }
  });
  countDraws(state, c.objects, draws.size());
  if (mode == CullMode::kBvh) state.counters["build_seconds"] = c.buildSeconds;
}

struct Entry {
  const char* name;
  std::function<void(benchmark::State&, const Case&)> run;
};

std::vector<Entry> entries() {
  const auto cpu = [](CullMode mode) {
    return [mode](benchmark::State& state, const Case& c) { onCpu(state, c, mode); };
  };
  const auto gpu = [](auto timer, const char* kernel) {
    return [=](benchmark::State& state, const Case& c) { timer(state, kernel, c); };
  };
  return {
      {"cpu_none", cpu(CullMode::kNone)},   {"cpu_frustum", cpu(CullMode::kFrustum)},
      {"cpu_bvh", cpu(CullMode::kBvh)},     {"frustum", gpu(timeFrustum, "culling/frustum")},
      {"hiz", gpu(timeHiz, "culling/hiz")}, {"occlusion", gpu(timeOcclusion, "culling/occlusion")}};
}

}  // namespace
}  // namespace culling

void registerObjects(std::size_t most, std::uint64_t seed) {
  using namespace culling;
  constexpr int kFirstHalfDecade = 4;  // 100
  for (const WorldKind kind : {WorldKind::kCity, WorldKind::kField})
    for (int half = kFirstHalfDecade;; ++half) {
      const auto n = static_cast<std::size_t>(std::lround(std::pow(10, half / 2.0)));
      if (n > most) break;
      for (const Entry& entry : entries())
        timed(benchmark::RegisterBenchmark(
            fmt::format("objects/{}/{}/{}", nameOf(kind), entry.name, n).c_str(),
            [=](benchmark::State& state) { entry.run(state, caseOf(kind, n, seed)); }));
    }
}

}  // namespace gnomon
