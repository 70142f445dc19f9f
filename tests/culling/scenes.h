// Small generated scenes of which it is known, by rays in double through every pixel, what can be
// seen: the truth that culling is held against.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include "harness/cases/picture.h"
#include "kernels/culling/culling.h"
#include "reference/culling/occlusion.h"

namespace gnomon::culling {

/// What a scene is there for.
enum class SceneKind {
  kField,         ///< spheres and boxes around the frustum, half of them occluders
  kMoving,        ///< one field, a camera on its way through it
  kOffAxis,       ///< a frustum that does not hold its axis, spheres near its edges
  kHole,          ///< a wall with a hole of one pixel
  kOccluders,     ///< walls before most objects, now and then before all
  kCrossing,      ///< objects on the near plane
  kInside,        ///< the camera inside some of them
  kTransformed,   ///< stretched, sheared, mirrored
  kHuge,          ///< a world of millions of units, far from the origin
  kTiny,          ///< a world of a thousandth of a unit
  kInfinite,      ///< no far plane, objects far away
  kOrthographic,  ///< a parallel projection
};
inline constexpr int kSceneKinds = 12;
const char* nameOf(SceneKind kind);

/// A solid: the unit sphere or the cube [-1, 1]^3 under an affine transform.
struct Thing {
  glm::dmat4 transform{1};
  bool isCube = false;
  bool occludes = true;  ///< is drawn into the depth buffer
};

struct Scene {
  SceneKind kind{};
  uvec2 size{1, 1};
  glm::dmat4 view{1}, projection{1};
  double near = 0.1, far = 0;  ///< far: infinite where 0
  std::vector<Thing> things{};

  // What follows from those.
  Camera camera{};
  std::vector<Bounds> bounds{};
  std::vector<DrawCommand> commands{};
  Picture depth{};           ///< of the things that occlude; reverse-Z, rounded to float; sky is 0
  std::vector<bool> seen{};  ///< by thing: some pixel of it is not behind the depth buffer
  float pad = 0;             ///< as padAgainstRounding has it

  bool perspective() const { return projection[2][3] != 0; }
};

/// The same for the same kind and seed.
Scene generatedScene(SceneKind kind, std::uint64_t seed);

/// Fills in what follows: camera, bounds, depth by casting a ray through every pixel's centre.
void complete(Scene& scene);

/// Its pyramid, as the model of hiz has it.
Pyramid pyramidOf(const Picture& depth);

/// Draws of distinct meshes, firstInstance the index.
std::vector<DrawCommand> commandsFor(std::size_t objects);

}  // namespace gnomon::culling
