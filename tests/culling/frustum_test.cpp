// culling/frustum and culling/frustum_subgroups against their model, and by laws and truth.
//
// Covered: spheres of every size under every projection, on planes exactly and around them, as sets
// of what must and may be listed; the list's order, records, tail, capacity, tally; numbers of
// objects around a block's, and none; groups that ask each other and groups that count again; bad
// bounds; casters before the near plane; nothing that a ray sees is culled. The path with subgroups
// repeats what the compaction is about.
// Not covered: drawing the list (draws_test.cpp).
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "kernels/culling/camera.h"
#include "tests/culling/lists.h"

namespace gnomon::culling {
namespace {

/// The unit's camera: exact planes x, y = -+2, z = -1 and -9.
Camera box() { return cameraOf(glm::dmat4(1), orthographic(-2, 2, -2, 2, 1, 9), 1); }

/// Every third one is visible.
std::vector<Bounds> everyThird(std::size_t n) {
  std::vector<Bounds> all;
  for (std::size_t i = 0; i < n; ++i) all.push_back({{i % 3 == 0 ? 0.0f : 50.0f, 0, -5}, 1});
  return all;
}

class FrustumCase : public ListCase {
 protected:
  using ListCase::ListCase;

  void everySizeAroundABlockIsListed() {
    widthDoesNotMatter();
    for (const std::size_t n :
         {std::size_t{0}, std::size_t{1}, std::size_t{kGroupSize - 1}, std::size_t{kGroupSize},
          std::size_t{kBlock - 1}, std::size_t{kBlock}, std::size_t{kBlock + 1},
          std::size_t{3 * kBlock + 7}})
      expectRightList(frustumInput(box(), everyThird(n)));
  }

  void aFullListKeepsTheFirst() {
    const std::size_t n = 2 * kBlock + 100;
    const uint found = (n + 2) / 3;
    for (const uint capacity : {0u, 1u, found - 1, found, found + 1, 5u}) {
      FrustumInput input = frustumInput(box(), everyThird(n));
      input.push.capacity = capacity;
      expectRightList(input);
      expectRightTally(input);
    }
  }

  void blocksAreCountedByWhoeverAsksNobody() {
    for (const std::size_t n : {std::size_t{kBlock}, std::size_t{3 * kBlock + 1}}) {
      FrustumInput input = frustumInput(box(), everyThird(n));
      expectRightTally(input);
      input.push.patience = 0;
      expectRightList(input);
      expectRightTally(input);
    }
  }

  /// A thread then asks more than one group, with what is left of its patience.
  void moreBlocksThanThreadsAreListed() {
    widthDoesNotMatter();
    const FrustumInput input = frustumInput(box(), everyThird(kMoreThanThreads));
    expectEveryThird(visible(input));
    expectAnswers(input);
  }

  /// As a host starts that does not know how many objects there will be.
  void groupsWithoutABlockDoNothing() {
    widthDoesNotMatter();
    for (const std::size_t n : {std::size_t{0}, std::size_t{kBlock}, kBlock + std::size_t{1}}) {
      FrustumInput input = frustumInput(box(), everyThird(n));
      input.idleGroups = 3;
      expectRightList(input);
      expectRightTally(input);
    }
  }

  void groupsThatAskAreAnswered() { expectAnswers(frustumInput(box(), everyThird(3 * kBlock))); }

