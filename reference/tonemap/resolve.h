// CPU model of tonemap/resolve: bloom, exposure, tone curve, transfer function.
//
// Every function is a template over the number type: double for the value, Bounded for all results
// that a conforming device may return. Colours are linear, Rec. 709 primaries, until transfer().
#pragma once

#include <span>

#include "kernels/tonemap/tonemap.h"
#include "reference/bound/vec.h"

namespace gnomon::tonemap {

/// An image: rows from the top, x fastest; at least one texel.
struct Pixels {
  uvec2 size;
  std::span<const vec4> texels;
};

/// x / (1 + x): Reinhard et al. 2002, "Photographic tone reproduction for digital images", eq. 3.
/// [0, inf) to [0, 1).
template <class T>
T reinhard(const T& x);

/// Narkowicz 2015, "ACES filmic tone mapping curve": x (2.51 x + 0.03) / (x (2.43 x + 0.59) +
/// 0.14). [0, inf) to [0, 2.51 / 2.43): passes 1 at 7.24.
template <class T>
T narkowicz(const T& x);

/// Hill 2016, ACES.hlsl of BakingLab: Rec. 709 to AP1 with the RRT's desaturation, his fit of RRT
/// and ODT, and back with the ODT's. Leaves [0, 1]: white tends to 1 / 0.983729, black is -3.8e-4,
/// saturated colours have negative components. The fit's numerator cancels at 0.0033: there the
/// interval is narrow absolutely (8e-10), not relatively.
template <class T>
Vec3<T> hill(const Vec3<T>& x);

/// x^(1 / 2.2) for x >= 2^-126, the smallest normal float, else 0.
template <class T>
T encodeGamma(const T& x);

/// IEC 61966-2-1: 12.92 x up to 0.0031308, then 1.055 x^(1 / 2.4) - 0.055. The pieces differ at the
/// threshold, by 3e-8.
template <class T>
T encodeSrgb(const T& x);

/// The contract's tone curve and transfer function of that number.
template <class T>
Vec3<T> curve(uint which, const Vec3<T>& x);
template <class T>
T transfer(uint which, const T& x);

/// Bloom at the centre of a pixel of an image of `size`: bilinear between the four texel centres
/// around it, clamped to the edge.
template <class T>
Vec3<T> bloomAt(const Pixels& bloom, const uvec2& size, const uvec2& pixel);

/// The whole pixel, bad input included; see the contract for what counts as what.
template <class T>
Vec4<T> resolve(const Resolve& push, const Pixels& hdr, const Pixels& bloom, const uvec2& pixel);

}  // namespace gnomon::tonemap
