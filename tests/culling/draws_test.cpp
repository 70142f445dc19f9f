// What the lists are for: the whole chain on the device, depth buffer to draws, in one submission.
//
// Covered: a frame of what culling leaves is the frame of all objects, bit by bit, drawn with the
// count from the tally and without; a frozen camera; tallies read back frames later without a wait.
// Not covered: engines' draws of many meshes; the frame's own order of passes (stage frame).
#include <algorithm>
#include <array>
#include <cstring>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "harness/program/compile.h"
#include "harness/vulkan/readback.h"
#include "kernels/culling/camera.h"
#include "kernels/culling/draws.h"
#include "reference/culling/hiz.h"
#include "tests/culling/lists.h"

namespace gnomon::culling {
namespace {

const char* const kVertex = R"(#version 450
layout(set = 0, binding = 0) readonly buffer Transforms { mat4 transforms[]; };
layout(push_constant) uniform Push { mat4 viewProjection; };
layout(location = 0) flat out uint object;
void main() {
  const vec3 corner = vec3(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1, gl_VertexIndex >> 2) * 2.0 - 1.0;
  gl_Position = viewProjection * (transforms[gl_InstanceIndex] * vec4(corner, 1.0));
  object = gl_InstanceIndex;
})";

const char* const kFragment = R"(#version 450
layout(location = 0) flat in uint object;
layout(location = 0) out uint id;
void main() { id = object + 1; })";

/// Two triangles a face of the cube whose corner i has the signs of i's bits.
constexpr std::array<uint, 36> kCube = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

template <class T>
GpuBuffer uploaded(Gpu& gpu, const std::vector<T>& values) {
  GpuBuffer buffer = gpu.allocate(values.size() * sizeof(T));
  gpu.upload(buffer, 0, std::as_bytes(std::span(values)));
  return buffer;
}

template <class T>
std::vector<std::byte> bytesOf(const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  return {bytes.begin(), bytes.end()};
}

BindingSlot buffer(uint binding) { return {.set = 0, .binding = binding}; }

/// Cubes alone, so that a draw's bounds are what the truth's rays meet.
Scene cubes(SceneKind kind, std::uint64_t seed) {
  Scene scene = generatedScene(kind, seed);
  scene.bounds.clear();
  for (Thing& thing : scene.things) thing.isCube = true;
  complete(scene);
  for (DrawCommand& command : scene.commands)
    command = {kCube.size(), 1, 0, 0, command.firstInstance};
  return scene;
}

/// Pixels of a frame: which object (from 1) each shows, and its depth.
struct Frame {
  std::vector<uint> ids;
  std::vector<float> depths;
  bool operator==(const Frame&) const = default;
};

/// Writes an object's number where it is nearest.
DrawProgramDescription drawing() {
  return {.vertex = compileText("ids.vert", kVertex, {}),
          .fragment = compileText("ids.frag", kFragment, {}),
          .slots = {buffer(0)},
          .pushBytes = sizeof(mat4),
          .colours = {PixelFormat::kR32ui},
          .depth = true};
}

/// A scene on the device with what culls and draws it.
class Stage {
 public:
  Stage(Gpu& g, const GpuDrawProgram& p, const Scene& s)
      : gpu(g),
        scene(s),
        objects(static_cast<uint>(s.things.size())),
        program(p),
        transforms(uploaded(gpu, placed(s))),
        indices(uploaded(gpu, std::vector<uint>(kCube.begin(), kCube.end()))),
        camera(uploaded(gpu, std::vector{s.camera})),
        bounds(uploaded(gpu, s.bounds)),
        commands(uploaded(gpu, s.commands)),
        survivors(zeroed<DrawCommand>(objects)),
        found(zeroed<Tally>(1)),
        draws(zeroed<DrawCommand>(objects)),
        tally(zeroed<Tally>(1)),
        scratch(zeroed<uint>(kBlocks + 1)),
        hizScratch(zeroed<uint>(2 + tiles())),
        ids(gpu.allocateImage(target(PixelFormat::kR32ui))),
        depth(gpu.allocateImage(target(PixelFormat::kD32))),
        pyramid(gpu.allocateImage(levels())),
        nearest(gpu.makeSampler({})) {}

  /// All objects' depth, their pyramid, and both lists, on the device alone.
  void cull() {
    const Draw prepass = drawOf(directCalls(), scene.camera);
    const Dispatch made = hiz(), inside = frustum(), seen = occlusion();
    const std::array<Work, 4> work = {&prepass, &made, &inside, &seen};
    gpu.run(work, kLimit);
  }

  std::vector<DrawIndexed> directCalls() const {
    std::vector<DrawIndexed> calls;
    for (const DrawCommand& c : scene.commands)
      calls.push_back(
          {c.indexCount, c.instanceCount, c.firstIndex, c.vertexOffset, c.firstInstance});
    return calls;
  }

