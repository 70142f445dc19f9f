// The model of culling/occlusion against truth. No GPU.
//
// Covered: tangents against the slopes of a circle's points, and against printed widths; edges and
// depth of spheres against projected points of theirs; exact limits of the rules; levels and
// texels of a query against the pixels they have to cover; nothing that a ray sees is hidden, over
// generated scenes of every kind; walls that hide everything; a screen without occluders; the share
// of hidden objects that is found. Not covered: the pyramid itself (hiz).
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include "harness/cases/modelled.h"
#include "harness/cases/random.h"
#include "kernels/culling/camera.h"
#include "reference/bound/explore.h"
#include "reference/culling/frustum.h"
#include "reference/culling/occlusion.h"
#include "tests/culling/lists.h"
#include "tests/culling/scenes.h"

namespace gnomon::culling {
namespace {

using glm::dmat4;
using glm::dvec3;

Slopes<double> touching(double c, double d, double r) {
  return modelled("tangents", [&]<class T>() {
    return tangents<T>(given<T>(c), given<T>(d), given<T>(r), given<T>(d - r));
  });
}

Occlusion pushFor(const Scene& scene) {
  const auto n = static_cast<uint>(scene.things.size());
  return {.size = scene.size,
          .objects = n,
          .candidates = n,
          .capacity = n,
          .pad = scene.pad,
          .patience = kPatience};
}

Sight<double> sight(const Scene& scene, const Bounds& sphere, const Pyramid& pyramid) {
  const char* entry = scene.perspective() ? "sightOf" : "sightOf.orthographic";
  const Sight<double> found = modelled(
      entry, [&]<class T>() { return sightOf<T>(scene.camera, sphere, pushFor(scene), pyramid); });
  EXPECT_TRUE(found.visible == 0 || found.visible == 1);
  return found;
}

bool visible(const Scene& scene, const Bounds& sphere, const Pyramid& pyramid) {
  return sight(scene, sphere, pyramid).visible == 1;
}

bool visible(const Scene& scene, const Bounds& sphere) {
  return visible(scene, sphere, pyramidOf(scene.depth));
}

template <class F>
void forEachScene(std::size_t ofEachKind, const F& f) {
  for (int kind = 0; kind < kSceneKinds; ++kind)
    for (std::size_t i = 0; i < ofEachKind; ++i)
      f(generatedScene(static_cast<SceneKind>(kind), caseSeed() + i));
}

/// The steepest slope of a circle's points, by bisection on the angle: on either side of it slopes
/// fall.
double steepest(double c, double d, double r) {
  const auto slope = [&](double angle) {
    return (c + r * std::cos(angle)) / (d + r * std::sin(angle));
  };
  double lo = -3.14159265358979 / 2, hi = 3.14159265358979 / 2;
  for (int i = 0; i < 200; ++i) {
    const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
    (slope(a) < slope(b) ? lo : hi) = slope(a) < slope(b) ? a : b;
  }
  return slope(lo);
}

TEST(CullingOcclusionModel, TangentsAreTheSteepestSlopesOfTheSphere) {
  Random random(caseSeed());
  for (int i = 0; i < 2000; ++i) {
    const double d = random.logUniform(0.1, 100), r = d * random.uniform(0.001, 0.99);
    const double c = d * random.uniform(-3, 3);
    const Slopes<double> found = touching(c, d, r);
    // Where the slope is flat the search knows the angle to the square root of double's precision.
    EXPECT_NEAR(found.most, steepest(c, d, r), 1e-12 * (1 + std::abs(found.most)));
    EXPECT_NEAR(found.least, -steepest(-c, d, r), 1e-12 * (1 + std::abs(found.least)));
  }
}

/// Where a point of clip space, from -1 to 1, is in pixels, clamped to the screen.
double pixel(double clip, uint size) { return std::clamp((clip + 1) / 2 * size, 0.0, size - 1.0); }

/// A sphere's edges and nearest depth by the whole projection, of points on it that are found
/// without the model's tangents.
Sight<double> projected(const Scene& scene, const Bounds& sphere) {
  const dmat4 p(scene.camera.projection);
  const dvec3 c(dmat4(scene.camera.view) * glm::dvec4(sphere.centre, 1));
  const double r = double{sphere.radius} + double{scene.pad};
  const auto at = [&](const dvec3& point) {
    const glm::dvec4 clip = p * glm::dvec4(point, 1);
    return dvec3(clip) / clip.w;
  };
  const auto edge = [&](int axis, double side) {
    dvec3 point(0, 0, -1);
    point[axis] =
        scene.perspective() ? side * steepest(side * c[axis], -c.z, r) : c[axis] + side * r;
    return pixel(at(point)[axis], scene.size[axis]);
  };
  const auto [left, right] = std::minmax({edge(0, -1), edge(0, 1)});
  const auto [top, bottom] = std::minmax({edge(1, -1), edge(1, 1)});
  return {0, left, right, top, bottom, at({0, 0, c.z + r}).z};
}

/// The same things through a projection whose picture is upside down, mirrored and off the middle.
Scene turned(Scene scene) {
  const dmat4 onScreen =
      glm::translate(dmat4(1), dvec3(0.25, -0.5, 0)) * glm::scale(dmat4(1), dvec3(-1, -1, 1));
  scene.projection = onScreen * scene.projection;
  scene.camera = cameraOf(scene.view, scene.projection, scene.near);
  return scene;
}

/// Judges the spheres around a scene, and gives how many of them lie behind the near plane.
std::size_t expectEdgesAndDepth(const Scene& scene) {
  std::size_t judged = 0;
  const Pyramid pyramid = pyramidOf(scene.depth);
  for (const Bounds& sphere : spheresAround(scene, 40, caseSeed())) {
    const Sight<double> found = sight(scene, sphere, pyramid);
    if (found.depth == 0) continue;
    const Sight<double> expected = projected(scene, sphere);
    ++judged;
    // A search knows a slope to 1e-12, and centres a million units away cancel to 1e-9.
    constexpr double kClose = 1e-6;
    EXPECT_NEAR(found.left, expected.left, kClose) << nameOf(scene.kind);
    EXPECT_NEAR(found.right, expected.right, kClose) << nameOf(scene.kind);
    EXPECT_NEAR(found.top, expected.top, kClose) << nameOf(scene.kind);
    EXPECT_NEAR(found.bottom, expected.bottom, kClose) << nameOf(scene.kind);
    EXPECT_NEAR(found.depth, expected.depth, kClose) << nameOf(scene.kind);
  }
  return judged;
}

// Under every projection, on the screen, on its edges and beyond them.
TEST(CullingOcclusionModel, EdgesAndDepthAreThoseOfProjectedPoints) {
  std::size_t judged = 0;
  forEachScene(4, [&](const Scene& scene) {
    judged += expectEdgesAndDepth(scene) + expectEdgesAndDepth(turned(scene));
  });
  EXPECT_GT(judged, std::size_t{2} * kSceneKinds * 4 * 40 / 2);
}

// How much of the true width the naive 2 r / d covers; numbers computed elsewhere, to the digits
// given.
TEST(CullingOcclusionModel, WidthsAreThePrintedOnes) {
  struct Row {
    double c, d, r, naive, digits;
  };
  for (const Row& row : {Row{0, 10, 1, 0.995, 5e-4}, Row{0, 2, 1, 0.866, 5e-4},
                         Row{3, 4, 1, 0.7655, 5e-5}, Row{5, 5, 2, 0.619, 5e-4}}) {
    const Slopes<double> found = touching(row.c, row.d, row.r);
    EXPECT_NEAR(2 * row.r / row.d / (found.most - found.least), row.naive, row.digits);
  }
}

TEST(CullingOcclusionModel, TheLevelIsTheSmallestThatSpansTheRectangle) {
  const uvec2 size(1920, 1080);
  struct Row {
    std::int64_t pixels;
    uint level;
  };
  for (const Row& row : {Row{1, 0}, Row{2, 1}, Row{3, 2}, Row{4, 2}, Row{5, 3}, Row{8, 3},
                         Row{9, 4}, Row{1024, 10}, Row{1025, 10}, Row{1920, 10}}) {
    EXPECT_EQ(queryLevel({0, row.pixels - 1, 0, 0}, size), row.level) << row.pixels;
    EXPECT_EQ(queryLevel({7, 7, 100, 99 + std::min<std::int64_t>(row.pixels, 980)}, size),
              std::min(row.level, 10u))
        << row.pixels;
  }
}

Picture noise(const uvec2& size, Random& random) {
  Picture depth{size, {}};
  for (std::size_t i = 0; i < std::size_t{size.x} * size.y; ++i)
    depth.texels.emplace_back(random.uniform(), 0, 0, 0);
  return depth;
}

// Of two texels along each axis at most 2^L wide, the last one up to twice that.
TEST(CullingOcclusionModel, AQuerySeesItsPixelsAndNotManyMore) {
  Random random(caseSeed());
  for (int i = 0; i < 200; ++i) {
    const uvec2 size{1 + random.below(70), 1 + random.below(70)};
    const Picture depth = noise(size, random);
    const Pyramid pyramid = pyramidOf(depth);
    const auto smallestIn = [&](std::int64_t x0, std::int64_t x1, std::int64_t y0,
                                std::int64_t y1) {
      float least = 1;
      for (auto y = std::max<std::int64_t>(y0, 0); y <= std::min<std::int64_t>(y1, size.y - 1); ++y)
        for (auto x = std::max<std::int64_t>(x0, 0); x <= std::min<std::int64_t>(x1, size.x - 1);
             ++x)
          least = std::min(least, depth.at(static_cast<std::size_t>(y * size.x + x)).x);
      return least;
    };
    for (int j = 0; j < 20; ++j) {
      const auto below = [&](uint side) { return static_cast<std::int64_t>(random.below(side)); };
      const std::int64_t a = below(size.x), b = below(size.x);
      const std::int64_t c = below(size.y), d = below(size.y);
      const PixelRect rect{std::min(a, b), std::max(a, b), std::min(c, d), std::max(c, d)};
      const float found = farthestIn(pyramid, rect);
      EXPECT_LE(found, smallestIn(rect.x0, rect.x1, rect.y0, rect.y1));
      const std::int64_t around = std::int64_t{2} << queryLevel(rect, size);
      EXPECT_GE(found,
                smallestIn(rect.x0 - around, rect.x1 + around, rect.y0 - around, rect.y1 + around));
    }
  }
}

TEST(CullingOcclusionModel, NothingThatARaySeesIsHidden) {
  forEachScene(scenesOfEachKind(), [](const Scene& scene) {
    const Pyramid pyramid = pyramidOf(scene.depth);
    for (std::size_t i = 0; i < scene.things.size(); ++i)
      EXPECT_TRUE(!scene.seen[i] || visible(scene, scene.bounds[i], pyramid))
          << fmt::format("thing {} of a scene of kind '{}'", i, nameOf(scene.kind));
  });
}

/// A camera in the origin that looks down -Z, and one depth everywhere.
Scene before(const dmat4& projection, const uvec2& size, float depth) {
  Scene scene{.size = size, .projection = projection, .near = 0.5};
  scene.camera = cameraOf(scene.view, projection, scene.near);
  scene.depth = {size, std::vector<vec4>(std::size_t{size.x} * size.y, vec4(depth, 0, 0, 0))};
  return scene;
}

constexpr std::array kSizes = {uvec2(1, 1),      uvec2(1, 7),       uvec2(3, 5),   uvec2(1023, 767),
                               uvec2(1366, 768), uvec2(1920, 1080), uvec2(4095, 1)};

// At distance 8 an infinite projection with near 0.5 has depth 1/16.
TEST(CullingOcclusionModel, AWallHidesEverythingBehindItAtEverySize) {
  Random random(caseSeed());
  for (const uvec2 size : kSizes) {
    const Scene scene = before(perspective(1.2, 1.5, 0.5), size, 1 / 16.0f);
    const Pyramid pyramid = pyramidOf(scene.depth);
    for (int i = 0; i < 50; ++i) {
      const double r = random.logUniform(0.01, 30), d = 8 + r;
      const vec3 beside(random.uniform(-2, 2) * d, random.uniform(-2, 2) * d, 0);
      const auto at = [&](double distance) {
        return Bounds{beside - vec3(0, 0, distance), static_cast<float>(r)};
      };
      EXPECT_FALSE(visible(scene, at(1.001 * d), pyramid));
      EXPECT_TRUE(visible(scene, at(0.999 * d), pyramid));
    }
  }
}

TEST(CullingOcclusionModel, AParallelWallHidesEverythingBehindIt) {
  Random random(caseSeed());
  // Depth is (far - distance) / (far - near): 1/2 at 8.25.
  const Scene scene = before(orthographic(-9, 5, -3, 4, 0.5, 16), {61, 33}, 0.5f);
  const Pyramid pyramid = pyramidOf(scene.depth);
  for (int i = 0; i < 200; ++i) {
    const double r = random.logUniform(0.01, 4), x = random.uniform(-12, 8);
    const auto at = [&](double nearest) {
      return Bounds{vec3(x, random.uniform(-5, 5), -nearest - r), static_cast<float>(r)};
    };
    EXPECT_FALSE(visible(scene, at(8.26), pyramid));
    EXPECT_TRUE(visible(scene, at(8.24), pyramid));
  }
}

// One pixel of sky in a wall: what covers it is visible, what is a pixel beside it is not.
TEST(CullingOcclusionModel, AHoleShowsWhatIsBehindItAndNothingBeside) {
  const double half = std::tan(0.6), distance = 20;
  const uint pixels = 64;
  Scene scene = before(perspective(1.2, 1, 0.5), uvec2(pixels), 1 / 16.0f);
  const uint x = 21, y = 42;
  scene.depth.texels[y * pixels + x].x = 0;
  const auto at = [&](double px, double py) {  // y downward on the screen
    const double pixel = 2 * half * distance / pixels;
    return Bounds{{(px - pixels / 2.0) * pixel, (pixels / 2.0 - py) * pixel, -distance},
                  static_cast<float>(0.3 * pixel)};
  };
  EXPECT_TRUE(visible(scene, at(x + 0.5, y + 0.5)));
  for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}})
    EXPECT_FALSE(visible(scene, at(x + 0.5 + dx, y + 0.5 + dy))) << dx << " " << dy;
}

