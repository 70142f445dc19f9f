// Hygiene finds the barrier that is missing and the traffic between groups that a driver hides by
// the order in which it runs things, leaves right kernels alone, and knows whose threads
// communicate.
// Not covered: other sizes of subgroups (tests/command/sweep_test.cpp).
#include "harness/hygiene/observe.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/program/order.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

const char* const kHead = R"(#version 450
#extension GL_EXT_scalar_block_layout : require
)";

const char* const kOrderFinding =
    "with the order of its groups and of the subgroups in a group turned round";

bool finds(const Observation& seen, std::string_view words) {
  return std::ranges::any_of(seen.findings, [&](const std::string& finding) {
    return finding.find(words) != std::string::npos;
  });
}

std::string all(const Observation& seen) {
  return fmt::format("findings: {}", fmt::join(seen.findings, "\n"));
}

/// How many elements differ: whole outputs would drown a message.
template <class T>
std::size_t differing(const Bytes& bytes, const std::vector<T>& expected) {
  if (bytes.size() != expected.size() * sizeof(T)) return ~std::size_t{0};
  std::size_t count = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    count += std::memcmp(bytes.data() + i * sizeof(T), &expected[i], sizeof(T)) != 0;
  return count;
}

class Communication : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }

  static bool startsWithFirst() { return gpu->info().name.starts_with("llvmpipe"); }

  static inline std::unique_ptr<Gpu> gpu;
};

// ---- a missing barrier ----------------------------------------------------------------------

struct Pixel {
  uint value;
};
struct Range {
  uint least, largest;
};

constexpr unsigned kWidth = 128, kTile = 16;

// Each pixel gets the least and the largest value of its tile; the barrier that keeps the others
// from being overwritten by the start value is left out on demand.
const char* const kMinMax = R"(
layout(local_size_x = 16, local_size_y = 16) in;
struct Pixel { uint value; };
struct Range { uint least, largest; };
layout(set = 0, binding = 0, scalar) readonly buffer Pixels { Pixel pixels[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Ranges { Range ranges[]; };
shared uint least, largest;
void main() {
  uint at = gl_GlobalInvocationID.y * 128 + gl_GlobalInvocationID.x;
  if (gl_LocalInvocationIndex == 0) { least = ~0u; largest = 0u; }
  FIRST_BARRIER
  atomicMin(least, pixels[at].value);
  atomicMax(largest, pixels[at].value);
  barrier();
  ranges[at] = Range(least, largest);
})";

SpirvWords minMax(const std::string& firstBarrier) {
  return compileText(fmt::format("{}#define FIRST_BARRIER {}\n{}", kHead, firstBarrier, kMinMax));
}

KernelRecord minMaxRecord() {
  return {.stage = "test",
          .entry = "minmax",
          .buffers = {{"pixels", 0, Access::kRead,
                       describe<Pixel>("Pixel", field("value", &Pixel::value))},
                      {"ranges", 1, Access::kWrite,
                       describe<Range>("Range", field("least", &Range::least),
                                       field("largest", &Range::largest))}},
          .push = {},
          .features = {"scalarBlockLayout"}};
}

std::vector<Pixel> noise() {
  std::vector<Pixel> pixels(std::size_t{kWidth} * kWidth);
  std::uint32_t state = 1;
  for (Pixel& p : pixels) p.value = state = state * 1664525u + 1013904223u;
  return pixels;
}

std::vector<Range> rangesOf(const std::vector<Pixel>& pixels) {
  std::map<std::size_t, Range> tiles;
  const auto tileOf = [](std::size_t i) {
    return i / kWidth / kTile * kWidth + i % kWidth / kTile;
  };
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    Range& tile = tiles.try_emplace(tileOf(i), Range{~0u, 0u}).first->second;
    tile = {std::min(tile.least, pixels[i].value), std::max(tile.largest, pixels[i].value)};
  }
  std::vector<Range> ranges;
  for (std::size_t i = 0; i < pixels.size(); ++i) ranges.push_back(tiles[tileOf(i)]);
  return ranges;
}

