// The three ways to say what is drawn (direct, indirect, indirect with a count on the device): all
// of a command's fields reach the vertex stage, the ways agree to the bit, a dispatch may write the
// commands, and what a device lacks or a draw gets wrong is said by name. Every test also fails for
// a validation message.
// Not covered: more draws than maxDrawIndirectCount, which is 2^32 - 1 on lavapipe.
#include <algorithm>
#include <bit>

#include "harness/error.h"
#include "tests/harness/drawing.h"

namespace gnomon {
namespace {

constexpr BindingSlot kPositions{0, 0};
constexpr unsigned kColumns = 8, kRows = 2;

// Instance i stands in column i and has the id i + 1.
const char* const kVertex = R"(#version 450
layout(set = 0, binding = 0) readonly buffer Positions { vec2 positions[]; };
layout(location = 0) flat out uint id;
void main() {
  vec2 pixel = positions[gl_VertexIndex] + vec2(gl_InstanceIndex, 0);
  gl_Position = vec4(pixel / vec2(8, 2) * 2 - 1, 0.5, 1);
  id = gl_InstanceIndex + 1;
})";

// The same of the draw's own number.
const char* const kDrawIdVertex = R"(#version 460
layout(set = 0, binding = 0) readonly buffer Positions { vec2 positions[]; };
layout(location = 0) flat out uint id;
void main() {
  vec2 pixel = positions[gl_VertexIndex] + vec2(gl_DrawID, 0);
  gl_Position = vec4(pixel / vec2(8, 2) * 2 - 1, 0.5, 1);
  id = gl_DrawID + 1;
})";

const char* const kFragment = R"(#version 450
layout(location = 0) flat in uint passed;
layout(location = 0) out uint id;
void main() { id = passed; })";

DrawProgramDescription describe(const char* vertex) {
  DrawProgramDescription description;
  description.vertex = compileText(vertex, ".vert");
  description.fragment = compileText(kFragment, ".frag");
  description.slots = {kPositions};
  description.colours = {PixelFormat::kR32ui};
  return description;
}

// A quad of a whole column, then one of its upper half; three indices of nothing before them.
const std::vector<float> kCorners{0, 0, 0, 2, 1, 0, 1, 2, 0, 0, 0, 1, 1, 0, 1, 1};
const Words kIndices{3, 3, 3, 0, 1, 2, 2, 1, 3};
constexpr DrawIndexed kWhole{.indexCount = 6, .firstIndex = 3, .firstInstance = 2};
constexpr DrawIndexed kNone{.indexCount = 6, .instanceCount = 0, .firstIndex = 3};
constexpr DrawIndexed kUpper{
    .indexCount = 6, .instanceCount = 2, .firstIndex = 3, .vertexOffset = 4, .firstInstance = 5};
const std::vector<DrawIndexed> kDraws{kWhole, kNone, kUpper};

const Words kEmpty(kColumns* kRows, 0);
const Words kWholeDrawn{0, 0, 3, 0, 0, 0, 0, 0,  //
                        0, 0, 3, 0, 0, 0, 0, 0};
const Words kAllDrawn{0, 0, 3, 0, 0, 6, 7, 0,  //
                      0, 0, 3, 0, 0, 0, 0, 0};

/// What a draw needs on one device, with one program and one target.
struct Stage {
  explicit Stage(Gpu& on, const char* vertex = kVertex)
      : gpu(on),
        program(gpu.build(describe(vertex))),
        positions(uploaded(gpu, kCorners)),
        indices(uploaded(gpu, kIndices)),
        ids(gpu.allocateImage(
            {.format = PixelFormat::kR32ui, .width = kColumns, .height = kRows})) {
    draw.program = &program;
    draw.buffers = {{kPositions, &positions}};
    draw.colours = {{.image = &ids}};
    draw.indices = &indices;
  }

  Words drawn(auto calls) {
    draw.calls = std::move(calls);
    run(gpu, draw);
    return pixelsOf<std::uint32_t>(gpu, ids);
  }

