#include "reference/culling/hierarchy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>

namespace gnomon::culling {
namespace {

constexpr std::uint32_t kMostInLeaf = 4;
constexpr std::size_t kBins = 16;

// Levels beyond the ideal depth, in multiples of it, before the median takes over from the
// heuristic.
constexpr unsigned kPatience = 2;

glm::vec3 roundedDown(const glm::dvec3& x) {
  glm::vec3 f(x);
  for (int i = 0; i < 3; ++i)
    if (f[i] > x[i]) f[i] = std::nextafter(f[i], -std::numeric_limits<float>::infinity());
  return f;
}

struct Extent {
  glm::vec3 lo{std::numeric_limits<float>::infinity()};
  glm::vec3 hi{-std::numeric_limits<float>::infinity()};

  void add(const glm::vec3& least, const glm::vec3& most) {
    lo = glm::min(lo, least);
    hi = glm::max(hi, most);
  }
  void add(const Extent& other) { add(other.lo, other.hi); }
  int longestAxis() const {
    const glm::dvec3 d = glm::dvec3(hi) - glm::dvec3(lo);
    return d.x >= d.y ? (d.x >= d.z ? 0 : 2) : (d.y >= d.z ? 1 : 2);
  }
  double halfArea() const {
    const glm::dvec3 d = glm::dvec3(hi) - glm::dvec3(lo);
    return d.x * d.y + d.y * d.z + d.z * d.x;
  }
};

struct Item {
  glm::vec3 lo{}, hi{};
  std::uint32_t index = 0;

  double centre(int axis) const { return double{lo[axis]} + double{hi[axis]}; }  // twice of it
};

struct Bin {
  Extent extent{};
  std::uint32_t count = 0;
};

/// Which bin a centroid falls into.
class Binning {
 public:
  Binning(const Extent& centres, int along)
      : axis(along),
        origin(centres.lo[along]),
        scale(kBins / (double{centres.hi[along]} - double{centres.lo[along]})) {}

  std::size_t operator()(const Item& item) const {
    const double at = (item.centre(axis) / 2 - origin) * scale;
    return at > 0 ? std::min(static_cast<std::size_t>(at), kBins - 1) : 0;
  }

 private:
  int axis;
  double origin, scale;
};

/// The number of bins left of the cheapest split; 0 where all centroids share a bin.
std::size_t cheapestSplit(const std::array<Bin, kBins>& bins) {
  std::array<double, kBins> right{};  // cost of the bins from here on
  Bin sum;
  for (std::size_t b = kBins; b-- > 1;) {
    sum.extent.add(bins[b].extent);
    sum.count += bins[b].count;
    right[b] = sum.count == 0 ? -1 : sum.extent.halfArea() * sum.count;
  }
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  sum = {};
  for (std::size_t b = 1; b < kBins; ++b) {
    sum.extent.add(bins[b - 1].extent);
    sum.count += bins[b - 1].count;
    if (sum.count == 0 || right[b] < 0) continue;
    const double cost = sum.extent.halfArea() * sum.count + right[b];
    if (cost < least) {
      least = cost;
      best = b;
    }
  }
  return best;
}

class Builder {
 public:
  explicit Builder(std::span<const Box> boxes) : items(boxes.size()) {
    for (std::size_t i = 0; i < boxes.size(); ++i)
      items[i] = {roundedDown(boxes[i].lo), -roundedDown(-boxes[i].hi),
                  static_cast<std::uint32_t>(i)};
  }

  std::vector<Hierarchy::Node> build() {
    std::vector<Hierarchy::Node> nodes;
    const auto deepest = kPatience * static_cast<unsigned>(std::bit_width(items.size()));
    std::vector<Task> tasks;
    if (!items.empty()) tasks.push_back({0, static_cast<std::uint32_t>(items.size()), 0, 0});
    while (!tasks.empty()) {
      const Task task = tasks.back();
      tasks.pop_back();
      const auto index = static_cast<std::uint32_t>(nodes.size());
      if (task.secondOf > 0) nodes[task.secondOf - 1].second = index;
      Extent extent;
      for (std::uint32_t i = task.first; i < task.last; ++i) extent.add(items[i].lo, items[i].hi);
      nodes.push_back({extent.lo, extent.hi, task.first, task.last, 0});
      if (task.last - task.first <= kMostInLeaf) continue;
      const std::uint32_t middle = split(task, task.depth < deepest);
      tasks.push_back({middle, task.last, index + 1, task.depth + 1});
      tasks.push_back({task.first, middle, 0, task.depth + 1});
    }
    return nodes;
  }

  std::vector<std::uint32_t> order() const {
    std::vector<std::uint32_t> indices(items.size());
    std::ranges::transform(items, indices.begin(), &Item::index);
    return indices;
  }

 private:
  struct Task {
    std::uint32_t first = 0, last = 0;
    std::uint32_t secondOf = 0;  // parent's index + 1, of a second child
    unsigned depth = 0;
  };

