// Culling on the CPU. Covered: the hierarchy gives the set that a test of every sphere in double
// gives, on random and degenerate scenes; it looks at little where little is visible; rays through
// boxes against every box. Not covered: time; the planes themselves (kernels/culling/camera.h).
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <gtest/gtest.h>

#include "harness/cases/random.h"
#include "reference/culling/bvh.h"

namespace gnomon::culling {
namespace {

/// A frustum with its apex at `eye`, by cross products of its edges; half angles of tangent
/// `slope`.
Camera looking(const glm::dvec3& eye, const glm::dvec3& ahead, double slope, double far) {
  glm::dvec3 right, up;
  frameAround(-ahead, right, up);
  const auto through = [&](const glm::dvec3& inward, const glm::dvec3& point) {
    const glm::dvec3 n = glm::normalize(inward);
    return vec4(glm::dvec4(n, -glm::dot(n, point)));
  };
  Camera camera{};
  camera.left = through(right + slope * ahead, eye);
  camera.right = through(-right + slope * ahead, eye);
  camera.bottom = through(up + slope * ahead, eye);
  camera.top = through(-up + slope * ahead, eye);
  camera.nearPlane = through(ahead, eye + 0.1 * ahead);
  if (std::isfinite(far)) camera.farPlane = through(-ahead, eye + far * ahead);
  return camera;
}

/// The contract's sentence, word by word.
bool isSeen(const Bounds& b, const FrustumQuery& q) {
  for (const float x : {b.centre.x, b.centre.y, b.centre.z, b.radius})
    if (!(std::abs(x) <= kMostWorld)) return true;
  if (b.radius < 0) return true;
  std::vector<vec4> planes = {q.camera.left, q.camera.right, q.camera.bottom, q.camera.top,
                              q.camera.farPlane};
  if (!q.noNearPlane) planes.push_back(q.camera.nearPlane);
  return std::ranges::all_of(planes, [&](const vec4& p) {
    const double distance = glm::dot(glm::dvec3(glm::dvec4(p)), glm::dvec3(b.centre)) + double{p.w};
    return distance >= -(double{b.radius} + double{q.pad});
  });
}

std::vector<std::uint32_t> seen(const std::vector<Bounds>& bounds, const FrustumQuery& query) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < bounds.size(); ++i)
    if (isSeen(bounds[i], query)) list.push_back(i);
  return list;
}

Bounds sphere(const glm::dvec3& centre, double radius) {
  return {vec3(centre), static_cast<float>(radius)};
}

