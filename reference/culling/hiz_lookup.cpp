#include "reference/culling/hiz_lookup.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace gnomon::culling {
namespace {

using std::uint64_t;

uint narrowed(uint64_t x) { return static_cast<uint>(x); }

/// The first pixel whose centre is not left of where base texel `a` begins, of previous_pow2:
/// (2 p + 1) base >= 2 side a.
uint firstFrom(uint side, uint64_t base, uint64_t a) {
  if (a == 0) return 0;
  return narrowed((2 * side * a - base + 2 * base - 1) / (2 * base));
}

/// The left one of the two pixels next to the centre of base texel `a`: floor((a + 1/2) side / base
/// - 1/2).
uint leftTap(uint side, uint64_t base, uint64_t a) {
  return narrowed(((2 * a + 1) * side - base) / (2 * base));
}

}  // namespace

Lookup lookupNamed(std::string_view name) {
  for (const Lookup lookup :
       {Lookup::kPinned, Lookup::kFold3, Lookup::kNextPow2, Lookup::kPreviousPow2})
    if (name == nameOf(lookup)) return lookup;
  throw std::logic_error("no lookup is called " + std::string(name));
}

const char* nameOf(Lookup lookup) {
  switch (lookup) {
    case Lookup::kFold3:
      return "fold3";
    case Lookup::kNextPow2:
      return "next_pow2";
    case Lookup::kPreviousPow2:
      return "previous_pow2";
    default:
      return "pinned";
  }
}

uint LookupAxis::size(uint element) const {
  if (lookup == Lookup::kNextPow2) return levelSize(std::bit_ceil(side), element + 1);
  if (lookup == Lookup::kPreviousPow2) return levelSize(std::bit_floor(side), element);
  return levelSize(side, element + 1);
}

uint LookupAxis::texelOf(uint element, uint pixel) const {
  if (lookup == Lookup::kNextPow2) return pixel >> (element + 1);
  if (lookup == Lookup::kPreviousPow2)
    return narrowed((2 * uint64_t{pixel} + 1) * std::bit_floor(side) / (2 * uint64_t{side})) >>
           element;
  return std::min(pixel >> (element + 1), size(element) - 1);
}

Range LookupAxis::own(uint element, uint texel) const {
  if (lookup == Lookup::kNextPow2)
    return {std::min(side, texel << (element + 1)), std::min(side, (texel + 1) << (element + 1))};
  if (lookup != Lookup::kPreviousPow2) return footprint(side, element + 1, texel);
  const uint base = std::bit_floor(side);
  const uint64_t end = std::min(uint64_t{base}, uint64_t{texel + 1} << element);
  return {firstFrom(side, base, uint64_t{texel} << element), firstFrom(side, base, end)};
}

// fold3: a texel takes up to three of the level before, so it ends where the third one does. With
// e(0) = 1 pixel and e(L) = 2^L + e(L - 1) that is 2^(L + 1) - 1 pixels from its begin.
Range LookupAxis::most(uint element, uint texel) const {
  Range range = own(element, texel);
  if (lookup == Lookup::kFold3)
    range.end = std::max(range.end, std::min(side, range.begin + (4u << element) - 1));
  if (lookup == Lookup::kPreviousPow2) {
    const uint base = std::bit_floor(side);
    const uint64_t end = std::min(uint64_t{base}, uint64_t{texel + 1} << element);
    range = {leftTap(side, base, uint64_t{texel} << element),
             std::min(side, leftTap(side, base, end - 1) + 2)};
  }
  return range;
}

PyramidShape::PyramidShape(Lookup lookup, const uvec2& size)
    : x{lookup, size.x}, y{lookup, size.y}, count(levelCount(size)) {
  const uint longer = std::max(size.x, size.y);
  if (lookup == Lookup::kNextPow2) count = levelCount(uvec2(std::bit_ceil(longer)));
  if (lookup == Lookup::kPreviousPow2) ++count;
}

Footprint PyramidShape::own(uint element, const uvec2& texel) const {
  return {x.own(element, texel.x), y.own(element, texel.y)};
}

Footprint PyramidShape::most(uint element, const uvec2& texel) const {
  return {x.most(element, texel.x), y.most(element, texel.y)};
}

uvec2 PyramidShape::texelOf(uint element, const uvec2& pixel) const {
  return {x.texelOf(element, pixel.x), y.texelOf(element, pixel.y)};
}

std::optional<uint> PyramidShape::elementFor(const uvec2& first, const uvec2& last) const {
  if (x.lookup == Lookup::kPreviousPow2) {
    const auto spans = [&](uint element) {
      const uvec2 extent = texelOf(element, last) - texelOf(element, first);
      return std::max(extent.x, extent.y);
    };
    uint element = 0;
    while (spans(element) > 1) ++element;
    return element;
  }
  const uvec2 extent = last - first + 1u;
  uint level = 0;
  while ((1u << level) < std::max(extent.x, extent.y)) ++level;
  level = std::min(level, count);
  if (level == 0) return std::nullopt;
  return level - 1;
}

}  // namespace gnomon::culling