  Gpu& gpu;
  GpuDrawProgram program;
  GpuBuffer positions, indices;
  GpuImage ids;
  Draw draw;
};

/// Opens one device more, without those features.
Gpu without(const std::vector<std::string>& features) {
  return Gpu(Gpu::Options{.device = "", .without = features});
}

class DrawCallsTest : public DrawingTest {};

TEST_F(DrawCallsTest, EveryFieldOfACommandCountsInAllThreeWays) {
  Stage stage(*gpu);
  const GpuBuffer commands = uploaded(*gpu, kDraws);
  const GpuBuffer counter = uploaded<std::uint32_t>(*gpu, {3});
  EXPECT_EQ(stage.drawn(kDraws), kAllDrawn);
  EXPECT_EQ(stage.drawn(DrawIndirect{.buffer = &commands, .count = 3}), kAllDrawn);
  EXPECT_EQ(stage.drawn(DrawIndirectCount{.buffer = &commands, .counter = &counter, .most = 3}),
            kAllDrawn);
}

TEST_F(DrawCallsTest, CommandsMayStandApartAndBehindOtherData) {
  struct Record {
    std::uint32_t before = 6;
    DrawIndexed command;
    std::uint32_t after = 6;
  };
  Stage stage(*gpu);
  const GpuBuffer records =
      uploaded(*gpu, std::vector<Record>{{.command = kUpper}, {.command = kWhole}});
  const GpuBuffer counter = uploaded<std::uint32_t>(*gpu, {7, 2});
  const unsigned offset = 4, stride = sizeof(Record);
  EXPECT_EQ(stage.drawn(DrawIndirect{&records, offset, stride, 2}), kAllDrawn);
  EXPECT_EQ(stage.drawn(DrawIndirectCount{&records, offset, stride, &counter, 4, 2}), kAllDrawn);
  EXPECT_EQ(stage.drawn(DrawIndirect{&records, offset + stride, stride, 1}), kWholeDrawn);
}

TEST_F(DrawCallsTest, ACountOnTheDeviceDrawsTheLesserOfItAndTheMost) {
  Stage stage(*gpu);
  const GpuBuffer commands = uploaded(*gpu, kDraws);
  struct Case {
    std::uint32_t count;
    unsigned most;
    const Words& expected;
  };
  for (const Case& c : {Case{0, 3, kEmpty}, Case{1, 3, kWholeDrawn}, Case{3, 3, kAllDrawn},
                        Case{3, 1, kWholeDrawn}, Case{~0u, 2, kWholeDrawn}, Case{3, 0, kEmpty}}) {
    const GpuBuffer counter = uploaded<std::uint32_t>(*gpu, {c.count});
    EXPECT_EQ(
        stage.drawn(DrawIndirectCount{.buffer = &commands, .counter = &counter, .most = c.most}),
        c.expected)
        << c.count << " of at most " << c.most;
  }
}

TEST_F(DrawCallsTest, NoDrawsAndNoInstancesLeaveTheClearAlone) {
  Stage stage(*gpu);
  const GpuBuffer commands = uploaded(*gpu, std::vector{kNone, kNone});
  EXPECT_EQ(stage.drawn(std::vector<DrawIndexed>{}), kEmpty);
  EXPECT_EQ(stage.drawn(std::vector{kNone}), kEmpty);
  EXPECT_EQ(stage.drawn(DrawIndirect{.buffer = &commands, .count = 0}), kEmpty);
  EXPECT_EQ(stage.drawn(DrawIndirect{.buffer = &commands, .count = 2}), kEmpty);
}