Observation observeMinMax(Gpu& gpu, const KernelRecord& record, const std::string& firstBarrier,
                          Watch watch = Watch::kAll) {
  const Subject subject(gpu, record, {.words = minMax(firstBarrier), .origin = "minmax.comp"});
  const std::vector<Pixel> pixels = noise();
  return observe(subject,
                 {.inputs = {{"pixels", std::as_bytes(std::span(pixels))}},
                  .outputs = {{"ranges", pixels.size()}},
                  .extent = {kWidth, kWidth}},
                 watch);
}

TEST_F(Communication, ARightKernelWithSharedMemoryIsClean) {
  const Observation seen = observeMinMax(*gpu, minMaxRecord(), "barrier();");
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  EXPECT_EQ(differing(seen.plain.at("ranges"), rangesOf(noise())), 0u);
  EXPECT_EQ(differing(seen.twin.at("ranges"), rangesOf(noise())), 0u);
}

TEST_F(Communication, AMissingBarrierThatTheOrderOfSubgroupsHidesIsFound) {
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  const Observation seen = observeMinMax(*gpu, minMaxRecord(), "");
  EXPECT_EQ(differing(seen.plain.at("ranges"), rangesOf(noise())), 0u) << "nothing hides it";
  EXPECT_EQ(differing(seen.twin.at("ranges"), rangesOf(noise())), 0u) << "nothing hides it";
  ASSERT_EQ(seen.findings.size(), 1u) << all(seen);
  EXPECT_TRUE(finds(seen, kOrderFinding)) << all(seen);
  EXPECT_TRUE(finds(seen, "of 32768 words of 'ranges' differ, first ranges[")) << all(seen);
  EXPECT_TRUE(finds(seen, "a barrier is missing")) << all(seen);
}

TEST_F(Communication, TheTwinsAloneFindItToo) {
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  const Observation seen = observeMinMax(*gpu, minMaxRecord(), "", Watch::kTwins);
  EXPECT_TRUE(finds(seen, kOrderFinding)) << all(seen);
  EXPECT_EQ(seen.plain, seen.twin);
}

TEST_F(Communication, NothingIsTurnedRoundWhereItIsNotWatched) {
  for (const Watch watch : {Watch::kInOrder, Watch::kTwinAlone}) {
    const Observation seen = observeMinMax(*gpu, minMaxRecord(), "", watch);
    EXPECT_TRUE(seen.findings.empty()) << all(seen);
  }
}

TEST_F(Communication, AContractThatIsNotDeterministicMayDependOnTheOrder) {
  KernelRecord record = minMaxRecord();
  record.deterministic = false;
  const Observation seen = observeMinMax(*gpu, record, "");
  EXPECT_FALSE(finds(seen, kOrderFinding)) << all(seen);
}

// ---- traffic between groups -----------------------------------------------------------------

struct Cell {
  uint value, before;
};

const char* const kCells = R"(
layout(local_size_x = 1) in;
struct Cell { uint value, before; };
layout(set = 0, binding = 0, scalar) buffer Cells { Cell cells[]; };
void main() {
  uint g = gl_WorkGroupID.x;
)";

constexpr std::uint32_t kGroups = 4096;  // many more than lavapipe has threads

Observation observeCells(Gpu& gpu, const std::string& body) {
  const KernelRecord record = {.stage = "test",
                               .entry = "cells",
                               .buffers = {{"cells", 0, Access::kWrite,
                                            describe<Cell>("Cell", field("value", &Cell::value),
                                                           field("before", &Cell::before))}},
                               .push = {},
                               .features = {"scalarBlockLayout"}};
  const Subject subject(
      gpu, record,
      {.words = compileText(fmt::format("{}{}{}}}", kHead, kCells, body)), .origin = "cells.comp"});
  return observe(subject, {.outputs = {{"cells", kGroups}}, .extent = {kGroups}});
}

TEST_F(Communication, TrafficBetweenGroupsIsFound) {
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  const Observation seen = observeCells(*gpu, R"(
    cells[g].before = g == 0 ? 0 : cells[g - 1].value;
    cells[g].value = g + 1;)");
  EXPECT_TRUE(finds(seen, kOrderFinding)) << all(seen);
  EXPECT_TRUE(finds(seen, "its groups race")) << all(seen);
}

