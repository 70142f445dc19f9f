// The worlds that culling is timed in. No GPU.
//
// Covered: they are the same for the same seed; spheres hold their boxes; in the city most of what
// is before the camera is hidden and in the field little, at every size; depth at pixels against
// every box in double; CPU modes and the model of the frustum agree. Not covered: time.
#include <algorithm>
#include <span>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "harness/cases/random.h"
#include "reference/culling/frustum.h"
#include "tests/culling/scenes.h"
#include "tests/culling/worlds.h"

namespace gnomon::culling {
namespace {

using glm::dvec3;
using glm::dvec4;

constexpr WorldKind kKinds[] = {WorldKind::kCity, WorldKind::kField};

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return std::ranges::equal(std::as_bytes(std::span(a)), std::as_bytes(std::span(b)));
}

TEST(CullingFrustumWorldModel, IsTheSameForTheSameSeedAndHasThatManyObjects) {
  for (const WorldKind kind : kKinds)
    for (const std::size_t objects : {0u, 1u, 16u, 17u, 1000u}) {
      const World a = world(kind, objects, 1), b = world(kind, objects, 1);
      EXPECT_EQ(a.bounds.size(), objects) << nameOf(kind);
      EXPECT_EQ(a.commands.size(), objects) << nameOf(kind);
      EXPECT_TRUE(sameBytes(a.bounds, b.bounds)) << nameOf(kind);
      EXPECT_EQ(sameBytes(a.bounds, world(kind, objects, 2).bounds), objects == 0) << nameOf(kind);
    }
}

TEST(CullingFrustumWorldModel, SpheresHoldTheirBoxesAndTheCameraIsInNone) {
  for (const WorldKind kind : kKinds) {
    const World w = world(kind, 10'000, 1);
    const dvec3 eye(glm::inverse(w.view)[3]);
    for (const Occluder& o : w.occluders) {
      const Bounds& b = w.bounds[o.object];
      for (const dvec3& corner : {o.box.lo, o.box.hi, dvec3(o.box.lo.x, o.box.hi.y, o.box.lo.z)})
        EXPECT_LE(glm::length(corner - dvec3(b.centre)), double{b.radius}) << nameOf(kind);
      EXPECT_NE(glm::clamp(eye, o.box.lo, o.box.hi), eye) << nameOf(kind);
    }
  }
}

TEST(CullingFrustumWorldModel, CpuModesSeeWhatTheModelSees) {
  for (const WorldKind kind : kKinds) {
    const World w = world(kind, 10'000, 1);
    const Frustum push{
        .count = 10'000, .capacity = 10'000, .noNearPlane = 0, .pad = w.pad, .patience = 0};
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < w.bounds.size(); ++i)
      if (inFrustum<double>(w.camera, w.bounds[i], push) == 1) expected.push_back(i);
    const SphereTree tree(w.bounds);
    EXPECT_EQ(tree.cull(CullMode::kFrustum, w.query()), expected) << nameOf(kind);
    EXPECT_EQ(tree.cull(CullMode::kBvh, w.query()), expected) << nameOf(kind);
  }
}

/// Of what is in the frustum, the share that the model of occlusion finds hidden.
double hiddenShare(const World& w, const uvec2& size) {
  const Pyramid pyramid = pyramidOf(depthOf(w, size));
  const auto n = static_cast<uint>(w.bounds.size());
  const Occlusion push{
      .size = size, .objects = n, .candidates = n, .capacity = n, .pad = w.pad, .patience = 0};
  const auto inside = SphereTree(w.bounds).cull(CullMode::kBvh, w.query());
  const auto hidden = std::ranges::count_if(inside, [&](std::uint32_t i) {
    return unoccluded<double>(w.camera, w.bounds[i], push, pyramid) == 0;
  });
  return static_cast<double>(hidden) / static_cast<double>(inside.size());
}

TEST(CullingOcclusionWorldModel, HidesMostOfACityAndLittleOfAField) {
  // Most is more than half, little less than a quarter.
  for (const std::size_t objects : {1000u, 10'000u, 100'000u}) {
    EXPECT_GT(hiddenShare(world(WorldKind::kCity, objects, 1), {480, 270}), 0.5) << objects;
    EXPECT_LT(hiddenShare(world(WorldKind::kField, objects, 1), {480, 270}), 0.25) << objects;
  }
}

/// Depth at a pixel's centre, of every box in world space: unprojects two points of the ray.
float depthByEveryBox(const World& w, const uvec2& size, uint x, uint y) {
  const glm::dmat4 toWorld = glm::inverse(w.projection * w.view);
  const auto unprojected = [&](double z) {
    const dvec4 p = toWorld * dvec4((2.0 * x + 1) / size.x - 1, (2.0 * y + 1) / size.y - 1, z, 1);
    return dvec3(p) / p.w;
  };
  const dvec3 near = unprojected(1), ray = unprojected(0.5) - near;  // 0.5: twice as far as near
  std::optional<double> first;
  for (const Occluder& o : w.occluders)
    if (const auto t = meets(o.box, near, ray, 0); t && (!first || *t < *first)) first = t;
  if (!first) return 0;
  const dvec4 clip = w.projection * w.view * dvec4(near + *first * ray, 1);
  return static_cast<float>(clip.z / clip.w);
}

TEST(CullingOcclusionWorldModel, DepthIsWhatARayFindsAmongAllBoxes) {
  constexpr int kPixels = 500;
  const uvec2 size{320, 181};  // odd, and not the camera's 16 to 9
  for (const WorldKind kind : kKinds) {
    const World w = world(kind, 3000, 1);
    const Picture depth = depthOf(w, size);
    Random random(1);
    int sky = 0;
    for (int i = 0; i < kPixels; ++i) {
      const auto x = static_cast<uint>(random.below(size.x));
      const auto y = static_cast<uint>(random.below(size.y));
      const float expected = depthByEveryBox(w, size, x, y);
      sky += expected == 0;
      // Both in double from different points of the ray, a thousand near planes away at most: a
      // float apart.
      ASSERT_NEAR(depth.at(std::size_t{y} * size.x + x).x, expected, 0x1p-23 * expected)
          << nameOf(kind) << fmt::format(" at ({}, {})", x, y);
    }
    EXPECT_GT(sky, 0) << nameOf(kind);
    EXPECT_LT(sky, kPixels) << nameOf(kind);
  }
}

}  // namespace
}  // namespace gnomon::culling
