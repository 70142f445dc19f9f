// The model of culling/frustum and the host's cameras and bounds against truth. No GPU.
//
// Covered: planes against the corners of the frustum and against points inside; spheres just inside
// and just outside each plane, the planes found from corners; nothing that a ray sees is culled,
// over generated scenes of every kind; bounding spheres under any affine transform; the near plane
// left out; bad bounds.
// Not covered: how tight a sphere-against-planes test is at the frustum's edges, where it keeps
// what only touches two planes' outsides; that is the algorithm's own looseness.
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "harness/cases/modelled.h"
#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "kernels/culling/camera.h"
#include "reference/culling/frustum.h"
#include "tests/culling/scenes.h"

namespace gnomon::culling {
namespace {

using glm::dmat4;
using glm::dvec3;
using glm::dvec4;

constexpr Frustum padded(float pad, bool noNearPlane = false) {
  return {.count = 1, .capacity = 1, .noNearPlane = noNearPlane, .pad = pad, .patience = 0};
}

bool visible(const Camera& camera, const Bounds& sphere, const Frustum& push = padded(0)) {
  return modelled("inFrustum", [&]<class T>() { return inFrustum<T>(camera, sphere, push); }) == 1;
}

/// The corner of the frustum at that corner of the clip volume, reverse-Z: z 1 is near. An infinite
/// one ends at z = 2^-10, a thousand times as far as it begins.
dvec3 corner(const Scene& scene, double x, double y, double z) {
  const double far = scene.far > 0 ? 0.0 : 0x1p-10;
  const dvec4 world =
      glm::inverse(scene.projection * scene.view) * dvec4(x, y, z > 0 ? 1.0 : far, 1);
  return dvec3(world) / world.w;
}

/// A face of the frustum: three of its corners, and one that is not on it. Planes of the contract
/// in the order of Camera.
struct Face {
  vec4 plane;
  std::array<dvec3, 3> on;
  dvec3 inside;
};

std::vector<Face> facesOf(const Scene& s) {
  const auto at = [&](double x, double y, double z) { return corner(s, x, y, z); };
  std::vector<Face> faces = {
      {s.camera.left, {at(-1, -1, 1), at(-1, 1, 1), at(-1, 1, 0)}, at(1, 1, 1)},
      {s.camera.right, {at(1, -1, 1), at(1, 1, 1), at(1, 1, 0)}, at(-1, 1, 1)},
      {s.camera.bottom, {at(-1, 1, 1), at(1, 1, 1), at(1, 1, 0)}, at(1, -1, 1)},
      {s.camera.top, {at(-1, -1, 1), at(1, -1, 1), at(1, -1, 0)}, at(1, 1, 1)},
      {s.camera.nearPlane, {at(-1, -1, 1), at(1, -1, 1), at(1, 1, 1)}, at(1, 1, 0)}};
  if (s.far > 0)
    faces.push_back({s.camera.farPlane, {at(-1, -1, 0), at(1, -1, 0), at(1, 1, 0)}, at(1, 1, 1)});
  return faces;
}

/// The face's unit normal, inward, from its corners alone.
dvec3 normalOf(const Face& face) {
  const dvec3 n = glm::normalize(glm::cross(face.on[1] - face.on[0], face.on[2] - face.on[0]));
  return glm::dot(n, face.inside - face.on[0]) > 0 ? n : -n;
}

template <class F>
void forEachScene(const F& f) {
  const std::size_t count = scenesOfEachKind();
  for (int kind = 0; kind < kSceneKinds; ++kind)
    for (std::size_t i = 0; i < count; ++i)
      f(generatedScene(static_cast<SceneKind>(kind), caseSeed() + i));
}

/// A few of each kind.
template <class F>
void forSomeScenes(const F& f) {
  for (int kind = 0; kind < kSceneKinds; ++kind)
    for (std::uint64_t i = 0; i < 10; ++i)
      f(generatedScene(static_cast<SceneKind>(kind), caseSeed() + i));
}

// Each plane is rounded once: by half an ULP, 2^-24 of a number up to 1 in each component of n, and
// 2^-24 of its size in w; a corner's coordinates carry those on.
TEST(CullingFrustumModel, PlanesHoldTheCornersOfTheFrustum) {
  forSomeScenes([](const Scene& scene) {
    for (const Face& face : facesOf(scene)) {
      const dvec3 n(face.plane);
      EXPECT_NEAR(glm::length(n), 1, std::sqrt(3) * 0x1p-24);
      for (const dvec3& p : face.on) {
        const double size = std::abs(p.x) + std::abs(p.y) + std::abs(p.z) + std::abs(face.plane.w);
        EXPECT_NEAR(glm::dot(n, p) + face.plane.w, 0, size * 0x1p-24) << nameOf(scene.kind);
      }
      EXPECT_GT(glm::dot(n, face.inside) + face.plane.w, 0) << nameOf(scene.kind);
    }
  });
}

TEST(CullingFrustumModel, AnInfiniteProjectionHasNoFarPlane) {
  forSomeScenes([](const Scene& scene) {
    const bool none = scene.camera.farPlane == vec4(0);
    EXPECT_EQ(none, scene.far == 0) << nameOf(scene.kind);
  });
}

// A sphere around a point beside the face, whose surface is a thousandth of its radius from it.
TEST(CullingFrustumModel, ASphereIsCulledOnceItLeavesTheFace) {
  Random random(caseSeed());
  forSomeScenes([&](const Scene& scene) {
    for (const Face& face : facesOf(scene)) {
      const dvec3 n = normalOf(face);
      const double u = random.uniform(0.3, 0.4), v = random.uniform(0.3, 0.4);
      const dvec3 p = face.on[0] * (1 - u - v) + face.on[1] * u + face.on[2] * v;
      const double radius = scene.near + 0.01 * glm::length(p);
      const auto beside = [&](double distance) {
        return Bounds{vec3(p - n * (distance * radius)), static_cast<float>(radius)};
      };
      EXPECT_TRUE(visible(scene.camera, beside(0.999))) << nameOf(scene.kind);
      EXPECT_FALSE(visible(scene.camera, beside(1.001))) << nameOf(scene.kind);
    }
  });
}

// Each face of a box, on exact numbers: as far as the sphere reaches, and 2^-20 farther.
TEST(CullingFrustumModel, TouchingIsVisible) {
  const Camera camera = cameraOf(dmat4(1), orthographic(-2, 2, -2, 2, 1, 9), 1);
  for (const vec3& out : {vec3(-1, 0, 0), vec3(1, 0, 0), vec3(0, -1, 0), vec3(0, 1, 0),
                          vec3(0, 0, 1), vec3(0, 0, -1)})
    for (const float pad : {0.0f, 0.25f}) {
      const vec3 face = vec3(0, 0, -5) + out * vec3(2, 2, 4);
      const auto at = [&](float distance) { return Bounds{face + out * distance, 1}; };
      EXPECT_TRUE(visible(camera, at(1 + pad), padded(pad)));
      EXPECT_FALSE(visible(camera, at(1 + pad + 0x1p-20f), padded(pad)));
    }
}

// Whatever the formula: a sphere with a point inside the clip volume is visible.
TEST(CullingFrustumModel, ASphereThatHoldsAPointOfTheFrustumIsVisible) {
  Random random(caseSeed());
  forSomeScenes([&](const Scene& scene) {
    for (int i = 0; i < 100; ++i) {
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
      const dvec3 p = glm::mix(corner(scene, x, y, 1), corner(scene, x, y, 0), random.uniform());
      const double radius = random.logUniform(0.01, 10) * scene.near;
      const dvec3 centre = p + random.direction() * (0.99 * radius);
      EXPECT_TRUE(
          visible(scene.camera, {vec3(centre), static_cast<float>(radius)}, padded(scene.pad)));
    }
  });
}

TEST(CullingFrustumModel, NothingThatARaySeesIsCulled) {
  std::size_t seen = 0, things = 0;
  forEachScene([&](const Scene& scene) {
    for (std::size_t i = 0; i < scene.things.size(); ++i) {
      ++things;
      if (!scene.seen[i]) continue;
      ++seen;
      EXPECT_TRUE(visible(scene.camera, scene.bounds[i], padded(scene.pad)))
          << fmt::format("thing {} of a scene of kind '{}'", i, nameOf(scene.kind));
    }
  });
  EXPECT_GT(seen, things / 10);  // the stimulus shows something
  EXPECT_LT(seen, things / 2);   // and hides something
}

TEST(CullingFrustumModel, CastersCountBeforeTheNearPlane) {
  const Camera camera = cameraOf(dmat4(1), orthographic(-2, 2, -2, 2, 1, 9), 1);
  const Bounds before{{0, 0, 5}, 1}, behind{{0, 0, -11}, 1};
  EXPECT_FALSE(visible(camera, before));
  EXPECT_TRUE(visible(camera, before, padded(0, true)));
  EXPECT_FALSE(visible(camera, behind, padded(0, true)));
}

TEST(CullingFrustumModel, BadBoundsAreVisible) {
  const Camera camera = cameraOf(dmat4(1), orthographic(-2, 2, -2, 2, 1, 9), 1);
  for (const float x : specialFloats({kMostWorld, -kMostWorld, 2 * kMostWorld})) {
    const bool usable = std::abs(x) <= kMostWorld;
    EXPECT_EQ(visible(camera, {{x, 50, -5}, 1}), !usable) << x;
    EXPECT_EQ(visible(camera, {{50, x, -5}, 1}), !usable) << x;
    EXPECT_EQ(visible(camera, {{50, 0, x}, 1}), !usable) << x;
    EXPECT_EQ(visible(camera, {{50, 0, -5}, x}), !usable || std::signbit(x) || x > 48) << x;
  }
}

dmat4 anyTransform(Random& random) {
  dmat4 m(1);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) m[c][r] = random.uniform(-2, 2);
  for (int r = 0; r < 3; ++r) m[3][r] = random.uniform(-1000, 1000);
  return m;
}

// Half of these transforms mirror, all of them shear.
TEST(CullingFrustumModel, BoundsHoldWhatAnAffineTransformMakesOfTheSphere) {
  Random random(caseSeed());
  for (int i = 0; i < 500; ++i) {
    const dmat4 m = anyTransform(random);
    const dvec3 centre = 10.0 * random.direction();
    const double radius = random.logUniform(0.01, 100);
    const Bounds bounds = boundsOf(m, centre, radius);
    for (int j = 0; j < 100; ++j) {
      const dvec3 p(m * dvec4(centre + radius * random.direction(), 1));
      EXPECT_LE(glm::length(p - dvec3(bounds.centre)), bounds.radius);
    }
  }
}

// A radius is rounded to a float, by half an ULP, and moved up by one: by 1.5 times 2^-23 in all.
TEST(CullingFrustumModel, BoundsAreTightWhereAxesAreStretched) {
  Random random(caseSeed());
  for (int i = 0; i < 100; ++i) {
    const dvec3 axis = random.direction();
    const dvec3 stretch{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
    const dmat4 m =
        glm::rotate(dmat4(1), random.uniform(0, 6), axis) * glm::scale(dmat4(1), stretch);
    const double most = std::max({std::abs(stretch.x), std::abs(stretch.y), std::abs(stretch.z)});
    EXPECT_NEAR(boundsOf(m, dvec3(0), 2).radius, 2 * most, 2 * most * 1.5 * 0x1p-23);
  }
}

}  // namespace
}  // namespace gnomon::culling
