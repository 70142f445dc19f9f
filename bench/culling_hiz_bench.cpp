// The pyramid of farthest depths of a frame: in one dispatch, and level by level, where a chain's
// time is the sum over its dispatches. Memory-bound on a GPU.
#include <functional>

#include <fmt/format.h>

#include "bench/timing.h"
#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

InputImage imageOf(const char* name, const uvec2& size, PixelFormat format,
                   const std::vector<float>& texels) {
  return {.image = name,
          .description = {.format = format, .width = size.x, .height = size.y},
          .texels = std::as_bytes(std::span(texels))};
}

void wholePyramid(benchmark::State& state, const uvec2& size) {
  const DepthBuffer depths = generatedDepths(size, 1);
  const Hiz push{size};
  const uvec2 tiles = levelSize(size, kHizTile), first = levelSize(size, 1);
  timeKernel(
      state, "culling/hiz",
      {.scratch = {{"scratch", 1 + std::size_t{tiles.x} * tiles.y}},
       .inputImages = {imageOf("depth", size, PixelFormat::kD32, depths.depths)},
       .outputImages =
           {{.image = "levels", .width = first.x, .height = first.y, .mips = levelCount(size)}},
       .push = std::as_bytes(std::span(&push, 1)),
       .extent = {size.x, size.y}});
}

// Depths of every level are as good as any.
void oneLevel(benchmark::State& state, const uvec2& size, uint level) {
  const uvec2 parent = levelSize(size, level - 1), made = levelSize(size, level);
  const DepthBuffer depths = generatedDepths(parent, level);
  const HizLevel push{parent};
  timeKernel(
      state, "culling/hiz_level",
      {.inputImages = {imageOf("parent", parent,
                               level == 1 ? PixelFormat::kD32 : PixelFormat::kR32f, depths.depths)},
       .outputImages = {{.image = "level", .width = made.x, .height = made.y}},
       .push = std::as_bytes(std::span(&push, 1)),
       .extent = {made.x, made.y}});
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& run) {
  timed(benchmark::RegisterBenchmark(name.c_str(), run));
}

const bool registered = [] {
  for (const uvec2 size : {uvec2(1920, 1080), uvec2(3840, 2160)}) {
    const std::string frame = fmt::format("{}x{}", size.x, size.y);
    add("culling/hiz/" + frame, [=](benchmark::State& state) { wholePyramid(state, size); });
    for (uint level = 1; level <= levelCount(size); ++level)
      add(fmt::format("culling/hiz_level/{}/{}", frame, level),
          [=](benchmark::State& state) { oneLevel(state, size, level); });
  }
  return true;
}();

}  // namespace
}  // namespace gnomon::culling
