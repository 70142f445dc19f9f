// A bounding volume hierarchy over boxes, for whoever asks what lies where: culling and rays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace gnomon::culling {

struct Box {
  glm::dvec3 lo{}, hi{};
};

/// A binary tree, split by the surface area heuristic over binned centroids (Wald 2007, "On fast
/// Construction of SAH-based Bounding Volume Hierarchies"), by the median where that degenerates,
/// so that building takes O(n log n) whatever the boxes.
class Hierarchy {
 public:
  struct Node {
    glm::vec3 lo{}, hi{};               ///< rounded outward
    std::uint32_t first = 0, last = 0;  ///< its boxes: [first, last) of order()
    std::uint32_t second = 0;  ///< second child; the first one follows its parent. 0: a leaf
  };

  /// Boxes with finite corners, lo <= hi, within the range of floats.
  explicit Hierarchy(std::span<const Box> boxes);

  /// Parents before children; node 0 is the root. Empty where there are no boxes.
  const std::vector<Node>& nodes() const { return tree; }
  /// Indices of boxes, leaf by leaf.
  const std::vector<std::uint32_t>& order() const { return indices; }

 private:
  std::vector<Node> tree;
  std::vector<std::uint32_t> indices;
};

/// Solid boxes and the rays that meet them.
class BoxScene {
 public:
  explicit BoxScene(std::vector<Box> given);

  struct Hit {
    double t = 0;
    std::uint32_t box = 0;
  };

  /// The first surface at t >= least on origin + t direction, in double; of a box that holds the
  /// point at `least` the side where the ray leaves it. A ray within a side may miss the box.
  std::optional<Hit> nearest(const glm::dvec3& origin, const glm::dvec3& direction,
                             double least) const;

  const std::vector<Box>& boxes() const { return all; }

 private:
  std::vector<Box> all;
  Hierarchy hierarchy;
};

/// The same for one box.
std::optional<double> meets(const Box& box, const glm::dvec3& origin, const glm::dvec3& direction,
                            double least);

}  // namespace gnomon::culling