TEST_F(DrawCallsTest, ADispatchWritesTheCommandsAndTheirCountJustBefore) {
  constexpr BindingSlot kCommands{0, 0}, kCount{0, 1};
  ProgramDescription filling;
  filling.spirv = compileText(R"(#version 450
    layout(local_size_x = 4) in;
    layout(set = 0, binding = 0) writeonly buffer Commands { uint commands[]; };
    layout(set = 0, binding = 1) buffer Count { uint count; };
    void main() {
      if (gl_LocalInvocationIndex % 2 == 1) return;
      uint at = 5 * atomicAdd(count, 1);
      commands[at] = 6;
      commands[at + 1] = 1;
      commands[at + 2] = 3;
      commands[at + 3] = 0;
      commands[at + 4] = gl_LocalInvocationIndex;
    })");
  filling.slots = {kCommands, kCount};
  const GpuProgram filler = gpu->build(filling);
  Stage stage(*gpu);
  const GpuBuffer commands = gpu->allocate(4 * sizeof(DrawIndexed));
  const GpuBuffer counter = uploaded<std::uint32_t>(*gpu, {0});
  Dispatch dispatch;
  dispatch.program = &filler;
  dispatch.buffers = {{kCommands, &commands}, {kCount, &counter}};
  stage.draw.calls = DrawIndirectCount{.buffer = &commands, .counter = &counter, .most = 4};
  const Work work[] = {&dispatch, &stage.draw};
  const std::vector<double> times = gpu->run(work, kDrawLimit);
  EXPECT_EQ(times.size(), 2u);
  if (gpu->info().features.at("timestamps")) {
    EXPECT_GT(std::ranges::min(times), 0);
  }
  EXPECT_EQ(pixelsOf<std::uint32_t>(*gpu, stage.ids), (Words{1, 0, 3, 0, 0, 0, 0, 0,  //
                                                             1, 0, 3, 0, 0, 0, 0, 0}));
}

TEST_F(DrawCallsTest, TheNumberOfADrawCountsThoseBeforeIt) {
  if (gpu->info().lacks(std::vector<std::string>{"shaderDrawParameters"})) GTEST_SKIP();
  Stage stage(*gpu, kDrawIdVertex);
  const GpuBuffer commands = uploaded(*gpu, kDraws);
  EXPECT_EQ(stage.drawn(DrawIndirect{.buffer = &commands, .count = 3}),
            (Words{1, 0, 3, 0, 0, 0, 0, 0,  //
                   1, 0, 0, 0, 0, 0, 0, 0}));
}

// ---- what a device lacks -------------------------------------------------------------------

TEST(DrawCallsWithout, MultiDrawIndirectOneCallOfEachCommandDrawsTheSame) {
  Gpu gpu = without({"multiDrawIndirect"});
  Stage stage(gpu);
  const GpuBuffer commands = uploaded(gpu, kDraws);
  EXPECT_EQ(stage.drawn(DrawIndirect{.buffer = &commands, .count = 3}), kAllDrawn);
  EXPECT_EQ(gpu.takeMessages(), std::vector<std::string>());
}

TEST(DrawCallsWithout, WhatADrawNeedsIsNamed) {
  struct Case {
    const char* feature;
    const char* vertex;
    bool counted;
  };
  for (const Case& c :
       {Case{"graphicsQueue", kVertex, false}, Case{"dynamicRendering", kVertex, false},
        Case{"shaderDrawParameters", kDrawIdVertex, false},
        Case{"multiDrawIndirect", kDrawIdVertex, false},
        Case{"drawIndirectFirstInstance", kVertex, false},
        Case{"drawIndirectFirstInstance", kVertex, true}, Case{"multiDrawIndirect", kVertex, true},
        Case{"drawIndirectCount", kVertex, true}}) {
    Gpu gpu = without({c.feature});
    const std::string why = thrownBy<Unsupported>([&] {
      Stage stage(gpu, c.vertex);
      const GpuBuffer commands = uploaded(gpu, kDraws);
      const GpuBuffer counter = uploaded<std::uint32_t>(gpu, {3});
      if (c.counted)
        stage.drawn(DrawIndirectCount{.buffer = &commands, .counter = &counter, .most = 3});
      else
        stage.drawn(DrawIndirect{.buffer = &commands, .count = 3});
    });
    EXPECT_EQ(why, gpu.info().name + " lacks " + c.feature);
    EXPECT_EQ(gpu.takeMessages(), std::vector<std::string>());
  }
}