TEST_F(Communication, AGroupThatReadsWhatItWroteItselfIsClean) {
  const Observation seen = observeCells(*gpu, R"(
    cells[g].value = g + 1;
    cells[g].before = cells[g].value - 1;)");
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
}

// ---- whose threads communicate --------------------------------------------------------------

struct Number {
  float x;
};

/// A map of numbers to numbers, whose output has these qualifiers.
SpirvWords mapKernel(const char* qualifiers, const std::string& extension, const char* body,
                     const char* globals = "") {
  return compileText(fmt::format(R"(#version 450
#extension GL_EXT_scalar_block_layout : require
{}
layout(local_size_x = 64) in;
struct Number {{ float x; }};
layout(set = 0, binding = 0, scalar) readonly buffer Values {{ Number values[]; }};
layout(set = 0, binding = 1, scalar) {} buffer Results {{ Number results[]; }};
{}
void main() {{
  uint i = gl_GlobalInvocationID.x, t = gl_LocalInvocationIndex;
  {}
}})",
                                 extension, qualifiers, globals, body));
}

bool communicate(Gpu& gpu, const SpirvWords& module) {
  const Struct number = describe<Number>("Number", field("x", &Number::x));
  const KernelRecord record = {
      .stage = "test",
      .entry = "map",
      .buffers = {{"values", 0, Access::kRead, number}, {"results", 1, Access::kWrite, number}},
      .push = {},
      .features = {"scalarBlockLayout"}};
  const Subject subject(gpu, record, {.words = module, .origin = "map.comp"});
  if (subject.threadsCommunicate())
    EXPECT_NO_THROW(subject.orderTwin());
  else
    EXPECT_THROW(subject.orderTwin(), std::logic_error);
  return subject.threadsCommunicate();
}

const char* const kMap = "results[i].x = 2 * values[i].x;";

TEST_F(Communication, ThreadsOfAPlainMapDoNot) {
  EXPECT_FALSE(communicate(*gpu, mapKernel("writeonly", "", kMap)));
}

TEST_F(Communication, ThreadsThatShareMemoryDo) {
  EXPECT_TRUE(communicate(*gpu, mapKernel("writeonly", "",
                                          "told[t] = values[i].x; barrier();"
                                          "results[i].x = told[63 - t];",
                                          "shared float told[64];")));
}

TEST_F(Communication, ThreadsWithSubgroupOperationsDo) {
  struct Use {
    const char *extension, *feature, *body;
  };
  for (const auto& [extension, feature, body] :
       {Use{"basic", "subgroupBasic", "results[i].x = float(gl_SubgroupInvocationID);"},
        Use{"ballot", "subgroupBallot", "results[i].x = subgroupBroadcastFirst(values[i].x);"},
        Use{"arithmetic", "subgroupArithmetic", "results[i].x = subgroupAdd(values[i].x);"}}) {
    if (!gpu->info().features.at(feature)) continue;
    const std::string use =
        fmt::format("#extension GL_KHR_shader_subgroup_{} : require\n", extension);
    EXPECT_TRUE(communicate(*gpu, mapKernel("writeonly", use, body))) << extension;
  }
}

TEST_F(Communication, ThreadsWithStorageThatIsReadAndWrittenDo) {
  EXPECT_TRUE(communicate(*gpu, mapKernel("", "", kMap)));
}

// By the instructions alone, for in a whole kernel the interface tells too.
TEST_F(Communication, ThreadsWithAtomicsDo) {
  const auto module = [](const std::string& body) {
    return compileText(fmt::format(R"(#version 450
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) buffer Counts {{ uint counts[]; }};
void main() {{ {} }})",
                                   body));
  };
  EXPECT_FALSE(threadsCommunicate(module("counts[gl_GlobalInvocationID.x] = 1;")));
  for (const char* operation : {"atomicAdd", "atomicMin", "atomicOr", "atomicExchange"})
    EXPECT_TRUE(threadsCommunicate(module(fmt::format("{}(counts[0], 1u);", operation))))
        << operation;
  EXPECT_TRUE(threadsCommunicate(module("atomicCompSwap(counts[0], 0u, 1u);")));
}

}  // namespace
}  // namespace gnomon
