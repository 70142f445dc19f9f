// What a draw leaves in its targets: coverage, reversed depth, comparisons, bias, culling, exact
// ids, layers and mip levels, constants, and what a dispatch then reads of it. Every test also
// fails for a validation message.
// Not covered: centres on an edge (the tie-breaking rule), clipping, perspective, devices that have
// less than lavapipe but for what draw_calls_test.cpp takes away.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "tests/harness/drawing.h"

namespace gnomon {
namespace {

using Kind = BindingSlot::Kind;
using Description = DrawProgramDescription;
using Position = std::array<float, 4>;

constexpr BindingSlot kPositions{0, 0};
constexpr unsigned kSide = 16;  // of the targets; a power of two, so that clip space is exact

const char* const kVertex = R"(#version 450
layout(set = 0, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(push_constant) uniform Push { uint id; };
layout(location = 0) flat out uint passed;
void main() {
  gl_Position = positions[gl_VertexIndex];
  passed = id;
})";

const char* const kFragment = R"(#version 450
layout(location = 0) flat in uint passed;
layout(location = 0) out uint id;
void main() { id = passed; })";

/// Writes the pushed id where it is drawn.
Description idProgram() {
  Description description;
  description.vertex = compileText(kVertex, ".vert");
  description.fragment = compileText(kFragment, ".frag");
  description.slots = {kPositions};
  description.pushBytes = 4;
  description.colours = {PixelFormat::kR32ui};
  return description;
}

Description depthProgram() {
  Description description = idProgram();
  description.depth = true;
  return description;
}

/// A corner in pixels, from the top left one, at this depth.
Position corner(double x, double y, float depth = 0.5f) {
  return {static_cast<float>(x / kSide * 2 - 1), static_cast<float>(y / kSide * 2 - 1), depth, 1};
}

/// One triangle over all of the target, counter-clockwise.
std::vector<Position> everywhere(float depth) {
  return {corner(0, 0, depth), corner(0, 2 * kSide, depth), corner(2 * kSide, 0, depth)};
}

/// Targets of ids and depths, and draws to them of one triangle each.
class DrawTest : public DrawingTest {
 protected:
  void SetUp() override {
    ids = gpu->allocateImage({.format = PixelFormat::kR32ui, .width = kSide, .height = kSide});
    depths = gpu->allocateImage({.format = PixelFormat::kD32, .width = kSide, .height = kSide});
    indices = uploaded<std::uint32_t>(*gpu, {0, 1, 2});
  }

  Draw untargeted(const GpuDrawProgram& program, const GpuBuffer& positions, std::uint32_t id) {
    Draw draw;
    draw.program = &program;
    draw.buffers = {{kPositions, &positions}};
    draw.push = pushed(id);
    draw.indices = &indices;
    draw.calls = std::vector{DrawIndexed{.indexCount = 3}};
    return draw;
  }

  void draw(const GpuDrawProgram& program, const std::vector<Position>& triangle, std::uint32_t id,
            bool clear, bool withDepth = true) {
    const GpuBuffer positions = uploaded(*gpu, triangle);
    Draw draw = untargeted(program, positions, id);
    draw.colours = {{.image = &ids, .clear = clear}};
    if (withDepth) draw.depth = {.image = &depths, .clear = clear};
    run(*gpu, draw);
  }

  Words idPixels() { return pixelsOf<std::uint32_t>(*gpu, ids); }
  std::vector<float> depthPixels() { return pixelsOf<float>(*gpu, depths); }