  /// Puts the task's items into two parts, neither of them empty, and returns where they meet.
  std::uint32_t split(const Task& task, bool byArea) {
    const std::span<Item> part = std::span(items).subspan(task.first, task.last - task.first);
    Extent centres;
    for (const Item& i : part) {
      const glm::vec3 centre = (glm::dvec3(i.lo) + glm::dvec3(i.hi)) / 2.0;
      centres.add(centre, centre);
    }
    const int axis = centres.longestAxis();
    if (byArea && centres.hi[axis] > centres.lo[axis]) {
      const Binning binning(centres, axis);
      std::array<Bin, kBins> bins;
      for (const Item& i : part) {
        Bin& bin = bins[binning(i)];
        bin.extent.add(i.lo, i.hi);
        ++bin.count;
      }
      if (const std::size_t left = cheapestSplit(bins); left > 0) {
        const auto middle = std::partition(part.begin(), part.end(),
                                           [&](const Item& i) { return binning(i) < left; });
        return task.first + static_cast<std::uint32_t>(middle - part.begin());
      }
    }
    const auto middle = part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2);
    std::ranges::nth_element(part, middle, {}, [axis](const Item& i) { return i.centre(axis); });
    return task.first + static_cast<std::uint32_t>(part.size() / 2);
  }

  std::vector<Item> items;
};

/// Where a ray is between two corners: from `enter` to `leave`, nowhere if that is empty.
struct Passage {
  double enter, leave;
};

Passage through(const glm::dvec3& lo, const glm::dvec3& hi, const glm::dvec3& origin,
                const glm::dvec3& inverse) {
  const glm::dvec3 a = (lo - origin) * inverse, b = (hi - origin) * inverse;
  const glm::dvec3 nearer = glm::min(a, b), farther = glm::max(a, b);
  return {std::max({nearer.x, nearer.y, nearer.z}), std::min({farther.x, farther.y, farther.z})};
}

/// 1 / direction, huge where that is 0: an infinity would make 0 * infinity a NaN.
glm::dvec3 inverseOf(const glm::dvec3& direction) {
  glm::dvec3 inverse;
  for (int i = 0; i < 3; ++i)
    inverse[i] = direction[i] == 0 ? std::numeric_limits<double>::max() : 1 / direction[i];
  return inverse;
}

std::optional<double> surface(const Passage& p, double least) {
  if (p.enter > p.leave || p.leave < least) return std::nullopt;
  return p.enter >= least ? p.enter : p.leave;
}

}  // namespace

Hierarchy::Hierarchy(std::span<const Box> boxes) {
  Builder builder(boxes);
  tree = builder.build();
  indices = builder.order();
}

std::optional<double> meets(const Box& box, const glm::dvec3& origin, const glm::dvec3& direction,
                            double least) {
  return surface(through(box.lo, box.hi, origin, inverseOf(direction)), least);
}

BoxScene::BoxScene(std::vector<Box> given) : all(std::move(given)), hierarchy(all) {}

std::optional<BoxScene::Hit> BoxScene::nearest(const glm::dvec3& origin,
                                               const glm::dvec3& direction, double least) const {
  // The median's share of the depth on top of the heuristic's; one entry a level.
  constexpr std::size_t kDeepest = (kPatience + 1) * 33;
  const std::vector<Hierarchy::Node>& nodes = hierarchy.nodes();
  const glm::dvec3 inverse = inverseOf(direction);
  std::optional<Hit> best;
  double limit = std::numeric_limits<double>::infinity();
  std::array<std::pair<double, std::uint32_t>, kDeepest> waiting;
  std::size_t count = 0;
  const auto visit = [&](std::uint32_t n) {
    const Passage p = through(nodes[n].lo, nodes[n].hi, origin, inverse);
    return p.enter <= p.leave && p.leave >= least ? p.enter
                                                  : std::numeric_limits<double>::infinity();
  };
  if (!nodes.empty()) waiting[count++] = {visit(0), 0};
  while (count > 0) {
    const auto [enter, n] = waiting[--count];
    if (enter >= limit) continue;
    const Hierarchy::Node& node = nodes[n];
    if (node.second == 0) {
      for (std::uint32_t i = node.first; i < node.last; ++i) {
        const std::uint32_t box = hierarchy.order()[i];
        const auto t = surface(through(all[box].lo, all[box].hi, origin, inverse), least);
        if (t && *t < limit) best = Hit{limit = *t, box};
      }
      continue;
    }
    std::pair<double, std::uint32_t> a{visit(n + 1), n + 1}, b{visit(node.second), node.second};
    if (a.first < b.first) std::swap(a, b);  // the nearer one last, so that it comes first
    for (const auto& child : {a, b})
      if (child.first < limit) waiting[count++] = child;
  }
  return best;
}

}  // namespace gnomon::culling
