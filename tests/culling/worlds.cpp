#include "tests/culling/worlds.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "harness/cases/random.h"
#include "harness/verdict/parallel.h"
#include "kernels/culling/camera.h"
#include "tests/culling/scenes.h"

namespace gnomon::culling {
namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;
using glm::dvec4;

// Metres.
constexpr double kPitch = 40, kBuilding = 30;  // of the grid, and a side of what stands on it
constexpr double kEyes = 1.7;
constexpr std::size_t kPropsOfBlock = 15;

constexpr double kFieldHalf = 500;
constexpr std::size_t kFieldObjectsOfOccluder = 4;
// The mean number of occluders on a ray from the camera to the edge of the field.
constexpr double kFieldOpticalDepth = 0.1;

void add(World& world, const Box& box, bool occludes) {
  const dvec3 centre = (box.lo + box.hi) / 2.0, half = (box.hi - box.lo) / 2.0;
  if (occludes) world.occluders.push_back({static_cast<std::uint32_t>(world.bounds.size()), box});
  world.bounds.push_back(boundsOf(dmat4(1), centre, glm::length(half)));
}

/// A box of about that half side, standing anywhere.
Box boxAt(const dvec3& centre, double half, Random& random) {
  const dvec3 h =
      half * dvec3(random.uniform(0.5, 1.5), random.uniform(0.5, 1.5), random.uniform(0.5, 1.5));
  return {centre - h, centre + h};
}

/// In the street around a block: on one of the four sides of its building.
Box propAt(double x, double z, Random& random) {
  const double along = random.uniform(-kPitch / 2, kPitch / 2);
  const double across =
      random.uniform(kBuilding / 2 + 1, kPitch / 2) * (random.chance(0.5) ? 1 : -1);
  const double size = random.logUniform(0.1, 0.6);
  const dvec3 at =
      random.chance(0.5) ? dvec3(x + along, size, z + across) : dvec3(x + across, size, z + along);
  return boxAt(at, size, random);
}

/// Blocks row by row around the origin, where two streets cross.
void build(World& world, std::size_t objects, Random& random) {
  const std::size_t blocks = (objects + kPropsOfBlock) / (kPropsOfBlock + 1);
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(blocks))));
  const double first = kPitch * (0.5 - static_cast<double>((side + 1) / 2));
  for (std::size_t i = 0; world.bounds.size() < objects; ++i) {
    const std::size_t block = i / (kPropsOfBlock + 1);
    const double x = first + kPitch * static_cast<double>(block % side);
    const double z = first + kPitch * static_cast<double>(block / side);
    if (i % (kPropsOfBlock + 1) > 0) {
      add(world, propAt(x, z, random), false);
      continue;
    }
    const double half = kBuilding / 2 * random.uniform(0.8, 1);
    add(world, {{x - half, 0, z - half}, {x + half, random.logUniform(8, 60), z + half}}, true);
  }
  world.view = glm::lookAt(dvec3(0, kEyes, 0), dvec3(1, kEyes, -2), dvec3(0, 1, 0));
}

/// Occluders' faces shrink as their number grows, so that together they cover the same.
void scatter(World& world, std::size_t objects, Random& random) {
  const double volume = std::pow(2 * kFieldHalf, 3);
  const double occluders = static_cast<double>(objects) / kFieldObjectsOfOccluder;
  const double face = kFieldOpticalDepth * volume / (kFieldHalf * std::max(occluders, 1.0));
  const double half = std::sqrt(face) / 2;
  while (world.bounds.size() < objects) {
    const auto coordinate = [&] { return random.uniform(-kFieldHalf, kFieldHalf); };
    const dvec3 centre(coordinate(), coordinate(), coordinate());
    if (glm::length(centre) < 3 * half + 1) continue;  // it would stand around the camera
    add(world, boxAt(centre, half, random), world.bounds.size() % kFieldObjectsOfOccluder == 0);
  }
  world.view = glm::lookAt(dvec3(0), dvec3(1, 0.2, -2), dvec3(0, 1, 0));
}

double extentOf(const World& world) {
  double farthest = 0;
  for (const Bounds& b : world.bounds)
    farthest = std::max(farthest, glm::length(dvec3(b.centre)) + double{b.radius});
  return 2 * farthest;
}

/// View depth t of a point before the camera -> depth.
double depthAt(const dmat4& projection, double t) {
  const dvec4 clip = projection * dvec4(0, 0, -t, 1);
  return clip.z / clip.w;
}

}  // namespace

const char* nameOf(WorldKind kind) { return kind == WorldKind::kCity ? "city" : "field"; }

World world(WorldKind kind, std::size_t objects, std::uint64_t seed) {
  Random random(seed);
  World made;
  kind == WorldKind::kCity ? build(made, objects, random) : scatter(made, objects, random);
  made.commands = commandsFor(objects);
  made.projection = perspective(std::numbers::pi / 3, 16.0 / 9, made.near);
  made.camera = cameraOf(made.view, made.projection, made.near);
  made.pad = padAgainstRounding(extentOf(made));
  return made;
}

Picture depthOf(const World& world, const uvec2& size) {
  std::vector<Box> boxes;
  for (const Occluder& o : world.occluders) boxes.push_back(o.box);
  const BoxScene scene(std::move(boxes));
  const dmat3 toWorld = glm::transpose(dmat3(world.view));
  const dvec3 eye = -(toWorld * dvec3(world.view[3]));
  Picture depth{.size = size};
  depth.texels.resize(std::size_t{size.x} * size.y, vec4(0));
  parallelFor(depth.texels.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double x = (2.0 * static_cast<double>(i % size.x) + 1) / size.x - 1;
      const double y = (2.0 * static_cast<double>(i / size.x) + 1) / size.y - 1;
      // Of view depth 1, so that a hit's distance along it is its view depth.
      const dvec3 ray = toWorld * dvec3(x / world.projection[0][0], y / world.projection[1][1], -1);
      if (const auto hit = scene.nearest(eye, ray, world.near))
        depth.texels[i].x = static_cast<float>(depthAt(world.projection, hit->t));
    }
  });
  return depth;
}

}  // namespace gnomon::culling