  Frame drawn(const ListCalls& calls, const Camera& seenBy) {
    const Draw draw = drawOf(calls, seenBy);
    const Work work = &draw;
    gpu.run(std::span(&work, 1), kLimit);
    Frame frame{std::vector<uint>(pixels()), std::vector<float>(pixels())};
    gpu.downloadImage(ids, 0, 0, std::as_writable_bytes(std::span(frame.ids)));
    gpu.downloadImage(depth, 0, 0, std::as_writable_bytes(std::span(frame.depths)));
    return frame;
  }

  Dispatch frustum() {
    return {.program = &Session::current().subject("culling/frustum").plain(),
            .buffers = {{buffer(kCamera), &camera},
                        {buffer(kBounds), &bounds},
                        {buffer(kCommands), &commands},
                        {buffer(kDraws), &survivors},
                        {buffer(kTally), &found},
                        {buffer(kScratch), &scratch}},
            .push = bytesOf(Frustum{objects, objects, 0, scene.pad, kPatience})};
  }

  ListCalls counted() const { return countedCalls(draws, tally, objects); }
  ListCalls all() const { return allCalls(draws, objects); }

  std::vector<DrawIndexed> listed() {
    std::vector<Tally> told(1);
    gpu.download(tally, 0, std::as_writable_bytes(std::span(told)));
    std::vector<DrawIndexed> calls(told[0].listed);
    if (!calls.empty()) gpu.download(draws, 0, std::as_writable_bytes(std::span(calls)));
    return calls;
  }

  static constexpr std::chrono::seconds kLimit{20};
  Gpu& gpu;
  const Scene& scene;
  uint objects;
  const GpuDrawProgram& program;
  GpuBuffer transforms, indices, camera, bounds, commands, survivors, found, draws, tally, scratch,
      hizScratch;
  GpuImage ids, depth, pyramid;
  GpuSampler nearest;

 private:
  static std::vector<mat4> placed(const Scene& scene) {
    std::vector<mat4> all;
    for (const Thing& thing : scene.things) all.emplace_back(thing.transform);
    return all;
  }

  template <class T>
  GpuBuffer zeroed(std::size_t elements) {
    return uploaded(gpu, std::vector<T>(elements));
  }

  std::size_t pixels() const { return std::size_t{scene.size.x} * scene.size.y; }
  uvec2 tileGrid() const { return max(scene.size >> kHizTile, uvec2(1)); }
  std::size_t tiles() const { return std::size_t{tileGrid().x} * tileGrid().y; }
  ImageDescription target(PixelFormat format) const {
    return {.format = format, .width = scene.size.x, .height = scene.size.y};
  }
  ImageDescription levels() const {
    const uvec2 first = levelSize(scene.size, 1);
    return {.format = PixelFormat::kR32f,
            .width = first.x,
            .height = first.y,
            .mips = std::max(levelCount(scene.size), 1u)};
  }

  Draw drawOf(const ListCalls& calls, const Camera& seenBy) {
    Draw draw;
    draw.program = &program;
    draw.buffers = {{buffer(0), &transforms}};
    draw.push = bytesOf(seenBy.viewProjection);
    draw.colours = {{.image = &ids}};
    draw.depth = {.image = &depth};
    draw.indices = &indices;
    draw.calls = calls;
    return draw;
  }

  Dispatch hiz() {
    const uvec2 grid = tileGrid();
    BindingSlot all{.set = 0, .binding = kHizLevels, .kind = BindingSlot::Kind::kStorageImage};
    all.count = kMaxLevels;
    return {.program = &Session::current().subject("culling/hiz").plain(),
            .buffers = {{buffer(kHizScratch), &hizScratch}},
            .images = {{.slot = {0, kHizDepth, BindingSlot::Kind::kSampledImage}, .image = &depth},
                       {.slot = {0, kHizNearest, BindingSlot::Kind::kSampler}, .sampler = &nearest},
                       {.slot = all, .image = &pyramid}},
            .push = bytesOf(Hiz{scene.size}),
            .groups = {grid.x, grid.y, 1}};
  }

  Dispatch occlusion() {
    return {
        .program = &Session::current().subject("culling/occlusion").plain(),
        .buffers = {{buffer(kCamera), &camera},
                    {buffer(kBounds), &bounds},
                    {buffer(kSurvivors), &survivors},
                    {buffer(kFound), &found},
                    {buffer(kDraws), &draws},
                    {buffer(kTally), &tally},
                    {buffer(kScratch), &scratch}},
        .images = {{.slot = {0, kDepth, BindingSlot::Kind::kSampledImage}, .image = &depth},
                   {.slot = {0, kPyramid, BindingSlot::Kind::kSampledImage}, .image = &pyramid}},
        .push = bytesOf(Occlusion{scene.size, objects, objects, objects, scene.pad, kPatience})};
  }
};

