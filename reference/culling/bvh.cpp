#include "reference/culling/bvh.h"

#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

namespace gnomon::culling {
namespace {

// More than a unit normal that was rounded to float (2^-24 a component), and boxes rounded outward
// with distances in double, can change a distance by, relative to the sum of its terms' magnitudes.
constexpr double kSlack = 0x1p-20;

bool isUsable(float x) { return std::abs(x) <= kMostWorld; }  // false for NaN

bool isUsable(const Bounds& b) {
  return isUsable(b.centre.x) && isUsable(b.centre.y) && isUsable(b.centre.z) &&
         isUsable(b.radius) && b.radius >= 0;
}

Box boxOf(const Bounds& b) {
  const glm::dvec3 centre(b.centre);
  return {centre - double{b.radius}, centre + double{b.radius}};
}

/// The planes that there are.
class Planes {
 public:
  explicit Planes(const FrustumQuery& query) : pad(query.pad) {
    const Camera& c = query.camera;
    for (const vec4& plane : {c.left, c.right, c.bottom, c.top, c.farPlane}) add(plane);
    if (!query.noNearPlane) add(c.nearPlane);
  }

  unsigned all() const { return (1u << count) - 1; }

  bool touch(const Bounds& sphere, unsigned mask) const {
    const double reach = double{sphere.radius} + pad;
    for (unsigned rest = mask; rest != 0; rest &= rest - 1) {
      const glm::dvec4& plane = planes[static_cast<unsigned>(std::countr_zero(rest))];
      if (!(glm::dot(glm::dvec3(plane), glm::dvec3(sphere.centre)) + plane.w >= -reach))
        return false;
    }
    return true;
  }

  /// Takes the planes that the box is wholly inside of from the mask; false where it is wholly
  /// outside one. Neither may contradict what touch() says of a sphere in the box.
  bool narrow(const Hierarchy::Node& node, unsigned& mask) const {
    const glm::dvec3 lo(node.lo), hi(node.hi), most = glm::max(glm::abs(lo), glm::abs(hi));
    for (unsigned rest = mask; rest != 0; rest &= rest - 1) {
      const auto p = static_cast<unsigned>(std::countr_zero(rest));
      const glm::dvec3 n(planes[p]), a = n * lo, b = n * hi;
      const glm::dvec3 nearest = glm::min(a, b), farthest = glm::max(a, b);
      const double d = planes[p].w;
      const double slack = kSlack * (glm::dot(glm::abs(n), most) + std::abs(d) + pad);
      if (farthest.x + farthest.y + farthest.z + d < -pad - slack) return false;
      if (nearest.x + nearest.y + nearest.z + d > slack) mask &= ~(1u << p);
    }
    return true;
  }

 private:
  void add(const vec4& plane) {
    if (plane != vec4(0)) planes[count++] = glm::dvec4(plane);
  }

  std::array<glm::dvec4, 6> planes{};
  unsigned count = 0;
  double pad;
};

/// A set of small numbers that is read in order.
class Marks {
 public:
  explicit Marks(std::size_t n) : words((n + kBits - 1) / kBits) {}

  void add(std::uint32_t i) { words[i / kBits] |= std::uint64_t{1} << i % kBits; }

  std::vector<std::uint32_t> sorted() const {
    std::size_t size = 0;
    for (const std::uint64_t word : words) size += static_cast<std::size_t>(std::popcount(word));
    std::vector<std::uint32_t> list;
    list.reserve(size);
    for (std::size_t w = 0; w < words.size(); ++w)
      for (std::uint64_t rest = words[w]; rest != 0; rest &= rest - 1)
        list.push_back(static_cast<std::uint32_t>(
            w * kBits + static_cast<std::size_t>(std::countr_zero(rest))));
    return list;
  }

 private:
  static constexpr std::size_t kBits = 64;
  std::vector<std::uint64_t> words;
};

std::vector<std::uint32_t> indicesWhere(std::span<const Bounds> bounds, bool usable) {
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < bounds.size(); ++i)
    if (isUsable(bounds[i]) == usable) found.push_back(static_cast<std::uint32_t>(i));
  return found;
}

std::vector<Box> boxesOf(std::span<const Bounds> bounds, std::span<const std::uint32_t> which) {
  std::vector<Box> boxes(which.size());
  for (std::size_t i = 0; i < which.size(); ++i) boxes[i] = boxOf(bounds[which[i]]);
  return boxes;
}

}  // namespace

bool isVisible(const Bounds& sphere, const FrustumQuery& query) {
  const Planes planes(query);
  return !isUsable(sphere) || planes.touch(sphere, planes.all());
}

SphereTree::SphereTree(std::span<const Bounds> bounds)
    : spheres(bounds.begin(), bounds.end()),
      unusable(indicesWhere(bounds, false)),
      usable(indicesWhere(bounds, true)),
      hierarchy(boxesOf(bounds, usable)) {
  for (const std::uint32_t i : hierarchy.order()) {
    names.push_back(usable[i]);
    leaves.push_back(spheres[usable[i]]);
  }
}

std::vector<std::uint32_t> SphereTree::cull(CullMode mode, const FrustumQuery& query,
                                            Visits* visits) const {
  Visits ignored;
  Visits& looked = visits == nullptr ? ignored : *visits;
  looked = {};
  if (mode == CullMode::kBvh) return descend(query, looked);
  if (mode == CullMode::kNone) {
    std::vector<std::uint32_t> all(spheres.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }
  const Planes planes(query);
  looked.spheres = spheres.size();
  std::vector<std::uint32_t> visible;
  for (std::size_t i = 0; i < spheres.size(); ++i)
    if (!isUsable(spheres[i]) || planes.touch(spheres[i], planes.all()))
      visible.push_back(static_cast<std::uint32_t>(i));
  return visible;
}

std::vector<std::uint32_t> SphereTree::descend(const FrustumQuery& query, Visits& visits) const {
  const Planes planes(query);
  const std::vector<Hierarchy::Node>& nodes = hierarchy.nodes();
  Marks visible(spheres.size());
  for (const std::uint32_t i : unusable) visible.add(i);
  struct Task {
    std::uint32_t node;
    unsigned planes;
  };
  std::vector<Task> tasks;
  if (!nodes.empty()) tasks.push_back({0, planes.all()});
  while (!tasks.empty()) {
    Task task = tasks.back();
    tasks.pop_back();
    const Hierarchy::Node& node = nodes[task.node];
    ++visits.nodes;
    if (!planes.narrow(node, task.planes)) continue;
    if (task.planes != 0 && node.second != 0) {
      tasks.push_back({node.second, task.planes});
      tasks.push_back({task.node + 1, task.planes});
      continue;
    }
    for (std::uint32_t i = node.first; i < node.last; ++i) {
      visits.spheres += task.planes != 0;
      if (planes.touch(leaves[i], task.planes)) visible.add(names[i]);
    }
  }
  return visible.sorted();
}

}  // namespace gnomon::culling
