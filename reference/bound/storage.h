// What becomes of a float that is stored in a narrower format and read back.
//
// Float formats (Vulkan specification, "Floating-Point Format Conversions"): either neighbouring
// value, beyond the largest finite one that or infinity; formats without a sign store 0 for a
// negative. Normalised formats ("Conversion From Floating-Point to Normalized Fixed-Point"): after
// the clamp either of the two codes around it, so a whole step, and the code itself for an integer.
// No rounding mode of the shader applies to either.
#ifndef GNOMON_REFERENCE_BOUND_STORAGE_H
#define GNOMON_REFERENCE_BOUND_STORAGE_H

#include <cstdint>

#include "reference/bound/vec.h"

namespace gnomon {

enum class Storage : std::uint8_t {
  float32,     // kept bit for bit
  half,        // images: denormals are kept
  packedHalf,  // packHalf2x16, OpFConvert: denormal halves may be flushed
  unorm8,
  snorm8,
  unorm16,
  ufloat11,  // red and green of R11G11B10, 5 bits of exponent, 6 of mantissa
  ufloat10,  // blue, 5 of mantissa
};

// All values that may be read back, in the format's own scale; ends rounded outward to float,
// since what a shader reads of a normalised code is rounded too.
Bounded stored(const Bounded& x, Storage format) noexcept;

// Red, green and blue as an R11G11B10 image keeps them.
Vec3<Bounded> storedR11G11B10(const Vec3<Bounded>& colour) noexcept;

// The plain model is not rounded, as it is not anywhere else.
inline double stored(double x, Storage) noexcept { return x; }
inline Vec3<double> storedR11G11B10(const Vec3<double>& colour) noexcept { return colour; }

// The bits for x, rounded to nearest even, and what they stand for. NaN becomes code 0 where the
// format has none. For tests and for reading back what a kernel has written.
std::uint32_t encode(double x, Storage format) noexcept;
double decode(std::uint32_t bits, Storage format) noexcept;

}  // namespace gnomon

#endif
