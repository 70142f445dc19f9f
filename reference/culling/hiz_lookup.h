// How a pyramid is addressed: as the contract pins it, and as others do. What a texel must have
// seen, and what it may have, follow from where a query looks.
//
//   pinned         the contract's: level L of w has max(1, floor(w / 2^L)) texels, pixel p is in
//                  texel min(p >> L, last)
//   fold3          the same places, but where a parent is odd each texel takes three of its columns
//                  or rows, so that neighbours overlap (M. Turitzin, Hierarchical Depth Buffers,
//                  2020)
//   next_pow2      level L has 2^(n - L) texels, 2^n the power of two from w on; pixel p is in
//   texel
//                  p >> L, texels beyond the image are nobody's
//   previous_pow2  element m has 2^(n - m) texels, 2^n the power of two up to w, and of the first a
//                  texel takes the two pixels that a linear filter touches at its centre; pixel p
//                  is in texel floor((2 p + 1) 2^n / 2 w) >> m, the one that holds its centre
//                  (A. Kapoulkine, niagara, src/shaders/depthreduce.comp.glsl)
#pragma once

#include <optional>
#include <string_view>

#include "reference/culling/hiz.h"

namespace gnomon::culling {

enum class Lookup { kPinned, kFold3, kNextPow2, kPreviousPow2 };

/// By an adapter's name of it. Programmer error for another one.
Lookup lookupNamed(std::string_view name);
const char* nameOf(Lookup lookup);

/// One axis of a pyramid. Elements are those of the contract's `levels`.
struct LookupAxis {
  Lookup lookup;
  uint side;  ///< pixels

  uint size(uint element) const;
  uint texelOf(uint element, uint pixel) const;
  /// The pixels that are in a texel: what it must have seen. Empty beyond the image.
  Range own(uint element, uint texel) const;
  /// What it may have seen at most.
  Range most(uint element, uint texel) const;
};

class PyramidShape {
 public:
  PyramidShape(Lookup lookup, const uvec2& size);

  uint elements() const { return count; }
  uvec2 size(uint element) const { return {x.size(element), y.size(element)}; }
  Footprint own(uint element, const uvec2& texel) const;
  Footprint most(uint element, const uvec2& texel) const;
  uvec2 texelOf(uint element, const uvec2& pixel) const;

  /// The element that a query for pixels [first, last] looks up its four corners in; nothing where
  /// it is the depth buffer itself.
  std::optional<uint> elementFor(const uvec2& first, const uvec2& last) const;

 private:
  LookupAxis x, y;
  uint count;
};

}  // namespace gnomon::culling