TEST(CullingOcclusionModel, WithoutOccludersNothingIsHidden) {
  Random random(caseSeed());
  const Scene scene = before(perspective(1.2, 1.5, 0.5), {64, 48}, 0);
  const Pyramid pyramid = pyramidOf(scene.depth);
  for (int i = 0; i < 500; ++i) {
    const double d = random.logUniform(0.1, 1e6), r = d * random.uniform();
    EXPECT_TRUE(visible(scene, {vec3(d * random.direction()), static_cast<float>(r)}, pyramid));
  }
}

// An object that reaches before the near plane, holds the camera, or lies at its side.
TEST(CullingOcclusionModel, WhatReachesBeforeTheNearPlaneIsVisible) {
  const Scene scene = before(perspective(1.2, 1.5, 0.5), {64, 48}, 1);
  EXPECT_FALSE(visible(scene, {{0, 0, -1.5625f}, 1}));
  EXPECT_TRUE(visible(scene, {{0, 0, -1.4375f}, 1}));
  EXPECT_TRUE(visible(scene, {{0.5f, 0, 0.25f}, 2}));
  EXPECT_TRUE(visible(scene, {{3, 0, 5}, 1}));
  EXPECT_TRUE(visible(scene, {{2.0f * kSteepest, 0, -1.0f}, 0.25f}));
}

