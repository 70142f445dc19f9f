// Worlds of any number of objects, to see how culling scales. Their pictures look alike at every
// size: the share of objects before the camera stays, and what the occluders cover of the screen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/mat4x4.hpp>

#include "harness/cases/picture.h"
#include "kernels/culling/culling.h"
#include "reference/culling/bvh.h"

namespace gnomon::culling {

enum class WorldKind {
  kCity,   ///< buildings on a grid of streets, props between them; most is hidden
  kField,  ///< boxes all around the camera, and smaller the more there are; little is hidden
};
const char* nameOf(WorldKind kind);

/// An object that is drawn into the depth buffer: an axis-aligned box.
struct Occluder {
  std::uint32_t object = 0;
  Box box{};
};

struct World {
  std::vector<Bounds> bounds{};
  std::vector<DrawCommand> commands{};
  std::vector<Occluder> occluders{};
  glm::dmat4 view{1}, projection{1};
  double near = 0.1;  ///< metres, as all lengths
  Camera camera{};
  float pad = 0;  ///< as padAgainstRounding has it

  FrustumQuery query() const { return {.camera = camera, .pad = pad}; }
};

/// The same for the same kind, number and seed. The camera is for pictures of 16 to 9.
World world(WorldKind kind, std::size_t objects, std::uint64_t seed);

/// Depth of the occluders, reverse-Z, rounded to float; sky is 0. A ray in double through the
/// centre of every pixel, on all cores.
Picture depthOf(const World& world, const uvec2& size);

}  // namespace gnomon::culling