  GpuImage ids;
  GpuImage depths;
  GpuBuffer indices;
};

const Words kNothing(kSide* kSide, 0);
const Words kAllOne(kSide* kSide, 1);
const Words kAllTwo(kSide* kSide, 2);

TEST_F(DrawTest, ATriangleCoversExactlyThePixelsWhoseCentresItContains) {
  // Multiples of a quarter of a pixel: every device has 4 bits below the pixel at least.
  using Point = std::array<double, 2>;
  const Point corners[] = {{1.25, 1.25}, {4.25, 13.75}, {14.75, 2.5}};
  const GpuDrawProgram program = gpu->build(idProgram());
  std::vector<Position> triangle;
  for (const auto& [x, y] : corners) triangle.push_back(corner(x, y));
  draw(program, triangle, 1, true, false);

  Words expected;
  for (unsigned i = 0; i < kSide * kSide; ++i) {
    const Point centre{i % kSide + 0.5, i / kSide + 0.5};
    double least = 1e9;  // twice the signed area that an edge and the centre span
    for (std::size_t k = 0; k < 3; ++k) {
      const Point &a = corners[k], &b = corners[(k + 1) % 3];
      const double area = (b[1] - a[1]) * (centre[0] - a[0]) - (b[0] - a[0]) * (centre[1] - a[1]);
      ASSERT_NE(area, 0) << "a centre on an edge";
      least = std::min(least, area);
    }
    expected.push_back(least > 0 ? 1 : 0);
  }
  ASSERT_GT(std::ranges::count(expected, 1u), 20);
  EXPECT_EQ(idPixels(), expected);
}

TEST_F(DrawTest, TheNearestSurfaceStaysWhicheverIsDrawnFirst) {
  const GpuDrawProgram program = gpu->build(depthProgram());
  for (const bool nearFirst : {false, true}) {
    draw(program, everywhere(nearFirst ? 0.75f : 0.25f), nearFirst ? 2 : 1, true);
    draw(program, everywhere(nearFirst ? 0.25f : 0.75f), nearFirst ? 1 : 2, false);
    EXPECT_EQ(idPixels(), kAllTwo) << nearFirst;
    EXPECT_EQ(depthPixels(), std::vector<float>(kSide * kSide, 0.75f)) << nearFirst;
  }
}

TEST_F(DrawTest, DepthIsClearedToTheFarthestWhichStillPasses) {
  const GpuDrawProgram program = gpu->build(depthProgram());
  gpu->fillImage(depths, std::bit_cast<std::array<std::byte, 16>>(std::array{1.f, 1.f, 1.f, 1.f}));
  draw(program, everywhere(0), 1, true);
  EXPECT_EQ(idPixels(), kAllOne);
  EXPECT_EQ(depthPixels(), std::vector<float>(kSide * kSide, 0.0f));
}

TEST_F(DrawTest, ComparisonsAndDepthWritesAreTheProgramsOwn) {
  struct Case {
    Description::Compare compare;
    float depth;  // drawn over 0.5
    bool passes;
  };
  using Compare = Description::Compare;
  const GpuDrawProgram first = gpu->build(depthProgram());
  for (const Case& c :
       {Case{Compare::kGreaterOrEqual, 0.5f, true}, Case{Compare::kGreaterOrEqual, 0.25f, false},
        Case{Compare::kEqual, 0.5f, true}, Case{Compare::kEqual, 0.75f, false},
        Case{Compare::kAlways, 0.25f, true}})
    for (const bool write : {false, true}) {
      Description description = depthProgram();
      description.compare = c.compare;
      description.depthWrite = write;
      const GpuDrawProgram second = gpu->build(description);
      draw(first, everywhere(0.5f), 1, true);
      draw(second, everywhere(c.depth), 2, false);
      EXPECT_EQ(idPixels(), c.passes ? kAllTwo : kAllOne) << c.depth;
      EXPECT_EQ(depthPixels()[0], c.passes && write ? c.depth : 0.5f) << c.depth;
    }
}

// Corners on pixels' corners, so no device snaps them elsewhere; the plane is x / 32 + y / 64 of
// the centre's pixels. In floats the slopes times the centre's distance are products and sums
// below 1 with fewer than 24 bits, so that arithmetic in any order errs by no more than a few
// halves of a ULP of 1: 8 * 2^-24.
TEST_F(DrawTest, DepthIsThatOfThePlaneAtEveryCentre) {
  const GpuDrawProgram program = gpu->build(depthProgram());
  draw(program, {corner(0, 0, 0), corner(0, 32, 0.5f), corner(32, 0, 1)}, 1, true);
  const std::vector<float> drawn = depthPixels();
  for (unsigned i = 0; i < drawn.size(); ++i) {
    const double expected = (i % kSide + 0.5) / 32 + (i / kSide + 0.5) / 64;
    ASSERT_NEAR(drawn[i], expected, std::ldexp(8, -24)) << "pixel " << i;
  }
}

// At 0.5 a float's least step is 2^-24; the specification counts it from the greatest exponent of
// the triangle's depths, and a slope from the greater of its two. Sloped by 1/64 a pixel.
TEST_F(DrawTest, BiasMovesDepthByStepsAndBySlope) {
  const auto biased = [&](float constant, float slope, const std::vector<Position>& triangle) {
    Description description = depthProgram();
    description.depthBiasConstant = constant;
    description.depthBiasSlope = slope;
    draw(gpu->build(description), triangle, 1, true);
    return depthPixels()[0];
  };
  const std::vector<Position> sloped{corner(0, 0, 0.25f), corner(0, 32, 0.25f),
                                     corner(32, 0, 0.75f)};
  EXPECT_EQ(biased(0, 0, everywhere(0.5f)), 0.5f);
  EXPECT_EQ(biased(16, 0, everywhere(0.5f)), 0.5f + std::ldexp(16.0f, -24));
  EXPECT_EQ(biased(0, 2, everywhere(0.5f)), 0.5f);
  EXPECT_EQ(biased(0, 2, sloped) - biased(0, 0, sloped), 2 / 64.0f);
}

TEST_F(DrawTest, CullingDropsFrontOrBackAndTheFrontIsCounterClockwise) {
  const std::vector<Position> front = everywhere(0.5f);
  const std::vector<Position> back{front[0], front[2], front[1]};
  struct Case {
    Description::Cull cull;
    bool frontStays, backStays;
  };
  using Cull = Description::Cull;
  for (const Case& c : {Case{Cull::kNone, true, true}, Case{Cull::kFront, false, true},
                        Case{Cull::kBack, true, false}}) {
    Description description = idProgram();
    description.cull = c.cull;
    const GpuDrawProgram program = gpu->build(description);
    draw(program, front, 1, true, false);
    EXPECT_EQ(idPixels(), c.frontStays ? kAllOne : kNothing);
    draw(program, back, 1, true, false);
    EXPECT_EQ(idPixels(), c.backStays ? kAllOne : kNothing);
  }
}

TEST_F(DrawTest, IdsArriveBitForBitAndSoDoesTheColourOfTheClear) {
  const GpuDrawProgram program = gpu->build(idProgram());
  const GpuBuffer positions = uploaded(
      *gpu, std::vector{corner(0, 0), corner(0, kSide), corner(1, 0)});  // some of the first column
  for (const std::uint32_t id : {0xffffffffu, 0x80000001u, 0x01000001u}) {
    Draw draw = untargeted(program, positions, id);
    draw.colours = {{.image = &ids, .id = ~id}};
    run(*gpu, draw);
    const Words pixels = idPixels();
    EXPECT_EQ(pixels.front(), id);
    EXPECT_EQ(pixels.back(), ~id);
  }
}

TEST_F(DrawTest, DepthAloneIsDrawnWithoutAFragmentStage) {
  Description description = depthProgram();
  description.fragment.clear();
  description.colours.clear();
  const GpuDrawProgram program = gpu->build(description);
  const GpuBuffer positions = uploaded(*gpu, everywhere(0.25f));
  Draw draw = untargeted(program, positions, 0);
  draw.depth = {.image = &depths};
  run(*gpu, draw);
  EXPECT_EQ(depthPixels(), std::vector<float>(kSide * kSide, 0.25f));
}

TEST_F(DrawTest, FourTargetsOfSeveralFormatsAreDrawnAtOnce) {
  Description description;
  description.vertex = compileText(kVertex, ".vert");
  description.fragment = compileText(R"(#version 450
    layout(constant_id = 3) const float blue = 0;
    layout(location = 0) out vec4 a;
    layout(location = 1) out vec2 b;
    layout(location = 2) out float c;
    layout(location = 3) out uint d;
    void main() { a = vec4(0, 1, blue, 1); b = vec2(-2, 65504); c = 1e30; d = 7u; })",
                                     ".frag");
  description.slots = {kPositions};
  description.pushBytes = 4;
  description.specialization = {{3, std::bit_cast<std::uint32_t>(1.0f)}};
  description.colours = {PixelFormat::kRgba8, PixelFormat::kRg16f, PixelFormat::kR32f,
                         PixelFormat::kR32ui};
  const GpuDrawProgram program = gpu->build(description);
  const GpuBuffer positions = uploaded(*gpu, everywhere(0.5f));
  std::vector<GpuImage> images;
  for (const PixelFormat format : description.colours)
    images.push_back(gpu->allocateImage({.format = format}));
  Draw draw = untargeted(program, positions, 0);
  for (const GpuImage& image : images) draw.colours.push_back({.image = &image});
  run(*gpu, draw);
  EXPECT_EQ(pixelsOf<std::uint32_t>(*gpu, images[0])[0], 0xffffff00u);
  EXPECT_EQ(pixelsOf<std::uint32_t>(*gpu, images[1])[0], 0x7bffc000u);  // 65504 and -2 as halves
  EXPECT_EQ(pixelsOf<float>(*gpu, images[2])[0], 1e30f);
  EXPECT_EQ(pixelsOf<std::uint32_t>(*gpu, images[3])[0], 7u);
}

