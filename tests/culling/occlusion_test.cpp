// culling/occlusion and culling/occlusion_subgroups against their model, and by laws and truth.
//
// Covered: spheres of every size before, in and behind depth buffers of every listed size, as sets
// of what must and may be listed; rectangles whose sides are just a power of two and just more; the
// list's order, records, tail, capacity, tally; survivors that are a part of the objects; bad
// bounds, bad depths, draws of no object; walls, holes, an empty screen; nothing that a ray sees is
// hidden. The path with subgroups repeats what the compaction is about.
// Not covered: the pyramid (hiz_test.cpp); it comes from the model here. The whole chain on the
// device, and drawing the list: draws_test.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>

#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "kernels/culling/camera.h"
#include "reference/culling/frustum.h"
#include "tests/culling/lists.h"

namespace gnomon::culling {
namespace {

constexpr std::array kSizes = {uvec2(1, 1),      uvec2(1, 7),       uvec2(3, 5),   uvec2(1023, 767),
                               uvec2(1366, 768), uvec2(1920, 1080), uvec2(4095, 1)};

/// Near 0.5, no far plane: depth is 1 / 2 d.
Camera eye() { return cameraOf(glm::dmat4(1), perspective(1.2, 1.5, 0.5), 0.5); }

Picture filled(const uvec2& size, float depth) {
  return {size, std::vector<vec4>(std::size_t{size.x} * size.y, vec4(depth, 0, 0, 0))};
}

/// Rectangles of one depth, sky and some noise: so that levels matter.
Picture patches(const uvec2& size, Random& random) {
  Picture depth = filled(size, 0);
  for (int i = 0; i < 40; ++i) {
    const auto d = static_cast<float>(random.logUniform(1e-3, 1));
    const uvec2 a{random.below(size.x), random.below(size.y)};
    const uvec2 b = min(a + uvec2{1 + random.below(size.x), 1 + random.below(size.y)}, size);
    for (uint y = a.y; y < b.y; ++y)
      for (uint x = a.x; x < b.x; ++x) depth.texels[std::size_t{y} * size.x + x].x = d;
  }
  for (std::size_t i = 0; i < depth.pixels() / 50; ++i)
    depth.texels[random.below(depth.pixels())].x = static_cast<float>(random.uniform());
  return depth;
}

/// Spheres of every size before that camera.
std::vector<Bounds> spheresBefore(std::size_t n, Random& random) {
  std::vector<Bounds> all;
  for (std::size_t i = 0; i < n; ++i) {
    const double d = random.logUniform(0.3, 1000);
    const vec3 at(random.uniform(-1.3, 1.3) * d, random.uniform(-0.9, 0.9) * d, -d);
    all.push_back({at, static_cast<float>(d * random.logUniform(1e-4, 0.9))});
  }
  return all;
}

class OcclusionCase : public ListCase {
 protected:
  using ListCase::ListCase;

  static OcclusionInput anyInput(std::size_t n, const uvec2& size, std::uint64_t seed) {
    Random random(seed);
    const Picture depth = patches(size, random);
    return occlusionInput(eye(), spheresBefore(n, random), depth);
  }

  void everySizeAroundABlockIsListed() {
    widthDoesNotMatter();
    for (const std::size_t n :
         {std::size_t{0}, std::size_t{1}, std::size_t{kGroupSize + 1}, std::size_t{kBlock - 1},
          std::size_t{kBlock}, std::size_t{kBlock + 1}, std::size_t{3 * kBlock + 7}})
      expectRightList(anyInput(n, {61, 43}, caseSeed()));
  }

  void aFullListKeepsTheFirst() {
    const OcclusionInput input = anyInput(2 * kBlock + 100, {61, 43}, caseSeed());
    for (const uint capacity : {1u, 500u}) {
      OcclusionInput full = input;
      full.push.capacity = capacity;
      expectRightList(full);
      expectRightTally(full);
    }
  }

  /// A thread then asks more than one group. Every third object is before a wall at distance 8.
  static OcclusionInput moreBlocksThanThreads() {
    std::vector<Bounds> all;
    for (std::size_t i = 0; i < kMoreThanThreads; ++i)
      all.push_back({{0, 0, i % 3 == 0 ? -4.0f : -50.0f}, 1});
    return occlusionInput(eye(), all, filled({61, 43}, 1 / 16.0f));
  }