class CullingOcclusionDraws : public ListCase {
 protected:
  CullingOcclusionDraws() : ListCase("culling/occlusion") {}

  void SetUp() override {
    ListCase::SetUp();
    // Buffers and images are bound here as the contract has them; a foreign kernel's are not.
    if (!Session::current().options().kernels.empty() && !IsSkipped())
      GTEST_SKIP() << "drawn with the project's own kernels";
    widthDoesNotMatter();
  }

  /// Calls f with scenes on the device of which some objects are culled and some are not.
  template <class F>
  void forScenes(const F& f) {
    skipWhereUnsupported([&] {
      const GpuDrawProgram program = Session::current().gpu().build(drawing());
      std::size_t culled = 0, kept = 0;
      for (int kind = 0; kind < kSceneKinds; ++kind)
        for (std::uint64_t s = 0; s < 3; ++s) {
          const Scene scene = cubes(static_cast<SceneKind>(kind), caseSeed() + s);
          Stage stage(Session::current().gpu(), program, scene);
          stage.cull();
          const std::size_t listed = stage.listed().size();
          kept += listed;
          culled += scene.things.size() - listed;
          f(stage);
          checked(scene.depth.pixels());
        }
      EXPECT_GT(culled, kept / 2);
      EXPECT_GT(kept, culled / 10);
      EXPECT_EQ(Session::current().gpu().takeMessages(), std::vector<std::string>());
    });
  }
};

TEST_F(CullingOcclusionDraws, WhatIsLeftDrawsTheFrameOfAllWithTheCountOfTheTally) {
  forScenes([](Stage& stage) {
    const Frame whole = stage.drawn(stage.directCalls(), stage.scene.camera);
    EXPECT_TRUE(stage.drawn(stage.counted(), stage.scene.camera) == whole)
        << "in a scene of kind '" << nameOf(stage.scene.kind) << "'";
  });
}

TEST_F(CullingOcclusionDraws, WhatIsLeftDrawsTheFrameOfAllWithoutACount) {
  forScenes([](Stage& stage) {
    const Frame whole = stage.drawn(stage.directCalls(), stage.scene.camera);
    EXPECT_TRUE(stage.drawn(stage.all(), stage.scene.camera) == whole)
        << "in a scene of kind '" << nameOf(stage.scene.kind) << "'";
  });
}

// The list stays that of the camera that culled; another one looks at what is in it.
TEST_F(CullingOcclusionDraws, AFrozenCameraIsDrawnByAnother) {
  forScenes([](Stage& stage) {
    const Scene& scene = stage.scene;
    const glm::dmat4 beside =
        glm::translate(glm::dmat4(1), glm::dvec3(0, 0, -5 * scene.near)) * scene.view;
    const Camera other = cameraOf(beside, scene.projection, scene.near);
    EXPECT_TRUE(stage.drawn(callsOf(stage.gpu.info(), stage.draws, stage.tally, stage.objects),
                            other) == stage.drawn(stage.listed(), other))
        << "in a scene of kind '" << nameOf(scene.kind) << "'";
  });
}

// Each frame has one object more; three frames may be in flight, and nobody waits.
TEST_F(CullingOcclusionDraws, TalliesComeBackInOrderWithoutAWait) {
  skipWhereUnsupported([&] {
    const Scene scene = cubes(SceneKind::kField, caseSeed());
    Gpu& gpu = Session::current().gpu();
    const GpuDrawProgram program = gpu.build(drawing());
    Stage stage(gpu, program, scene);
    GpuReadback readback(gpu, 3, sizeof(Tally));
    const GpuCopy wanted{.from = &stage.found, .bytes = sizeof(Tally)};
    std::uint64_t submitted = 0, read = 0;
    std::uint32_t last = 0;
    const auto look = [&] {
      const auto frame = readback.poll();
      if (!frame) return;
      Tally tally;
      std::memcpy(&tally, frame->bytes.data(), sizeof tally);
      EXPECT_EQ(tally.tested, frame->number + 1);
      EXPECT_GE(tally.total, last) << "the same objects and one more";
      last = tally.total;
      read = frame->number + 1;
    };
    while (submitted < scene.things.size()) {
      Dispatch dispatch = stage.frustum();
      const auto count = static_cast<uint>(submitted + 1);
      dispatch.push = bytesOf(Frustum{count, count, 0, scene.pad, kPatience});
      const Work work = &dispatch;
      submitted += readback.submit(std::span(&work, 1), std::span(&wanted, 1));
      look();
    }
    const auto deadline = std::chrono::steady_clock::now() + Stage::kLimit;
    while (read < submitted && std::chrono::steady_clock::now() < deadline) look();
    EXPECT_EQ(read, submitted);
    checked(submitted);
  });
}

}  // namespace
}  // namespace gnomon::culling
