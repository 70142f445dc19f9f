// What a shader reads of an image: one stored texel, or several through a sampler. DEVICE MODEL,
// except for the lines marked so: the Vulkan specification leaves most of it open.
//
// Specification, chapter "Image Operations" (and "Fixed-Point Data Conversions" for codes):
// - texel coordinates are (u, v) * size; the nearest texel is their floor, the four texels of a
//   linear filter surround (u, v) * size - 1/2, weighted by its fractional part; address modes;
// - a LOD is clamped to the image's levels; linear mips weight the two around it by its fraction;
// - the nearest level is ceil(lod + 1/2) - 1, or floor(lod + 1/2), so either where they differ;
// - a comparison is reference >= texel, made for each texel *before* the filter;
// - fractions keep subTexelPrecisionBits and mipmapPrecisionBits bits; nothing is said of the
//   arithmetic around them; a normalised code c stands for c / (2^b - 1).
// Device model, where that ends:
// - coordinates are + and * in float with their roundings, and the normalised coordinate is off by
//   2^-23 before them, whether an address mode was applied to it (llvmpipe) or not (an NVIDIA H200
//   takes the texel before 4 at 4.0000002, and is off by up to 0.8 of that): the nearest differs
//   next to boundaries;
// - weights are off by 2^-subTexelBits, and so are coordinates across a texel's boundary: the hull
//   over all places that near; an explicit LOD by 2^-mipmapBits, likewise;
// - products of weights are rounded to subTexelBits, and sum to 1: half a step each. An H200 keeps
// a
//   single weight to half a step of 2^-8, yet four texels of different magnitude that nearly cancel
//   leave what two exact weights explain;
// - what is filtered of halves may be rounded to a half (an H200 does);
// - a normalised format may be filtered in its own fixed point, rounded to nearest after each of
//   up to three linear interpolations (row, column, level): half a code each, but the result stays
//   between the texels. Llvmpipe does so where it clamps or repeats: among texels 4 codes apart,
//   where weights hardly matter, it is off by up to 1.2 codes more than weights explain, with mips;
// - a linear comparison is anything between the outcomes of the texels involved: a choice, wider
//   than the specification's weighted average, while no device at hand filters depth;
// - an undecided nearest texel or level is the hull of both, and does not count as ambiguous;
// - an implicit LOD is the hull over the interval of LODs that the caller passes.
// Not modelled: cube maps (filters across edges), anisotropy, borders, unnormalised coordinates,
// min and max reduction, constant offsets, a filter that differs between magnified and minified.
#ifndef GNOMON_REFERENCE_BOUND_SAMPLING_H
#define GNOMON_REFERENCE_BOUND_SAMPLING_H

#include <cstdint>
#include <vector>

#include "reference/bound/storage.h"
#include "reference/bound/vec.h"

namespace gnomon {

enum class AddressMode : std::uint8_t { clamp, repeat, mirror };  // clamp: to the edge

struct Sampling {
  bool linear = false;      // between texels, else the nearest
  bool linearMips = false;  // between levels, else the nearest
  AddressMode address = AddressMode::clamp;
  unsigned subTexelBits = 8;  // VkPhysicalDeviceLimits::subTexelPrecisionBits
  unsigned mipmapBits = 8;    // VkPhysicalDeviceLimits::mipmapPrecisionBits
};

struct TexelLevel {
  int width = 1, height = 1;
  std::vector<Vec4<Bounded>> texels{};  // rows, x fastest; as loaded() gives them
};

struct TexelImage {
  Storage storage = Storage::float32;
  std::vector<TexelLevel> levels{};  // from the largest on
};

// Of a normalised coordinate, before it is scaled to texels.
inline constexpr double kCoordinateError = 0x1p-23;

// Codes by which one linear interpolation of a normalised format may be off.
inline constexpr double kCodeError = 0.5;

// What a shader reads of a stored code. Floats are exact (a denormal of 32 bits may be flushed).
// Normalised: 0 and the ends are exact; else c / (2^b - 1) or c times the rounded reciprocal, whose
// relative error 2^-24 is at most one ULP of the product, and its rounding is another: 2 ULP.
Bounded loaded(std::uint32_t code, Storage storage) noexcept;

// The texel index that an address mode makes of any index. Specification, "Wrapping Operation".
int addressed(std::int64_t index, int size, AddressMode mode) noexcept;

// textureLod of a sampler2D.
Vec4<Bounded> sampled(const TexelImage& image, const Sampling& by, const Vec2<Bounded>& uv,
                      const Bounded& lod);
Vec4<double> sampled(const TexelImage& image, const Sampling& by, const Vec2<double>& uv,
                     double lod);

// textureLod of a sampler2DShadow: the image's red channel is the depth.
Bounded compared(const TexelImage& image, const Sampling& by, const Vec2<Bounded>& uv,
                 const Bounded& lod, const Bounded& reference);
double compared(const TexelImage& image, const Sampling& by, const Vec2<double>& uv, double lod,
                double reference);

}  // namespace gnomon

#endif