TEST_F(DrawTest, OneMipLevelOfOneLayerIsDrawnAndNoOther) {
  const GpuImage deep = gpu->allocateImage(
      {.format = PixelFormat::kR32ui, .width = 8, .height = 6, .layers = 3, .mips = 2});
  gpu->fillImage(deep, {});
  const GpuDrawProgram program = gpu->build(idProgram());
  const GpuBuffer positions = uploaded(*gpu, everywhere(0.5f));
  Draw draw = untargeted(program, positions, 9);
  draw.colours = {{.image = &deep, .layer = 2, .mip = 1}};
  run(*gpu, draw);
  for (unsigned layer = 0; layer < 3; ++layer)
    for (unsigned mip = 0; mip < 2; ++mip)
      EXPECT_EQ(pixelsOf<std::uint32_t>(*gpu, deep, layer, mip),
                Words(mip == 0 ? 48 : 12, layer == 2 && mip == 1 ? 9 : 0))
          << layer << ' ' << mip;
}

// In one submission: the dispatch must see what the draw before it left in both targets.
TEST_F(DrawTest, ADispatchReadsWhatWasDrawnJustBefore) {
  const BindingSlot out{0, 0};
  const BindingSlot id{0, 1, Kind::kSampledImage};
  const BindingSlot depth{0, 2, Kind::kSampledImage};
  ProgramDescription reading;
  reading.spirv = compileText(R"(#version 450
    #extension GL_EXT_samplerless_texture_functions : require
    layout(local_size_x = 1) in;
    layout(set = 0, binding = 0) writeonly buffer Out { uint values[]; };
    layout(set = 0, binding = 1) uniform utexture2D ids;
    layout(set = 0, binding = 2) uniform texture2D depths;
    void main() {
      values[0] = texelFetch(ids, ivec2(5, 5), 0).x;
      values[1] = floatBitsToUint(texelFetch(depths, ivec2(5, 5), 0).x);
    })");
  reading.slots = {out, id, depth};
  const GpuProgram reader = gpu->build(reading);
  const GpuDrawProgram program = gpu->build(depthProgram());
  const GpuBuffer positions = uploaded(*gpu, everywhere(0.625f));
  const GpuBuffer values = uploaded<std::uint32_t>(*gpu, {0, 0});
  Draw draw = untargeted(program, positions, 42);
  draw.colours = {{.image = &ids}};
  draw.depth = {.image = &depths};
  Dispatch dispatch;
  dispatch.program = &reader;
  dispatch.buffers = {{out, &values}};
  dispatch.images = {{id, &ids}, {depth, &depths}};
  const Work work[] = {&draw, &dispatch};
  EXPECT_EQ(gpu->run(work, kDrawLimit).size(), 2u);
  Words got(2);
  gpu->download(values, 0, std::as_writable_bytes(std::span(got)));
  EXPECT_EQ(got, (Words{42, std::bit_cast<std::uint32_t>(0.625f)}));
}

}  // namespace
}  // namespace gnomon
