#include "tests/culling/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "kernels/culling/camera.h"
#include "reference/culling/hiz.h"

namespace gnomon::culling {
namespace {

using glm::dmat4;
using glm::dvec3;
using glm::dvec4;

constexpr std::size_t kThings = 24;

// Odd on one level or another, and no power of two on the first two: for those drivers compile a
// kernel anew. Cases of their own have every other size.
constexpr std::array<uint, 12> kSides = {11, 13, 19, 21, 23, 25, 27, 29, 37, 41, 45, 51};

// ---------------------------------------------------------------------------------------- rays

/// In view space, origin + t direction, t being the distance along the view axis.
struct Ray {
  dvec3 origin, direction;
};

Ray rayThrough(const Scene& scene, uint x, uint y) {
  const dmat4& p = scene.projection;
  const double u = 2 * (x + 0.5) / scene.size.x - 1, v = 2 * (y + 0.5) / scene.size.y - 1;
  if (!scene.perspective())
    return {{(u - p[3][0]) / p[0][0], (v - p[3][1]) / p[1][1], 0}, {0, 0, -1}};
  return {dvec3(0), {(u + p[2][0]) / p[0][0], (v + p[2][1]) / p[1][1], -1}};
}

/// Where a line is inside a solid.
struct Through {
  double enters, leaves;
};

std::optional<Through> throughSphere(const dvec3& o, const dvec3& d) {
  const double a = glm::dot(d, d), b = glm::dot(o, d), c = glm::dot(o, o) - 1;
  const double root = b * b - a * c;
  if (root < 0) return std::nullopt;
  const double s = std::sqrt(root);
  return Through{(-b - s) / a, (-b + s) / a};
}

std::optional<Through> throughCube(const dvec3& o, const dvec3& d) {
  Through in{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0) {
      if (std::abs(o[i]) > 1) return std::nullopt;
      continue;
    }
    const double a = (-1 - o[i]) / d[i], b = (1 - o[i]) / d[i];
    in.enters = std::max(in.enters, std::min(a, b));
    in.leaves = std::min(in.leaves, std::max(a, b));
  }
  if (in.enters > in.leaves) return std::nullopt;
  return in;
}

/// A thing as rays meet it.
struct Solid {
  dmat4 intoIt;
  bool isCube;
};

/// The first surface between the clip planes, front or back.
std::optional<double> surface(const Solid& solid, const Ray& ray, const Scene& scene) {
  const dvec3 o(solid.intoIt * dvec4(ray.origin, 1)), d(solid.intoIt * dvec4(ray.direction, 0));
  const auto in = solid.isCube ? throughCube(o, d) : throughSphere(o, d);
  if (!in) return std::nullopt;
  const double at = in->enters >= scene.near ? in->enters : in->leaves;
  if (at < scene.near || (scene.far > 0 && at > scene.far)) return std::nullopt;
  return at;
}

/// As a depth buffer keeps it.
float depthAt(double distance, const Scene& scene) {
  const dmat4& p = scene.projection;
  const double z = p[3][2] - p[2][2] * distance;
  const double depth = scene.perspective() ? z / distance : z;
  return static_cast<float>(std::clamp(depth, 0.0, 1.0));
}

void castRays(Scene& scene) {
  std::vector<Solid> solids;
  for (const Thing& thing : scene.things)
    solids.push_back({glm::inverse(scene.view * thing.transform), thing.isCube});
  scene.depth = {scene.size, {}};
  scene.seen.assign(scene.things.size(), false);
  std::vector<float> depths(solids.size());
  for (uint y = 0; y < scene.size.y; ++y)
    for (uint x = 0; x < scene.size.x; ++x) {
      const Ray ray = rayThrough(scene, x, y);
      float nearest = 0;
      for (std::size_t i = 0; i < solids.size(); ++i) {
        const auto at = surface(solids[i], ray, scene);
        depths[i] = at ? depthAt(*at, scene) : -1;
        if (scene.things[i].occludes) nearest = std::max(nearest, depths[i]);
      }
      for (std::size_t i = 0; i < solids.size(); ++i)
        if (depths[i] >= 0 && depths[i] >= nearest) scene.seen[i] = true;
      scene.depth.texels.emplace_back(nearest, 0, 0, 0);
    }
}

// -------------------------------------------------------------------------------------- scenes

// Arguments are evaluated in no order that C++ fixes, elements of a braced list from the left: so
// that the same seed is the same scene with every compiler.
dmat4 randomRotation(Random& random, double most = 6.28) {
  const dvec3 axis = random.direction();
  return glm::rotate(dmat4(1), random.uniform(-most, most), axis);
}

dmat4 at(const dvec3& position, const dmat4& turned, const dvec3& scale) {
  return glm::translate(dmat4(1), position) * turned * glm::scale(dmat4(1), scale);
}

/// What a pixel's edge is as a slope x / d, or an x where the projection is parallel.
double edge(const Scene& scene, double pixel, int axis) {
  const dmat4& p = scene.projection;
  const double ndc = 2 * pixel / scene.size[axis] - 1;
  return scene.perspective() ? (ndc + p[2][axis]) / p[axis][axis]
                             : (ndc - p[3][axis]) / p[axis][axis];
}

/// In view space, at a distance along the axis and a place on the screen, in pixels.
dvec3 onScreen(const Scene& scene, double x, double y, double distance) {
  const double w = scene.perspective() ? distance : 1;
  return {edge(scene, x, 0) * w, edge(scene, y, 1) * w, -distance};
}

/// The cube over those pixels, from that distance on; `world` is out of view space.
Thing wall(const Scene& scene, const dmat4& world, double x0, double x1, double y0, double y1,
           double distance) {
  const dvec3 a = onScreen(scene, x0, y0, distance), b = onScreen(scene, x1, y1, distance);
  const double thickness = 0.01 * distance;
  const dvec3 middle = (a + b) / 2.0 - dvec3(0, 0, thickness);
  const dvec3 half(std::abs(b.x - a.x) / 2, std::abs(b.y - a.y) / 2, thickness);
  return {.transform = world * at(middle, dmat4(1), half), .isCube = true};
}

double placed(const Scene& scene, Random& random) {
  const double most = scene.far > 0 ? std::min(scene.far, 600 * scene.near) : 600 * scene.near;
  return random.logUniform(1.05 * scene.near, most);
}

/// Somewhere in or around the frustum. Of a size between a pixel's and the screen's.
Thing anything(const Scene& scene, const dmat4& world, double distance, Random& random) {
  const double x = random.uniform(-0.4, 1.4) * scene.size.x;
  const double y = random.uniform(-0.4, 1.4) * scene.size.y;
  const double unit = scene.perspective() ? distance : 1;
  const double size = random.logUniform(0.005, 0.3) * unit *
                      std::abs(edge(scene, 0, 0) - edge(scene, scene.size.x, 0));
  const dmat4 turned = randomRotation(random);
  return {.transform = world * at(onScreen(scene, x, y, distance), turned, dvec3(size)),
          .isCube = random.chance(0.5),
          .occludes = random.chance(0.5)};
}

/// A transform of any kind: stretched along axes, sheared, mirrored.
dmat4 anyAffine(Random& random) {
  const dvec3 stretch{random.logUniform(0.1, 3), random.logUniform(0.1, 3),
                      random.logUniform(0.1, 3)};
  dmat4 m = randomRotation(random) * glm::scale(dmat4(1), stretch);
  if (random.chance(0.5)) m[1] += random.uniform(-1, 1) * m[0];  // shear
  if (random.chance(0.5)) m[2] = -m[2];                          // mirror
  return m;
}

void project(Scene& scene, Random& random) {
  const double aspect = double(scene.size.x) / scene.size.y;
  const double fov = random.uniform(0.4, 2.0);
  scene.near = random.logUniform(0.05, 1);
  scene.far = random.chance(0.5) ? scene.near * random.logUniform(100, 10'000) : 0;
  if (scene.kind == SceneKind::kInfinite) scene.far = 0;
  if (scene.kind == SceneKind::kOrthographic) {
    scene.far = scene.near + random.logUniform(10, 1000);
    const double half = random.logUniform(1, 50), x = random.uniform(-9, 9);
    scene.projection =
        orthographic(x - half * aspect, x + half * aspect, -half, half, scene.near, scene.far);
  } else if (scene.kind == SceneKind::kOffAxis) {
    scene.far = 0;
    const double x = random.uniform(-3, 3) * scene.near, y = random.uniform(-2, 2) * scene.near;
    const double half = random.uniform(0.3, 1) * scene.near;
    scene.projection =
        offAxis(x - half * aspect, x + half * aspect, y - half, y + half, scene.near);
  } else {
    scene.projection = scene.far > 0 ? perspective(fov, aspect, scene.near, scene.far)
                                     : perspective(fov, aspect, scene.near);
  }
}

/// A wall over all of the screen with a hole of one pixel, which some things are behind.
void addHole(Scene& scene, const dmat4& world, Random& random) {
  const double d = 20 * scene.near, w = scene.size.x, h = scene.size.y;
  const auto x = static_cast<double>(random.below(scene.size.x));
  const auto y = static_cast<double>(random.below(scene.size.y));
  scene.things[0] = wall(scene, world, -9, x, -9, h + 9, d);
  scene.things[1] = wall(scene, world, x + 1, w + 9, -9, h + 9, d);
  scene.things[2] = wall(scene, world, x, x + 1, -9, y, d);
  scene.things[3] = wall(scene, world, x, x + 1, y + 1, h + 9, d);
  for (std::size_t i = 4; i < 12; ++i) {
    const double behind = d * random.uniform(1.2, 3);
    const double size = random.logUniform(0.001, 0.3) * (scene.perspective() ? behind : 1);
    const dvec3 centre = onScreen(scene, x + random.uniform(-2, 3), y + 0.5, behind);
    scene.things[i].transform = world * at(centre, dmat4(1), dvec3(size));
  }
}

void addOccluders(Scene& scene, const dmat4& world, Random& random) {
  const double w = scene.size.x, h = scene.size.y;
  const auto anyRange = [&](double most) {  // of pixels
    const double at = random.uniform(0, most), before = random.uniform(0, most);
    return std::array{at - before, at + random.uniform(0, most)};
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const double d = random.logUniform(2 * scene.near, 20 * scene.near);
    const bool whole = random.chance(0.1);
    const auto x = whole ? std::array{-9.0, w + 9} : anyRange(w);
    const auto y = whole ? std::array{-9.0, h + 9} : anyRange(h);
    scene.things[i] = wall(scene, world, x[0], x[1], y[0], y[1], d);
  }
}

dmat4 aroundTheCamera(const Scene& scene, const dmat4& world, Random& random) {
  const dvec3 centre = scene.near * random.direction();
  const double size = scene.near * random.uniform(0.5, 20);
  return world * at(centre, randomRotation(random), dvec3(size));
}

void place(Scene& scene, const dmat4& world, Random& random) {
  for (std::size_t i = 0; i < kThings; ++i) {
    double distance = placed(scene, random);
    if (scene.kind == SceneKind::kCrossing) distance = scene.near * random.uniform(0.3, 1.7);
    if (scene.kind == SceneKind::kInfinite) distance = scene.near * random.logUniform(10, 1e6);
    Thing thing = anything(scene, world, distance, random);
    if (scene.kind == SceneKind::kTransformed)
      thing.transform = thing.transform * anyAffine(random);
    if (scene.kind == SceneKind::kInside && i < 6)
      thing.transform = aroundTheCamera(scene, world, random);
    scene.things.push_back(thing);
  }
  if (scene.kind == SceneKind::kHole) addHole(scene, world, random);
  if (scene.kind == SceneKind::kOccluders) addOccluders(scene, world, random);
}

double extentOf(const Scene& scene) {
  double extent = glm::length(dvec3(glm::inverse(scene.view)[3]));
  for (const Bounds& b : scene.bounds)
    extent = std::max(extent, glm::length(dvec3(b.centre)) + b.radius);
  return 2 * extent;
}

}  // namespace

const char* nameOf(SceneKind kind) {
  constexpr std::array kNames = {"field",     "moving",   "off axis", "hole",
                                 "occluders", "crossing", "inside",   "transformed",
                                 "huge",      "tiny",     "infinite", "orthographic"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::size_t scenesOfEachKind() {
  return (generated("cullingScenes") + kSceneKinds - 1) / kSceneKinds;
}

std::vector<DrawCommand> commandsFor(std::size_t objects) {
  std::vector<DrawCommand> commands;
  for (std::size_t i = 0; i < objects; ++i) {
    const auto n = static_cast<uint>(i);
    commands.push_back({36 + n % 7, 1 + n % 3, 100 * n, static_cast<int>(n) - 5, n});
  }
  return commands;
}

Pyramid pyramidOf(const Picture& depth) {
  DepthBuffer buffer{depth.size, {}};
  for (const vec4& texel : depth.texels) buffer.depths.push_back(texel.x);
  Pyramid pyramid{.size = depth.size};
  for (uint level = 0; level <= levelCount(depth.size); ++level) {
    const uvec2 size = levelSize(depth.size, level);
    std::vector<float>& texels = pyramid.levels.emplace_back();
    for (uint y = 0; y < size.y; ++y)
      for (uint x = 0; x < size.x; ++x)
        texels.push_back(
            static_cast<float>(farthest<double>(buffer, footprint(depth.size, level, {x, y}))));
  }
  return pyramid;
}

void complete(Scene& scene) {
  scene.camera = cameraOf(scene.view, scene.projection, scene.near);
  for (const Thing& thing : scene.things)
    scene.bounds.push_back(
        boundsOf(thing.transform, dvec3(0), thing.isCube ? std::sqrt(3.0) : 1.0));
  scene.commands = commandsFor(scene.things.size());
  scene.pad = padAgainstRounding(extentOf(scene));
  castRays(scene);
}

Scene generatedScene(SceneKind kind, std::uint64_t seed) {
  Random random(seed * kSceneKinds + static_cast<std::uint64_t>(kind));
  Scene scene{.kind = kind};
  scene.size = {kSides[random.below(kSides.size())], kSides[random.below(kSides.size())]};
  project(scene, random);
  double scale = 1, offset = 30;
  if (kind == SceneKind::kHuge) scale = 1e4, offset = 1e6;
  if (kind == SceneKind::kTiny) scale = 1e-3, offset = 1e-2;
  const dvec3 direction = random.direction();
  const dvec3 eye = offset * random.uniform() * direction;
  const dmat4 world = at(eye, randomRotation(random), dvec3(1));
  // A world of another scale: distances and the planes of the camera with it.
  scene.near *= scale;
  scene.far *= scale;
  if (scene.perspective()) scene.projection[3][2] *= scale;
  scene.view = glm::inverse(world);
  place(scene, world, random);
  if (kind == SceneKind::kMoving) {  // what was placed stays; the camera goes on
    const dmat4 moved =
        at(scene.near * random.uniform(0, 60) * dvec3(0.3, 0.1, -1),
           glm::rotate(dmat4(1), random.uniform(-0.5, 0.5), random.direction()), dvec3(1));
    scene.view = glm::inverse(world * moved);
  }
  complete(scene);
  return scene;
}

}  // namespace gnomon::culling