// On exact numbers. Behind a depth that no scene has, beyond the near plane's own of 1.
TEST(CullingOcclusionModel, WhatTouchesTheNearPlaneDoesNotReachBeforeIt) {
  for (const dmat4& projection : {perspective(1.2, 1.5, 0.5), orthographic(-9, 5, -3, 4, 0.5, 16)})
    EXPECT_FALSE(visible(before(projection, {64, 48}, 1.5f), {{0, 0, -1.5f}, 1}));
}

// What the algorithm finds of what is hidden depends on the scenes: of these, which are the same
// for every --seed and --cases, it is on record, so that a change of the rules shows.
TEST(CullingOcclusionModel, TheShareOfHiddenThingsFoundIsAsRecorded) {
  constexpr std::uint64_t kFirst = 1;
  const Policy& policy = Session::current().policy();
  const auto scenes = static_cast<std::uint64_t>(policy["cullingScenes"]) / kSceneKinds;
  std::size_t hidden = 0, found = 0;
  for (std::uint64_t s = kFirst; s < kFirst + scenes; ++s) {
    const Scene scene = generatedScene(SceneKind::kOccluders, s);
    const Pyramid pyramid = pyramidOf(scene.depth);
    for (std::size_t i = 0; i < scene.things.size(); ++i) {
      const Frustum push{0, 0, 0, scene.pad, 0};
      if (scene.seen[i] || inFrustum<double>(scene.camera, scene.bounds[i], push) == 0) continue;
      ++hidden;
      found += !visible(scene, scene.bounds[i], pyramid);
    }
  }
  // Three digits are recorded; another libm may decide two or three things otherwise.
  EXPECT_NEAR(static_cast<double>(found) / static_cast<double>(hidden),
              policy["cullingHiddenShare"], 0.002)
      << found << " of " << hidden;
}