  void blocksAreCountedByWhoeverAsksNobody() {
    OcclusionInput input = anyInput(3 * kBlock + 1, {61, 43}, caseSeed());
    input.push.patience = 0;
    expectRightList(input);
    expectRightTally(input);
  }
};

class CullingOcclusion : public OcclusionCase {
 protected:
  CullingOcclusion() : OcclusionCase("culling/occlusion") {}
};

class CullingOcclusionSubgroups : public OcclusionCase {
 protected:
  CullingOcclusionSubgroups() : OcclusionCase("culling/occlusion_subgroups") {}
};

class CullingOcclusionLaws : public CullingOcclusion {
 protected:
  void SetUp() override {
    CullingOcclusion::SetUp();
    widthDoesNotMatter();
  }
};

TEST_F(CullingOcclusion, EverySizeAroundABlockIsListed) { everySizeAroundABlockIsListed(); }
TEST_F(CullingOcclusionSubgroups, EverySizeAroundABlockIsListed) {
  everySizeAroundABlockIsListed();
}

TEST_F(CullingOcclusion, AFullListKeepsTheFirst) { aFullListKeepsTheFirst(); }
TEST_F(CullingOcclusionSubgroups, AFullListKeepsTheFirst) { aFullListKeepsTheFirst(); }

TEST_F(CullingOcclusion, BlocksAreCountedByWhoeverAsksNobody) {
  blocksAreCountedByWhoeverAsksNobody();
}
TEST_F(CullingOcclusionSubgroups, BlocksAreCountedByWhoeverAsksNobody) {
  blocksAreCountedByWhoeverAsksNobody();
}

TEST_F(CullingOcclusion, GroupsThatAskAreAnswered) {
  widthDoesNotMatter();
  expectAnswers(anyInput(3 * kBlock, {61, 43}, caseSeed()));
}
TEST_F(CullingOcclusionSubgroups, GroupsThatAskAreAnswered) {
  widthDoesNotMatter();
  expectAnswers(anyInput(3 * kBlock, {61, 43}, caseSeed()));
}

// Whether they are answered, the frustum's case tells: it asks with the same code.
TEST_F(CullingOcclusion, MoreBlocksThanThreadsAreListed) {
  widthDoesNotMatter();
  expectEveryThird(visible(moreBlocksThanThreads()));
}
TEST_F(CullingOcclusionSubgroups, MoreBlocksThanThreadsAreListed) {
  widthDoesNotMatter();
  const OcclusionInput input = moreBlocksThanThreads();
  expectEveryThird(visible(input));
  expectAnswers(input);
}

TEST_F(CullingOcclusion, SpheresAreListedAsTheModelSaysAtEverySizeOfTheScreen) {
  threadsDoNotMatter();
  for (const uvec2 size : kSizes) expectRightList(anyInput(kBlock, size, caseSeed() + size.x));
}

// Behind the wall at distance 8, before it, through it, and where it has a hole of one pixel.
TEST_F(CullingOcclusion, AWallHidesWhatIsBehindItAtEverySize) {
  threadsDoNotMatter();
  for (const uvec2 size : kSizes) {
    Random random(caseSeed());
    std::vector<Bounds> all;
    for (int i = 0; i < 300; ++i) {
      const double r = random.logUniform(0.01, 30), d = 8 + r;
      const vec3 beside(random.uniform(-2, 2) * d, random.uniform(-2, 2) * d, 0);
      all.push_back({beside - vec3(0, 0, 1.001 * d), static_cast<float>(r)});
    }
    Picture depth = filled(size, 1 / 16.0f);
    for (const bool kept : visible(occlusionInput(eye(), all, depth)))
      EXPECT_FALSE(kept) << size.x << "x" << size.y;
    for (Bounds& b : all) b.centre.z += 0.01f * b.radius + 0.02f * 8;
    expectRightList(occlusionInput(eye(), all, depth));
    depth.texels[depth.pixels() / 2].x = 0;
    expectRightList(occlusionInput(eye(), all, depth));
  }
}

TEST_F(CullingOcclusion, EveryProjectionIsTheModels) {
  widthDoesNotMatter();
  for (int kind = 0; kind < kSceneKinds; ++kind) {
    const Scene scene = generatedScene(static_cast<SceneKind>(kind), caseSeed());
    expectRightList(occlusionInput(scene.camera, spheresAround(scene, kBlock, caseSeed()),
                                   scene.depth, scene.pad));
  }
}

TEST_F(CullingOcclusion, SurvivorsMayBeAnyPartOfTheObjects) {
  widthDoesNotMatter();
  for (const uint stride : {2u, 7u}) {
    OcclusionInput input = anyInput(2 * kBlock, {61, 43}, caseSeed());
    input.stride = stride;
    input.push.capacity = 2 * kBlock;
    expectRightList(input);
  }
}

TEST_F(CullingOcclusion, DrawsBehindTheListAreNotLookedAt) {
  widthDoesNotMatter();
  for (const uint behind : {1u, 5u, 2 * kBlock}) {
    OcclusionInput input = anyInput(100, {61, 43}, caseSeed());
    input.behind = behind;
    input.push.capacity = 3 * kBlock;
    expectRightList(input);
  }
}

TEST_F(CullingOcclusion, NoMoreIsReadThanThereIsRoomFor) {
  widthDoesNotMatter();
  OcclusionInput input = anyInput(100, {61, 43}, caseSeed());
  input.lacking = 7;
  input.push.capacity = kBlock;
  expectRightList(input);
  expectRightTally(input);
}

// Six units of numbers that code treats wrongly, in every place.
TEST_F(CullingOcclusion, BadBoundsAreVisible) {
  widthDoesNotMatter();
  std::vector<Bounds> all;
  for (const float x : specialFloats({kMostWorld, -kMostWorld, 2 * kMostWorld, -1.0f, 5.0f})) {
    all.push_back({{x, 0, -50}, 1});
    all.push_back({{0, x, -50}, 1});
    all.push_back({{0, 0, x}, 1});
    all.push_back({{0, 0, -50}, x});
  }
  expectRightList(occlusionInput(eye(), all, filled({61, 43}, 0.25f)));
}

TEST_F(CullingOcclusion, DrawsOfNoObjectAreVisible) {
  widthDoesNotMatter();
  OcclusionInput input = anyInput(300, {61, 43}, caseSeed());
  input.push.objects = 100;
  expectRightList(input);
}

// One pixel each: a bad depth is sky, which hides nothing.
TEST_F(CullingOcclusion, BadDepthsHideNothing) {
  widthDoesNotMatter();
  const std::vector<float> special = specialFloats({0.25f});
  const auto n = static_cast<uint>(special.size());
  Picture depth = filled({n, n}, 0.25f);
  std::vector<Bounds> all;
  const Camera camera = cameraOf(glm::dmat4(1), orthographic(0, n, 0, n, 1, 65), 1);
  for (uint i = 0; i < n; ++i) {
    depth.texels[std::size_t{n - 1 - i} * n + i].x = special[i];
    const float at = static_cast<float>(i) + 0.5f;
    all.push_back({{at, at, -60}, 0.25f});
    all.push_back({{at, at, -2}, 0.25f});
  }
  expectRightList(occlusionInput(camera, all, depth));
}

/// A camera that sees 64 x 64 units as 64 x 64 pixels, y downward, from distance 1 to 65.
Camera flat() { return cameraOf(glm::dmat4(1), orthographic(0, 64, 0, 64, 1, 65), 1); }

// Squares of every number of pixels, their edges just inside a pixel's or on it: exact in float.
TEST_F(CullingOcclusion, RectanglesOfEveryNumberOfPixelsFindTheirLevel) {
  threadsDoNotMatter();
  Random random(caseSeed());
  std::vector<Bounds> all;
  for (int pixels = 1; pixels <= 64; ++pixels)
    for (const float inset : {0.0f, 0.125f})
      for (const int at : {0, 1, 5, 31, 64 - pixels}) {
        const float r = 0.5f * static_cast<float>(pixels) - inset;
        const float middle = static_cast<float>(at) + 0.5f * static_cast<float>(pixels);
        all.push_back({{middle, 20, -40}, r});
        all.push_back({{20, middle, -40}, r});
      }
  expectRightList(occlusionInput(flat(), all, patches({64, 64}, random)));
}

// On exact numbers: depth is (65 - distance) / 64, which the sphere has at 33.
TEST_F(CullingOcclusion, ADepthThatIsTheSpheresOwnDoesNotHideIt) {
  threadsDoNotMatter();
  std::vector<Bounds> all;
  for (const float off : {-0x1p-10f, 0.0f, 0x1p-10f})
    all.push_back({{20, 20, -33.25f + off}, 0.25f});
  expectRightList(occlusionInput(flat(), all, filled({64, 64}, 0.5f)));
}

// On exact numbers, behind a depth that no scene has: beyond the near plane's own of 1.
TEST_F(CullingOcclusion, WhatTouchesTheNearPlaneDoesNotReachBeforeIt) {
  threadsDoNotMatter();
  expectRightList(occlusionInput(flat(), {{{20, 20, -1.25f}, 0.25f}, {{20, 20, -1.24f}, 0.25f}},
                                 filled({64, 64}, 1.5f)));
}

// Depths of 2^-16, before what is at 5e-5 and behind it, and in pixels whose depth is bad.
TEST_F(CullingOcclusion, TheSmallestDepthsHideToo) {
  threadsDoNotMatter();
  Picture depth = filled({64, 64}, 5e-5f);
  const std::vector<float> bad = {-1, std::numeric_limits<float>::quiet_NaN()};
  std::vector<Bounds> all;
  for (uint x = 0; x < 64; ++x) {
    if (x % 3 < 2) depth.texels[std::size_t{20} * 64 + x].x = bad[x % 3];
    const float at = static_cast<float>(x) + 0.5f;
    for (const float nearest : {65 - 0x1p-10f, 65 - 0x1p-7f})
      all.push_back({{at, 20.5f, -nearest - 0.25f}, 0.25f});
  }
  expectRightList(occlusionInput(flat(), all, depth));
}

// At the limit of perspective, a unit beyond it, and where there is none.
TEST_F(CullingOcclusion, FarToTheSideIsVisibleInPerspectiveAlone) {
  threadsDoNotMatter();
  std::vector<Bounds> all;
  for (const float side : {-kSteepest, kSteepest, -kSteepest - 1, kSteepest + 1}) {
    all.push_back({{side, 0, -1}, 0.25f});
    all.push_back({{0, side, -1}, 0.25f});
    all.push_back({{3 * side, 20, -2}, 0.25f});
  }
  for (const Camera& camera : {eye(), flat()})
    expectRightList(occlusionInput(camera, all, filled({64, 64}, 1)));
}

// A world of a hundred-thousandth: left of the axis is the wall, right of it the sky.
TEST_F(CullingOcclusion, TheSmallestSpheresAreOnTheirOwnSideOfTheAxis) {
  threadsDoNotMatter();
  const Camera tiny = cameraOf(glm::dmat4(1), perspective(1.2, 1, 1e-6), 1e-6);
  Picture depth = filled({64, 64}, 0);
  for (std::size_t i = 0; i < depth.pixels(); ++i)
    depth.texels[i].x = i % 64 < 32 || i / 64 < 32 ? 0.5f : 0.0f;
  std::vector<Bounds> all;
  for (const float x : {-1.3e-6f, 1.3e-6f})
    for (const float y : {-1.3e-6f, 1.3e-6f}) all.push_back({{x, y, -5e-6f}, 1e-8f});
  expectRightList(occlusionInput(tiny, all, depth));
}

// Of each pixel one sphere: those at odd places are behind their own pixel's depth, and every pixel
// beside one of them is sky.
TEST_F(CullingOcclusion, EveryPixelIsFoundByTheSphereInIt) {
  threadsDoNotMatter();
  Picture depth = filled({64, 64}, 0);
  std::vector<Bounds> all;
  for (uint y = 0; y < 64; ++y)
    for (uint x = 0; x < 64; ++x) {
      if ((x + y) % 2 == 1) depth.texels[std::size_t{y} * 64 + x].x = 0.5f;
      // From edge to edge, but for the last 2^-10 of the right and lower one, which is the next's.
      const float r = 0.5f - 0x1p-11f;
      all.push_back({{static_cast<float>(x) + r, static_cast<float>(y) + r, -50}, r});
    }
  expectRightList(occlusionInput(flat(), all, depth));
}

// By 2^-10 of a pixel, where the one before is sky and its own is wall.
TEST_F(CullingOcclusion, AnEdgeJustBeforeAPixelIsInTheOneBefore) {
  threadsDoNotMatter();
  Picture depth = filled({64, 64}, 0.5f);
  std::vector<Bounds> all;
  const float r = 0.5f - 0x1p-11f;
  for (uint i = 0; i < 64 * 64; ++i)
    if (i % 8 >= 6) depth.texels[i].x = 0;
  for (uint x = 0; x < 64; x += 8)
    all.push_back({{static_cast<float>(x) + r - 0x1p-10f, 20 + r, -50}, r});
  expectRightList(occlusionInput(flat(), all, depth));
}

TEST_F(CullingOcclusion, NothingThatARaySeesIsHidden) {
  widthDoesNotMatter();
  const std::size_t count = scenesOfEachKind();
  for (int kind = 0; kind < kSceneKinds; ++kind)
    for (std::size_t s = 0; s < count; ++s) {
      const Scene scene = generatedScene(static_cast<SceneKind>(kind), caseSeed() + s);
      const auto kept =
          quicklyVisible(occlusionInput(scene.camera, scene.bounds, scene.depth, scene.pad));
      for (std::size_t i = 0; i < kept.size(); ++i)
        EXPECT_TRUE(kept[i] || !scene.seen[i])
            << fmt::format("object {} of scene {} of kind '{}' has visible pixels and is culled", i,
                           s, nameOf(scene.kind));
      checked(kept.size());
    }
}

TEST_F(CullingOcclusionLaws, AnOccluderMoreNeverShowsMore) {
  Random random(caseSeed());
  OcclusionInput input = anyInput(2 * kBlock, {127, 61}, caseSeed());
  std::vector<bool> before = visible(input);
  for (int i = 0; i < 8; ++i) {
    const Picture more = patches(input.depth.size, random);
    for (std::size_t p = 0; p < more.pixels(); ++p)
      if (p % 8 == static_cast<std::size_t>(i))
        input.depth.texels[p].x = std::max(input.depth.texels[p].x, more.texels[p].x);
    const std::vector<bool> now = visible(input);
    for (std::size_t o = 0; o < now.size(); ++o) EXPECT_LE(now[o], before[o]);
    before = now;
    checked(now.size());
  }
}

TEST_F(CullingOcclusionLaws, CullingTwiceChangesNothing) {
  const OcclusionInput input = anyInput(2 * kBlock, {127, 61}, caseSeed());
  const std::vector<bool> once = visible(input);
  std::vector<Bounds> kept;
  for (std::size_t i = 0; i < once.size(); ++i)
    if (once[i]) kept.push_back(input.bounds[i]);
  ASSERT_GT(kept.size(), once.size() / 10);
  ASSERT_LT(kept.size(), once.size());
  for (const bool again : visible(occlusionInput(eye(), kept, input.depth))) EXPECT_TRUE(again);
  checked(kept.size());
}

TEST_F(CullingOcclusionLaws, TheOrderOfObjectsChangesNothing) {
  OcclusionInput input = anyInput(2 * kBlock + 3, {127, 61}, caseSeed());
  const std::vector<bool> forward = visible(input);
  std::ranges::reverse(input.bounds);
  std::vector<bool> backward = visible(input);
  std::reverse(backward.begin(), backward.end());
  EXPECT_EQ(forward, backward);
  checked(forward.size());
}

TEST_F(CullingOcclusionLaws, WithoutOccludersEverythingIsVisible) {
  Random random(caseSeed());
  const auto kept =
      visible(occlusionInput(eye(), spheresBefore(kBlock, random), filled({61, 43}, 0)));
  for (const bool each : kept) EXPECT_TRUE(each);
  checked(kept.size());
}

}  // namespace
}  // namespace gnomon::culling