glm::dvec3 inCube(Random& random, double half) {
  return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

using Scene = std::function<Bounds(Random&)>;

std::vector<Bounds> many(std::size_t n, Random& random, const Scene& scene) {
  std::vector<Bounds> bounds(n);
  for (Bounds& b : bounds) b = scene(random);
  return bounds;
}

FrustumQuery anyQuery(Random& random, double half) {
  return {.camera = looking(inCube(random, half), random.direction(), random.logUniform(0.05, 4),
                            random.chance(0.5) ? random.uniform(0.2, 3 * half)
                                               : std::numeric_limits<double>::infinity()),
          .pad = random.chance(0.5) ? 0 : static_cast<float>(random.logUniform(1e-6, 1)),
          .noNearPlane = random.chance(0.3)};
}

void expectAgreement(const std::vector<Bounds>& bounds, const FrustumQuery& query,
                     const char* scene) {
  const SphereTree tree(bounds);
  const auto expected = seen(bounds, query);
  ASSERT_EQ(tree.cull(CullMode::kFrustum, query), expected) << scene << ", " << bounds.size();
  ASSERT_EQ(tree.cull(CullMode::kBvh, query), expected) << scene << ", " << bounds.size();
  ASSERT_EQ(tree.cull(CullMode::kNone, query).size(), bounds.size()) << scene;
}

void expectAgreementOnMany(const char* name, double half, const Scene& scene) {
  constexpr int kScenes = 1000;
  constexpr std::size_t kMost = 300;  // enough for seven levels of nodes
  Random random(1);
  for (int i = 0; i < kScenes && !testing::Test::HasFatalFailure(); ++i)
    expectAgreement(many(random.below(kMost), random, scene), anyQuery(random, half), name);
}

TEST(CullingBvh, AgreesWithATestOfEverySphereOnRandomScenes) {
  expectAgreementOnMany("cube", 10,
                        [](Random& r) { return sphere(inCube(r, 10), r.logUniform(1e-3, 3)); });
}

TEST(CullingBvh, AgreesOnDegenerateScenes) {
  expectAgreementOnMany("one point", 10, [](Random&) { return sphere({1, -2, 3}, 0.5); });
  expectAgreementOnMany("points", 10, [](Random& r) { return sphere(inCube(r, 10), 0); });
  expectAgreementOnMany("a line", 10, [](Random& r) {
    return sphere({0, r.uniform(-10, 10), 0}, 0.1);
  });
  expectAgreementOnMany("huge ratios", 1e6, [](Random& r) {
    return sphere(r.direction() * r.logUniform(1e-30, 1e12), r.logUniform(1e-30, 1e10));
  });
  expectAgreementOnMany("around the limit", 10, [](Random& r) {
    return sphere(r.direction() * r.logUniform(1, 4.0 * kMostWorld),
                  r.logUniform(1, 4.0 * kMostWorld));
  });
}

TEST(CullingBvh, AgreesOnSpheresThatJustTouchAPlane) {
  // Each sphere's radius is its distance to a plane, or a float next to it.
  constexpr int kScenes = 1000;
  constexpr std::size_t kSpheres = 64;
  Random random(2);
  for (int i = 0; i < kScenes && !HasFatalFailure(); ++i) {
    FrustumQuery query = anyQuery(random, 10);
    query.pad = 0;
    // Along an axis a box touches where its sphere does; else it reaches farther.
    if (random.chance(0.5)) {
      glm::vec4 plane(0, 0, 0, random.uniform(-5, 5));
      plane[static_cast<int>(random.below(3))] = random.chance(0.5) ? 1 : -1;
      query.camera.left = plane;
    }
    const vec4 plane = random.chance(0.5) ? query.camera.left : query.camera.nearPlane;
    const auto bounds = many(kSpheres, random, [&](Random& r) {
      Bounds b = sphere(inCube(r, 10), 0);
      const double distance =
          glm::dot(glm::dvec3(glm::dvec4(plane)), glm::dvec3(b.centre)) + double{plane.w};
      b.radius = static_cast<float>(std::abs(distance));
      if (r.chance(0.5)) b.radius = std::nextafter(b.radius, r.chance(0.5) ? 1e30f : 0.0f);
      return b;
    });
    expectAgreement(bounds, query, "touching");
  }
}

TEST(CullingBvh, SeesWhateverHasBadBounds) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float most = std::nextafter(kMostWorld, kInfinity);
  const std::vector<Bounds> bounds = {
      {{kNan, 0, 0}, 1}, {{0, kInfinity, 0}, 1}, {{0, 0, 0}, -1},   {{0, 0, 0}, kNan},
      {{0, 0, most}, 0}, {{0, 0, 0}, most},      {{0, 0, -50}, 1},  {{0, 0, -50}, kInfinity},
      {{0, 0, -50}, 0},  {{0, 0, 0}, -kNan},     {{-most, 0, 0}, 0}};
  // Looks away from what is at -50.
  const FrustumQuery query{.camera = looking({0, 0, 0}, {0, 0, 1}, 1, 100)};
  expectAgreement(bounds, query, "bad bounds");
  EXPECT_EQ(SphereTree(bounds).cull(CullMode::kBvh, query).size(), bounds.size() - 2);
}

TEST(CullingBvh, TakesNoObjectAndOne) {
  const FrustumQuery query{.camera = looking({0, 0, 0}, {0, 0, -1}, 1, 100)};
  expectAgreement({}, query, "none");
  expectAgreement({sphere({0, 0, -10}, 1)}, query, "one before the camera");
  expectAgreement({sphere({0, 0, 10}, 1)}, query, "one behind it");
  EXPECT_EQ(SphereTree(std::vector{sphere({0, 0, -10}, 1)}).cull(CullMode::kBvh, query).size(), 1u);
}