// On exact numbers: a depth that is the sphere's own does not hide it, the next one does.
TEST(CullingOcclusionModel, ADepthThatIsTheSpheresOwnDoesNotHideIt) {
  for (const bool perspective : {false, true}) {
    // Depth at distance 8: 1/16, and (16.5 - 8) / 16.
    const Scene flat = before(orthographic(-8, 8, -8, 8, 0.5, 16.5), {16, 16}, 8.5f / 16);
    const Scene deep = before(culling::perspective(1.2, 1.5, 0.5), {16, 16}, 1 / 16.0f);
    const Scene& scene = perspective ? deep : flat;
    const Pyramid pyramid = pyramidOf(scene.depth);
    EXPECT_TRUE(visible(scene, {{0.5f, 0.5f, -9}, 1}, pyramid));
    EXPECT_FALSE(visible(scene, {{0.5f, 0.5f, -9.0009765625f}, 1}, pyramid));
  }
}

// Of a parallel projection nothing is too far to the side.
TEST(CullingOcclusionModel, FarToTheSideIsVisibleInPerspectiveAlone) {
  const Scene scene = before(perspective(1.2, 1.5, 0.5), {64, 48}, 1);
  const Pyramid pyramid = pyramidOf(scene.depth);
  for (const float side : {-1.0f, 1.0f})
    for (const int axis : {0, 1}) {
      const auto at = [&](float distance) {
        vec3 centre(0, 0, -1);
        centre[axis] = side * distance;
        return Bounds{centre, 0.25f};
      };
      EXPECT_FALSE(visible(scene, at(kSteepest), pyramid));
      EXPECT_TRUE(visible(scene, at(kSteepest + 1), pyramid));
      const Bounds farther{4.0f * at(kSteepest).centre, 0.25f};
      EXPECT_FALSE(visible(scene, farther, pyramid));
      const Scene flat = before(orthographic(-9, 5, -3, 4, 0.5, 16), {61, 33}, 1);
      EXPECT_FALSE(visible(flat, at(kSteepest + 1)));
    }
}

// The interval holds the double, and is one number wherever rounding does not decide.
TEST(CullingOcclusionModel, BoundsAreUndecidedOnlyAtTheEdge) {
  std::size_t all = 0, undecided = 0;
  forEachScene(10, [&](const Scene& scene) {
    const Pyramid pyramid = pyramidOf(scene.depth);
    const Occlusion push = pushFor(scene);
    for (const Bounds& sphere : scene.bounds) {
      const double plain = unoccluded<double>(scene.camera, sphere, push, pyramid);
      const Bounded may =
          explore([&] { return unoccluded<Bounded>(scene.camera, sphere, push, pyramid); });
      EXPECT_TRUE(may.lo <= plain && plain <= may.hi);
      ++all;
      undecided += may.lo != may.hi;
    }
  });
  EXPECT_LT(static_cast<double>(undecided), 0.01 * static_cast<double>(all));
}

}  // namespace
}  // namespace gnomon::culling
