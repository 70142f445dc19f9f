#include "reference/bound/storage.h"

#include <cassert>

namespace gnomon {
namespace {

constexpr bool isNormalised(Storage format) {
  return format == Storage::unorm8 || format == Storage::snorm8 || format == Storage::unorm16;
}

constexpr bool isSigned(Storage format) {
  return format == Storage::half || format == Storage::packedHalf || format == Storage::snorm8;
}

// The largest code: 2^b - 1, signed 2^(b-1) - 1.
constexpr double codes(Storage format) {
  return format == Storage::unorm16 ? 65535 : format == Storage::unorm8 ? 255 : 127;
}

// Halves and the small unsigned floats share an exponent of 5 bits with bias 15.
constexpr int kBias = 15;
constexpr int kLargestExponent = 15;
constexpr int kSmallestExponent = -14;

constexpr int mantissaBits(Storage format) {
  return format == Storage::ufloat10 ? 5 : format == Storage::ufloat11 ? 6 : 10;
}

// 65504 for half, 65024 and 64512 for the others.
double largest(Storage format) {
  return std::ldexp(2 - std::ldexp(1.0, -mantissaBits(format)), kLargestExponent);
}

// Distance of the format's neighbours around x, which is finite.
double quantum(double x, Storage format) {
  const int exponent = std::max(std::ilogb(x == 0 ? 1e-9 : x), kSmallestExponent);
  return std::ldexp(1.0, exponent - mantissaBits(format));
}

double floorTo(double x, Storage format) {
  if (x > largest(format)) return std::isinf(x) ? x : largest(format);
  if (x < -largest(format)) return -kInfinity;
  const double step = quantum(x, format);
  return std::floor(x / step) * step;
}

double ceilTo(double x, Storage format) { return -floorTo(-x, format); }

// A NaN reads as any code of a format that has no NaN.
Bounded storedNormalised(const Bounded& x, Storage format) noexcept {
  const double least = isSigned(format) ? -1 : 0, most = codes(format);
  const double lo = std::clamp(x.lo, least, 1.0), hi = std::clamp(x.hi, least, 1.0);
  Bounded result =
      x.mayBeNan() ? Bounded::between(least, 1)
                   : Bounded::between(std::floor(lo * most) / most, std::ceil(hi * most) / most);
  result.value = x.value;
  result.flags = x.flags & ~kMayBeNan;
  return result;
}

Bounded storedFloat(const Bounded& x, Storage format) noexcept {
  const double least = isSigned(format) ? -kInfinity : 0;
  const double lo = std::max(x.lo, least), hi = std::max(x.hi, least);
  Bounded result = detail::make(x.value, floorTo(lo, format), ceilTo(hi, format), x.flags);
  constexpr double kLeastNormal = 0x1p-14;
  if (format != Storage::packedHalf) return result;
  if (result.lo > 0 && lo < kLeastNormal) result.lo = 0;
  if (result.hi < 0 && hi > -kLeastNormal) result.hi = 0;
  return result;
}

std::uint32_t encodeNormalised(double x, Storage format) {
  const double clamped = x != x ? 0 : std::clamp(x, isSigned(format) ? -1.0 : 0.0, 1.0);
  const auto code = static_cast<std::int32_t>(std::nearbyint(clamped * codes(format)));
  return static_cast<std::uint32_t>(code) & (format == Storage::unorm16 ? 0xffffU : 0xffU);
}

double decodeNormalised(std::uint32_t bits, Storage format) {
  if (format != Storage::snorm8) return bits / codes(format);
  // -128 stands for -1 as well.
  return std::max(static_cast<std::int8_t>(bits) / codes(format), -1.0);
}

std::uint32_t encodeFloat(double x, Storage format) {
  const int mantissa = mantissaBits(format);
  const std::uint32_t infinity = 31U << mantissa;
  const bool negative = std::signbit(x);
  if (negative && !isSigned(format) && x == x) return 0;
  const std::uint32_t signBit = negative && isSigned(format) ? 0x8000U : 0U;
  if (x != x) return infinity | 1U;
  const double magnitude = std::abs(x);
  // Nearest even overflows from half a step above the largest value on.
  if (magnitude >= largest(format) + quantum(largest(format), format) / 2)
    return signBit | infinity;
  // Codes of floats are in order: the count of steps in a binade continues across its end.
  const double step = quantum(magnitude, format);
  const int exponent = std::max(magnitude == 0 ? -99 : std::ilogb(magnitude), kSmallestExponent);
  const auto steps = static_cast<std::uint32_t>(std::nearbyint(magnitude / step));
  const auto before = static_cast<std::uint32_t>(exponent + kBias - 1) << mantissa;
  return signBit | (before + steps);
}

double decodeFloat(std::uint32_t bits, Storage format) {
  const int mantissa = mantissaBits(format);
  const auto exponent = static_cast<int>((bits >> mantissa) & 31U);
  const std::uint32_t fraction = bits & ((1U << mantissa) - 1);
  const double sign = isSigned(format) && (bits & 0x8000U) != 0 ? -1 : 1;
  if (exponent == 31) return fraction != 0 ? kNan : sign * kInfinity;
  const std::uint32_t implicit = exponent == 0 ? 0 : 1U << mantissa;
  return sign * std::ldexp(fraction + implicit, std::max(exponent, 1) - kBias - mantissa);
}

}  // namespace

Bounded stored(const Bounded& x, Storage format) noexcept {
  if (format == Storage::float32) return x;
  return isNormalised(format) ? storedNormalised(x, format) : storedFloat(x, format);
}

Vec3<Bounded> storedR11G11B10(const Vec3<Bounded>& colour) noexcept {
  return {stored(colour.x, Storage::ufloat11), stored(colour.y, Storage::ufloat11),
          stored(colour.z, Storage::ufloat10)};
}

std::uint32_t encode(double x, Storage format) noexcept {
  if (format == Storage::float32) return std::bit_cast<std::uint32_t>(static_cast<float>(x));
  return isNormalised(format) ? encodeNormalised(x, format) : encodeFloat(x, format);
}

double decode(std::uint32_t bits, Storage format) noexcept {
  if (format == Storage::float32) return std::bit_cast<float>(bits);
  return isNormalised(format) ? decodeNormalised(bits, format) : decodeFloat(bits, format);
}

}  // namespace gnomon