TEST(CullingBvh, LooksAtLittleWhereLittleIsVisible) {
  constexpr std::size_t kSpheres = 100'000;
  Random random(3);
  const auto bounds = many(kSpheres, random, [](Random& r) { return sphere(inCube(r, 100), 0.1); });
  const SphereTree tree(bounds);
  Visits visits;
  // A cone of half angle 1/20 from a corner's depth sees less than a part in two hundred.
  const FrustumQuery narrow{.camera = looking({0, 0, 0}, {0, 0, -1}, 0.05, 100)};
  const auto visible = tree.cull(CullMode::kBvh, narrow, &visits);
  EXPECT_GT(visible.size(), 0u);
  EXPECT_LT(visits.nodes + visits.spheres, kSpheres / 20);
  // All is inside every plane: the root says so.
  const FrustumQuery wide{.camera = looking({0, 0, 1000}, {0, 0, -1}, 1, 10'000)};
  EXPECT_EQ(tree.cull(CullMode::kBvh, wide, &visits).size(), kSpheres);
  EXPECT_EQ(visits.nodes, 1u);
  EXPECT_EQ(visits.spheres, 0u);
  const FrustumQuery away{.camera = looking({0, 0, 1000}, {0, 0, 1}, 1, 10'000)};
  EXPECT_TRUE(tree.cull(CullMode::kBvh, away, &visits).empty());
  EXPECT_EQ(visits.nodes, 1u);
}

TEST(CullingHierarchy, IsShallowAndHoldsEveryBoxOnce) {
  // Each box is three times as far out as the one before: the heuristic alone would peel off a few
  // at a time.
  std::vector<Box> boxes;
  for (double x = 1e-35; x < 1e35; x *= 3)
    for (int i = 0; i < 20; ++i) boxes.push_back({glm::dvec3(x), glm::dvec3(x * 1.01)});
  const Hierarchy hierarchy(boxes);
  std::vector<std::uint32_t> order = hierarchy.order();
  std::ranges::sort(order);
  ASSERT_EQ(order.size(), boxes.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
  const std::vector<Hierarchy::Node>& nodes = hierarchy.nodes();
  std::vector<unsigned> depth(nodes.size());
  for (std::uint32_t n = 0; n < nodes.size(); ++n)
    if (nodes[n].second != 0) depth[n + 1] = depth[nodes[n].second] = depth[n] + 1;
  // Twice the ideal depth by the heuristic, and the ideal one again by the median.
  EXPECT_LE(std::ranges::max(depth), 3u * static_cast<unsigned>(std::bit_width(boxes.size())));
  for (const Hierarchy::Node& node : nodes)
    for (std::uint32_t i = node.first; i < node.last; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const Box& box = boxes[hierarchy.order()[i]];
        ASSERT_LE(double{node.lo[axis]}, box.lo[axis]);
        ASSERT_GE(double{node.hi[axis]}, box.hi[axis]);
      }
}

/// A box's surfaces by its six planes, each with the point of the ray on it.
std::optional<double> bySides(const Box& box, const glm::dvec3& origin, const glm::dvec3& direction,
                              double least) {
  std::optional<double> first;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {box.lo[axis], box.hi[axis]}) {
      const double t = (side - origin[axis]) / direction[axis];
      glm::dvec3 point = origin + t * direction;
      point[axis] = side;
      const bool on = point == glm::clamp(point, box.lo, box.hi);
      if (on && t >= least && (!first || t < *first)) first = t;
    }
  return first;
}

TEST(CullingRays, FindTheFirstSurfaceOfEveryBox) {
  constexpr int kScenes = 200, kRays = 50;
  Random random(4);
  for (int s = 0; s < kScenes; ++s) {
    std::vector<Box> boxes(random.below(100));
    for (Box& b : boxes) {
      const glm::dvec3 centre = inCube(random, 10);
      const glm::dvec3 half(random.uniform(0.1, 2), random.uniform(0.1, 2), random.uniform(0, 2));
      b = {centre - half, centre + half};
    }
    const BoxScene scene(boxes);
    for (int r = 0; r < kRays; ++r) {
      const glm::dvec3 origin = inCube(random, 12), direction = random.direction();
      const double least = random.uniform(0, 3);
      std::optional<double> expected;
      for (const Box& b : boxes)
        if (const auto t = bySides(b, origin, direction, least); t && (!expected || *t < *expected))
          expected = t;
      const auto hit = scene.nearest(origin, direction, least);
      ASSERT_EQ(hit.has_value(), expected.has_value()) << s << ", " << r;
      // A division, or a product with the reciprocal: each off by less than two roundings.
      if (!hit) continue;
      ASSERT_NEAR(hit->t, *expected, 4 * 0x1p-52 * *expected) << s << ", " << r;
      ASSERT_EQ(meets(boxes[hit->box], origin, direction, least), hit->t);
    }
  }
}

TEST(CullingRays, AlongAnAxisMeetABoxsFaceAndMissBesideIt) {
  const BoxScene scene({{{-1, -1, -3}, {1, 1, -2}}});
  const auto ahead = [&](double x, double least) -> std::optional<double> {
    const auto hit = scene.nearest({x, 0, 0}, {0, 0, -1}, least);
    return hit ? std::optional(hit->t) : std::nullopt;
  };
  EXPECT_EQ(ahead(0, 0), 2);
  EXPECT_EQ(ahead(0.999, 0), 2);
  EXPECT_EQ(ahead(1.001, 0), std::nullopt);
  EXPECT_EQ(ahead(0, 2.5), 3) << "from inside, where it leaves";
  EXPECT_EQ(ahead(0, 3.5), std::nullopt);
  EXPECT_FALSE(BoxScene({}).nearest({0, 0, 0}, {0, 0, -1}, 0));
}

}  // namespace
}  // namespace gnomon::culling