  void manySpheresAreListedAsTheModelSays() {
    widthDoesNotMatter();
    const std::size_t n = generated("elementsPerDomain") / 4;
    for (const SceneKind kind :
         {SceneKind::kField, SceneKind::kOffAxis, SceneKind::kInfinite, SceneKind::kOrthographic}) {
      const Scene scene = generatedScene(kind, caseSeed());
      expectRightList(frustumInput(scene.camera, spheresAround(scene, n, caseSeed()), scene.pad));
    }
  }
};

class CullingFrustum : public FrustumCase {
 protected:
  CullingFrustum() : FrustumCase("culling/frustum") {}
};

class CullingFrustumSubgroups : public FrustumCase {
 protected:
  CullingFrustumSubgroups() : FrustumCase("culling/frustum_subgroups") {}
};

class CullingFrustumLaws : public CullingFrustum {
 protected:
  void SetUp() override {
    CullingFrustum::SetUp();
    widthDoesNotMatter();
  }
};

TEST_F(CullingFrustum, EverySizeAroundABlockIsListed) { everySizeAroundABlockIsListed(); }
TEST_F(CullingFrustumSubgroups, EverySizeAroundABlockIsListed) { everySizeAroundABlockIsListed(); }

TEST_F(CullingFrustum, AFullListKeepsTheFirst) { aFullListKeepsTheFirst(); }
TEST_F(CullingFrustumSubgroups, AFullListKeepsTheFirst) { aFullListKeepsTheFirst(); }

TEST_F(CullingFrustum, BlocksAreCountedByWhoeverAsksNobody) {
  blocksAreCountedByWhoeverAsksNobody();
}
TEST_F(CullingFrustumSubgroups, BlocksAreCountedByWhoeverAsksNobody) {
  blocksAreCountedByWhoeverAsksNobody();
}

TEST_F(CullingFrustum, GroupsThatAskAreAnswered) {
  widthDoesNotMatter();
  groupsThatAskAreAnswered();
}
TEST_F(CullingFrustumSubgroups, GroupsThatAskAreAnswered) {
  widthDoesNotMatter();
  groupsThatAskAreAnswered();
}

TEST_F(CullingFrustum, MoreBlocksThanThreadsAreListed) { moreBlocksThanThreadsAreListed(); }
TEST_F(CullingFrustumSubgroups, MoreBlocksThanThreadsAreListed) {
  moreBlocksThanThreadsAreListed();
}

TEST_F(CullingFrustum, GroupsWithoutABlockDoNothing) { groupsWithoutABlockDoNothing(); }

TEST_F(CullingFrustum, ManySpheresAreListedAsTheModelSays) { manySpheresAreListedAsTheModelSays(); }
TEST_F(CullingFrustumSubgroups, ManySpheresAreListedAsTheModelSays) {
  manySpheresAreListedAsTheModelSays();
}

// On a grid of quarters everything is exact: nothing here may be decided either way.
TEST_F(CullingFrustum, TouchingAPlaneIsVisible) {
  widthDoesNotMatter();
  std::vector<Bounds> all;
  for (const float radius : {0.0f, 0.25f, 1.0f, 3.0f})
    for (const float off : {-0.25f, 0.0f, 0.25f}) {
      const float side = 2 + radius + off;
      all.push_back({{side, 0.5f, -5}, radius});
      all.push_back({{-side, 0.5f, -5}, radius});
      all.push_back({{0.5f, side, -5}, radius});
      all.push_back({{0.5f, -side, -5}, radius});
      all.push_back({{0.5f, 0.5f, -1 + radius + off}, radius});
      all.push_back({{0.5f, 0.5f, -9 - radius - off}, radius});
    }
  for (const float pad : {0.0f, 0.125f, 0.25f}) expectRightList(frustumInput(box(), all, pad));
}

// One world unit before the near plane, and behind the far one.
TEST_F(CullingFrustum, CastersBeforeTheNearPlaneCountWhereAskedFor) {
  widthDoesNotMatter();
  const std::vector<Bounds> all = {
      {{0, 0, 3}, 1}, {{0, 0, -5}, 1}, {{0, 0, -12}, 1}, {{9, 0, 3}, 1}, {{0, 0, 300}, 1}};
  for (const uint off : {0u, 1u, 7u}) {
    FrustumInput input = frustumInput(box(), all);
    input.push.noNearPlane = off;
    expectRightList(input);
  }
}

TEST_F(CullingFrustum, BadBoundsAreVisible) {
  widthDoesNotMatter();
  std::vector<Bounds> all;
  const float more = std::nextafter(kMostWorld, 2 * kMostWorld);
  for (const float x :
       specialFloats({kMostWorld, -kMostWorld, more, -more, 2 * kMostWorld, -1.0f, 50.0f})) {
    all.push_back({{x, 50, -5}, 1});
    all.push_back({{50, x, -5}, 1});
    all.push_back({{50, 0, x}, 1});
    all.push_back({{50, 0, -5}, x});
  }
  expectRightList(frustumInput(box(), all));
  // Along a diagonal a plane is farther away than any radius reaches that counts.
  const glm::dmat4 turned = glm::rotate(glm::dmat4(1), 0.785398, glm::dvec3(0, 0, 1));
  const Camera diagonal = cameraOf(turned, orthographic(-2, 2, -2, 2, 1, 9), 1);
  const vec3 far(kMostWorld, kMostWorld, -5);
  expectRightList(frustumInput(diagonal, {{far, kMostWorld}, {far, more}, {-far, more}}));
}

TEST_F(CullingFrustum, NothingThatARaySeesIsCulled) {
  widthDoesNotMatter();
  const std::size_t count = scenesOfEachKind();
  for (int kind = 0; kind < kSceneKinds; ++kind)
    for (std::size_t s = 0; s < count; ++s) {
      const Scene scene = generatedScene(static_cast<SceneKind>(kind), caseSeed() + s);
      const auto kept = quicklyVisible(frustumInput(scene.camera, scene.bounds, scene.pad));
      for (std::size_t i = 0; i < kept.size(); ++i)
        EXPECT_TRUE(kept[i] || !scene.seen[i])
            << fmt::format("object {} of scene {} of kind '{}' has visible pixels and is culled", i,
                           s, nameOf(scene.kind));
      checked(kept.size());
    }
}

TEST_F(CullingFrustumLaws, TheOrderOfObjectsChangesNothing) {
  const Scene scene = generatedScene(SceneKind::kField, caseSeed());
  std::vector<Bounds> all = spheresAround(scene, 2 * kBlock + 5, caseSeed());
  const std::vector<bool> forward = visible(frustumInput(scene.camera, all));
  std::ranges::reverse(all);
  std::vector<bool> backward = visible(frustumInput(scene.camera, all));
  std::reverse(backward.begin(), backward.end());  // vector<bool> is no range of std::ranges here
  EXPECT_EQ(forward, backward);
  checked(all.size());
}

TEST_F(CullingFrustumLaws, CullingTwiceChangesNothing) {
  const Scene scene = generatedScene(SceneKind::kInfinite, caseSeed());
  const std::vector<Bounds> all = spheresAround(scene, 2 * kBlock, caseSeed());
  const std::vector<bool> once = visible(frustumInput(scene.camera, all));
  std::vector<Bounds> kept;
  for (std::size_t i = 0; i < once.size(); ++i)
    if (once[i]) kept.push_back(all[i]);
  ASSERT_GT(kept.size(), all.size() / 10);
  for (const bool again : visible(frustumInput(scene.camera, kept))) EXPECT_TRUE(again);
  checked(kept.size());
}

TEST_F(CullingFrustumLaws, AWiderPadNeverCullsMore) {
  const Scene scene = generatedScene(SceneKind::kField, caseSeed());
  const std::vector<Bounds> all = spheresAround(scene, kBlock, caseSeed());
  std::vector<bool> before(all.size());
  for (const float pad : {0.0f, 0.1f, 1.0f, 100.0f}) {
    const std::vector<bool> now = visible(frustumInput(scene.camera, all, pad));
    for (std::size_t i = 0; i < now.size(); ++i) EXPECT_LE(before[i], now[i]) << pad;
    before = now;
    checked(all.size());
  }
}

}  // namespace
}  // namespace gnomon::culling
