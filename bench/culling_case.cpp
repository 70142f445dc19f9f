#include "bench/culling_case.h"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "tests/culling/lists.h"

namespace gnomon::culling {
namespace {

constexpr uvec2 kScreen{1920, 1080};

ImageDescription depthOfScreen() {
  return {.format = PixelFormat::kD32, .width = kScreen.x, .height = kScreen.y};
}

/// Its levels from 1 on.
ImageDescription pyramidOfScreen() {
  return {.format = PixelFormat::kR32f,
          .width = kScreen.x / 2,
          .height = kScreen.y / 2,
          .mips = fullMipCount(kScreen.x / 2, kScreen.y / 2)};
}

template <class T>
std::span<const std::byte> bytesOf(const T& object) {
  return std::as_bytes(std::span(&object, 1));
}

/// As the kernel has tallied it; nothing where it was skipped.
void countTally(benchmark::State& state, std::size_t before, const Written& written) {
  const auto found = written.find("tally");
  if (found == written.end()) return;
  Tally tally{};
  std::memcpy(&tally, found->second.data(), sizeof tally);
  countDraws(state, before, tally.total);
}

std::size_t scratchOf(std::size_t candidates) {
  return kBlocks + std::max<std::size_t>((candidates + kBlock - 1) / kBlock, 1);
}

void timeCandidates(benchmark::State& state, const std::string& kernel, const Case& c,
                    std::span<const DrawCommand> draws) {
  const std::size_t candidates = draws.size();
  const auto n = static_cast<uint>(candidates);
  const Occlusion push{.size = kScreen,
                       .objects = static_cast<uint>(c.objects),
                       .candidates = n,
                       .capacity = n,
                       .pad = c.world.pad,
                       .patience = kPatience};
  const Tally found{
      .tested = push.objects, .total = n, .listed = n, .overflowed = 0, .recounted = 0};
  // The draw and the sphere of every candidate; texels, and what is written, are not known before.
  const std::size_t bytes = sizeof(Camera) + candidates * (sizeof(DrawCommand) + sizeof(Bounds));
  countTally(
      state, candidates,
      timeKernel(state, kernel,
                 {.inputs = {{"camera", bytesOf(c.world.camera)},
                             {"bounds", std::as_bytes(std::span(c.world.bounds))},
                             {"survivors", std::as_bytes(draws)},
                             {"found", bytesOf(found)}},
                  .outputs = {{"draws", candidates, /*list=*/true}, {"tally", 1}},
                  .scratch = {{"scratch", scratchOf(candidates)}},
                  .inputImages = {{"depth", depthOfScreen(), std::as_bytes(std::span(c.depth))},
                                  {"pyramid", pyramidOfScreen(), std::as_bytes(std::span(c.mips))}},
                  .push = bytesOf(push),
                  .extent = {candidates}},
                 bytes));
}

}  // namespace

Case::Case(WorldKind k, std::size_t n, std::uint64_t s)
    : kind(k), objects(n), seed(s), world(culling::world(k, n, s)) {
  const auto begin = std::chrono::steady_clock::now();
  tree = std::make_unique<SphereTree>(world.bounds);
  buildSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const std::uint32_t i : tree->cull(CullMode::kBvh, world.query()))
    survivors.push_back(world.commands[i]);
  const Pyramid pyramid = pyramidOf(depthOf(world, kScreen));
  depth = pyramid.levels[0];
  for (std::size_t level = 1; level < pyramid.levels.size(); ++level)
    mips.insert(mips.end(), pyramid.levels[level].begin(), pyramid.levels[level].end());
}

const Case& caseOf(WorldKind kind, std::size_t objects, std::uint64_t seed) {
  static std::unique_ptr<Case> kept;
  if (!kept || kept->kind != kind || kept->objects != objects || kept->seed != seed)
    kept = std::make_unique<Case>(kind, objects, seed);
  return *kept;
}

void countDraws(benchmark::State& state, std::size_t before, std::size_t after) {
  const auto counter = [&](const char* name, double value) { state.counters[name] = value; };
  counter("draws_before", static_cast<double>(before));
  counter("draws_after", static_cast<double>(after));
  counter("survivors", static_cast<double>(after));
  counter("culled", before == 0 ? 0 : 1 - static_cast<double>(after) / static_cast<double>(before));
}

void timeFrustum(benchmark::State& state, const std::string& kernel, const Case& c) {
  const auto n = static_cast<uint>(c.objects);
  const Frustum push{
      .count = n, .capacity = n, .noNearPlane = 0, .pad = c.world.pad, .patience = kPatience};
  // Every sphere, and the draw of each survivor from one list to the other.
  const std::size_t bytes =
      sizeof(Camera) + c.objects * sizeof(Bounds) + 2 * c.survivors.size() * sizeof(DrawCommand);
  countTally(state, c.objects,
             timeKernel(state, kernel,
                        {.inputs = {{"camera", bytesOf(c.world.camera)},
                                    {"bounds", std::as_bytes(std::span(c.world.bounds))},
                                    {"commands", std::as_bytes(std::span(c.world.commands))}},
                         .outputs = {{"draws", c.objects, /*list=*/true}, {"tally", 1}},
                         .scratch = {{"scratch", scratchOf(c.objects)}},
                         .push = bytesOf(push),
                         .extent = {c.objects}},
                        bytes));
}

void timeHiz(benchmark::State& state, const std::string& kernel, const Case& c) {
  const Hiz push{.size = kScreen};
  const ImageDescription pyramid = pyramidOfScreen();
  const std::size_t tiles = std::size_t{kScreen.x >> kHizTile} * (kScreen.y >> kHizTile);
  timeKernel(state, kernel,
             {.scratch = {{"scratch", 1 + tiles}},
              .inputImages = {{"depth", depthOfScreen(), std::as_bytes(std::span(c.depth))}},
              .outputImages = {{.image = "levels",
                                .width = pyramid.width,
                                .height = pyramid.height,
                                .mips = pyramid.mips}},
              .push = bytesOf(push),
              .extent = {kScreen.x, kScreen.y}});
}

void timeOcclusion(benchmark::State& state, const std::string& kernel, const Case& c) {
  timeCandidates(state, kernel, c, c.survivors);
}

void timeOcclusionOfAll(benchmark::State& state, const std::string& kernel, const Case& c) {
  timeCandidates(state, kernel, c, c.world.commands);
}

}  // namespace gnomon::culling