TEST(DrawCallsWithout, DirectDrawsNeedNoneOfTheIndirectOnesFeatures) {
  Gpu gpu = without({"multiDrawIndirect", "drawIndirectFirstInstance", "drawIndirectCount"});
  EXPECT_EQ(Stage(gpu).drawn(kDraws), kAllDrawn);
  EXPECT_EQ(gpu.takeMessages(), std::vector<std::string>());
}

// ---- what a draw gets wrong ----------------------------------------------------------------

/// A draw of the whole column with one thing changed, and what is said of it.
class WrongDrawTest : public DrawingTest {
 protected:
  void SetUp() override {
    stage = std::make_unique<Stage>(*gpu);
    commands = uploaded(*gpu, kDraws);
    counter = uploaded<std::uint32_t>(*gpu, {3});
  }
  void TearDown() override {
    stage.reset();
    DrawingTest::TearDown();
  }

  template <typename Error = std::logic_error>
  std::string said(const auto& change) {
    Draw& draw = stage->draw;
    const Draw right = draw;
    draw.calls = std::vector{kWhole};
    change(draw);
    const std::string text = thrownBy<Error>([&] { run(*gpu, draw); });
    draw = right;
    return text;
  }
  template <typename Error = std::logic_error>
  std::string saidOf(auto calls) {
    return said<Error>([&](Draw& draw) { draw.calls = calls; });
  }

  std::unique_ptr<Stage> stage;
  GpuBuffer commands, counter;
};

TEST_F(WrongDrawTest, IndicesPastTheEnd) {
  EXPECT_EQ(said([](Draw& draw) { draw.indices = nullptr; }), "a draw without an index buffer");
  EXPECT_EQ(saidOf<std::out_of_range>(std::vector{DrawIndexed{.indexCount = 7, .firstIndex = 3}}),
            "indices 3 to 10 of an index buffer of 9");
  EXPECT_EQ(saidOf<std::out_of_range>(std::vector{DrawIndexed{.indexCount = 2, .firstIndex = ~0u}}),
            "indices 4294967295 to 4294967297 of an index buffer of 9");
}

TEST_F(WrongDrawTest, CommandsPastTheEndOrOutOfStep) {
  EXPECT_EQ(saidOf(DrawIndirect{}), "an indirect draw without a buffer of commands");
  EXPECT_EQ(saidOf<std::out_of_range>(DrawIndirect{.buffer = &commands, .count = 4}),
            "bytes 0 to 80 of a GPU buffer of 60 bytes");
  EXPECT_EQ(saidOf<std::out_of_range>(DrawIndirect{.buffer = &commands, .offset = 44}),
            "bytes 44 to 64 of a GPU buffer of 60 bytes");
  EXPECT_EQ(saidOf(DrawIndirect{.buffer = &commands, .offset = 2}),
            "the offset of indirect draws of 2 bytes is no multiple of 4");
  EXPECT_EQ(saidOf(DrawIndirect{.buffer = &commands, .stride = 22}),
            "the stride of indirect draws of 22 bytes is no multiple of 4");
  EXPECT_EQ(saidOf(DrawIndirect{.buffer = &commands, .stride = 16}),
            "indirect draws 16 bytes apart; each has 20");
}

TEST_F(WrongDrawTest, TheCountsPlace) {
  EXPECT_EQ(saidOf(DrawIndirectCount{.buffer = &commands}), "an indirect draw without its count");
  EXPECT_EQ(saidOf<std::out_of_range>(
                DrawIndirectCount{.buffer = &commands, .counter = &counter, .counterOffset = 4}),
            "bytes 4 to 8 of a GPU buffer of 4 bytes");
  EXPECT_EQ(saidOf(DrawIndirectCount{.buffer = &commands, .counter = &counter, .counterOffset = 1}),
            "the offset of the count of 1 bytes is no multiple of 4");
  EXPECT_EQ(saidOf<std::out_of_range>(
                DrawIndirectCount{.buffer = &commands, .counter = &counter, .most = 4}),
            "bytes 0 to 80 of a GPU buffer of 60 bytes");
}

