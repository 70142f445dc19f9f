#include "reference/culling/hiz.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "reference/bound/altered.h"
#include "reference/bound/builtins.h"
#include "reference/bound/vec.h"

namespace gnomon::culling {

uint levelSize(uint side, uint level) { return std::max(1u, side >> level); }

uvec2 levelSize(const uvec2& size, uint level) {
  return {levelSize(size.x, level), levelSize(size.y, level)};
}

uint levelCount(const uvec2& size) {
  return static_cast<uint>(std::bit_width(std::max(size.x, size.y))) - 1;
}

Range footprint(uint side, uint level, uint texel) {
  const bool last = texel == levelSize(side, level) - 1;
  return {texel << level, last ? side : (texel + 1) << level};
}

Footprint footprint(const uvec2& size, uint level, const uvec2& texel) {
  return {footprint(size.x, level, texel.x), footprint(size.y, level, texel.y)};
}

float counted(float depth) { return std::isnormal(depth) && depth > 0 ? depth : 0.0f; }

template <class T>
T farthest(const DepthBuffer& buffer, const Footprint& covered) {
  T least = input<T>(counted(buffer.at(covered.columns.begin, covered.rows.begin)));
  for (uint y = covered.rows.begin; y < covered.rows.end; ++y)
    for (uint x = covered.columns.begin; x < covered.columns.end; ++x)
      least = min(least, input<T>(counted(buffer.at(x, y))));
  return least;
}

template double farthest(const DepthBuffer&, const Footprint&);
template Altered farthest(const DepthBuffer&, const Footprint&);

}  // namespace gnomon::culling
