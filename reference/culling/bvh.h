// Culling on the CPU: all objects, one by one, or down a hierarchy. A second opinion on
// culling/frustum, and what a GPU's time is compared with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/culling/culling.h"
#include "reference/culling/hierarchy.h"

namespace gnomon::culling {

enum class CullMode {
  kNone,     ///< everything is visible
  kFrustum,  ///< every sphere against every plane
  kBvh,      ///< the same answer, down a hierarchy with plane masks
};

/// What a mode had to look at.
struct Visits {
  std::size_t nodes = 0, spheres = 0;
};

/// The camera's planes, and what the contract's Frustum says of them.
struct FrustumQuery {
  Camera camera{};  ///< its planes have normals of unit length, or are 0
  float pad = 0;    ///< world units, >= 0
  bool noNearPlane = false;
};

/// The contract's rule for one sphere, in double: visible unless it lies wholly outside a plane;
/// bad bounds are visible.
bool isVisible(const Bounds& sphere, const FrustumQuery& query);

/// Spheres with a hierarchy over their boxes; those with bad bounds beside it.
class SphereTree {
 public:
  explicit SphereTree(std::span<const Bounds> bounds);

  /// Indices of what is visible, ascending; the same set in both modes that look.
  std::vector<std::uint32_t> cull(CullMode mode, const FrustumQuery& query,
                                  Visits* visits = nullptr) const;

 private:
  std::vector<std::uint32_t> descend(const FrustumQuery& query, Visits& visits) const;

  std::vector<Bounds> spheres;
  std::vector<std::uint32_t> unusable;  ///< spheres that nobody can say are not seen
  std::vector<std::uint32_t> usable;    ///< what the hierarchy's boxes are of
  Hierarchy hierarchy;
  std::vector<Bounds> leaves;        ///< the usable ones as the hierarchy has them
  std::vector<std::uint32_t> names;  ///< their indices in `spheres`
};

}  // namespace gnomon::culling
