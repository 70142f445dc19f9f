// CPU model of culling/hiz and culling/hiz_level: the pyramid of farthest depths, each texel from
// the pixels that it covers by the contract's sentence, never from the level before it.
#pragma once

#include <vector>

#include "kernels/culling/culling.h"

namespace gnomon::culling {

/// Columns or rows of the depth buffer: [begin, end).
struct Range {
  uint begin = 0, end = 0;
  bool empty() const { return begin >= end; }
  bool operator==(const Range&) const = default;
};

struct Footprint {
  Range columns{}, rows{};
  bool empty() const { return columns.empty() || rows.empty(); }
  bool operator==(const Footprint&) const = default;
};

/// Texels a side of a level: max(1, floor(side / 2^level)).
uint levelSize(uint side, uint level);
uvec2 levelSize(const uvec2& size, uint level);

/// Levels above the depth buffer, down to 1 x 1; none of a single pixel.
uint levelCount(const uvec2& size);

/// What texel x of a level covers: [x 2^level, (x + 1) 2^level), the last one to the end.
Range footprint(uint side, uint level, uint texel);
Footprint footprint(const uvec2& size, uint level, const uvec2& texel);

/// Reverse-Z depths, rows from the top; any bits.
struct DepthBuffer {
  uvec2 size{1, 1};
  std::vector<float> depths{};

  float at(uint x, uint y) const { return depths[std::size_t{y} * size.x + x]; }
};

/// A depth as it counts: NaN, infinite, negative or denormal is 0, the farthest, and -0 is 0.
float counted(float depth);

/// The smallest depth of a footprint that is not empty.
template <class T>
T farthest(const DepthBuffer& buffer, const Footprint& footprint);

}  // namespace gnomon::culling