TEST_F(WrongDrawTest, SlotsAndPushConstants) {
  EXPECT_EQ(said([](Draw& draw) { draw.buffers.clear(); }),
            "the storage buffer of set 0, binding 0 must be bound once");
  EXPECT_EQ(said([](Draw& draw) { draw.push.resize(4); }),
            "4 bytes of push constants for a program of 0");
}

TEST_F(WrongDrawTest, Targets) {
  const GpuImage floats =
      gpu->allocateImage({.format = PixelFormat::kR32f, .width = kColumns, .height = kRows});
  const GpuImage depth = gpu->allocateImage({.format = PixelFormat::kD32, .width = 4});
  EXPECT_EQ(said([&](Draw& draw) { draw.colours[0].image = &floats; }),
            "colour target 0 is R32F; the program draws R32UI");
  EXPECT_EQ(said([](Draw& draw) { draw.colours[0].image = nullptr; }),
            "colour target 0 has no image");
  EXPECT_EQ(said([](Draw& draw) { draw.colours.clear(); }),
            "0 colour targets without depth for a program of 1 colour targets without depth");
  EXPECT_EQ(said([&](Draw& draw) { draw.depth = {.image = &depth}; }),
            "1 colour targets with depth for a program of 1 colour targets without depth");
  EXPECT_EQ(said<std::out_of_range>([](Draw& draw) { draw.colours[0].layer = 1; }),
            "layer 1, mip 0 of a GPU image of 1 and 1");
}

TEST_F(WrongDrawTest, TargetsOfTwoSizesOrAlsoBound) {
  constexpr BindingSlot kImage{0, 1, BindingSlot::Kind::kSampledImage};
  DrawProgramDescription description = describe(kVertex);
  description.depth = true;
  description.slots.push_back(kImage);
  const GpuDrawProgram program = gpu->build(description);
  const GpuImage small = gpu->allocateImage({.format = PixelFormat::kD32, .width = 4});
  const GpuImage depth =
      gpu->allocateImage({.format = PixelFormat::kD32, .width = kColumns, .height = kRows});
  const auto change = [&](const GpuImage& target, const GpuImage& bound) {
    return said([&](Draw& draw) {
      draw.program = &program;
      draw.depth = {.image = &target};
      draw.images = {{kImage, &bound}};
    });
  };
  EXPECT_EQ(change(small, depth), "the depth target of 4 x 1 pixels beside a target of 8 x 2");
  EXPECT_EQ(change(depth, depth), "the depth target is also bound to set 0, binding 1");
  EXPECT_EQ(change(depth, small), "nothing");
}

TEST_F(WrongDrawTest, Programs) {
  const auto said = [&](const auto& change) {
    DrawProgramDescription description = describe(kVertex);
    change(description);
    return thrownBy<std::logic_error>([&] { gpu->build(description); });
  };
  using Description = DrawProgramDescription;
  EXPECT_EQ(said([](Description& d) { d.colours.assign(5, PixelFormat::kR32ui); }),
            "5 colour targets; a program has at most 4");
  EXPECT_EQ(said([](Description& d) { d.colours = {PixelFormat::kD32}; }),
            "a colour target of D32");
  EXPECT_EQ(said([](Description& d) { d.colours.clear(); }), "a program that draws to no target");
  EXPECT_EQ(said([](Description& d) { d.fragment.clear(); }),
            "1 colour targets and no fragment stage");
  EXPECT_THROW(gpu->build(Description{.vertex = {}, .depth = true}), UsageError);
}

}  // namespace
}  // namespace gnomon
