#include "reference/tonemap/resolve.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "reference/bound/altered.h"
#include "reference/bound/bounded.h"

namespace gnomon::tonemap {
namespace {

float counted(float x) {
  if (std::isfinite(x)) return std::clamp(x, -kMaxScene, kMaxScene);
  return x > 0 ? kMaxScene : 0.0f;
}

template <class T>
Vec3<T> texel(const Pixels& image, std::int64_t x, std::int64_t y) {
  const std::int64_t w = image.size.x, h = image.size.y;
  const std::int64_t at =
      std::clamp<std::int64_t>(y, 0, h - 1) * w + std::clamp<std::int64_t>(x, 0, w - 1);
  const vec4& t = image.texels[static_cast<std::size_t>(at)];
  return input<T>(vec3(counted(t.x), counted(t.y), counted(t.z)));
}

/// Where a pixel's centre stands among the texel centres 0, 1, ... along one axis.
template <class T>
struct Position {
  std::int64_t texel;  // at or before it; -1 before the first
  T weight;            // of the texel after, in [0, 1)
};

/// Pixel x of w stands at (x + 1/2) n / w - 1/2 of n texels, which is ((2 x + 1) n - w) / (2 w):
/// integers until the weight.
template <class T>
Position<T> position(std::int64_t x, std::int64_t w, std::int64_t n) {
  const std::int64_t numerator = (2 * x + 1) * n - w, denominator = 2 * w;
  const std::int64_t below = (numerator + denominator) / denominator - 1;  // floor: numerator > -w
  return {below, T(numerator - below * denominator) / T(denominator)};
}

/// The vector by each of three rows.
template <class T>
Vec3<T> byRows(const Vec3<T>& r0, const Vec3<T>& r1, const Vec3<T>& r2, const Vec3<T>& v) {
  return {dot(r0, v), dot(r1, v), dot(r2, v)};
}

template <class T>
T rrtAndOdtFit(const T& v) {
  return (v * (v + T(0.0245786f)) - T(0.000090537f)) /
         (v * (T(0.983729f) * v + T(0.4329510f)) + T(0.238081f));
}

}  // namespace

template <class T>
T reinhard(const T& x) {
  return x / (T(1) + x);
}

template <class T>
T narkowicz(const T& x) {
  return x * (T(2.51f) * x + T(0.03f)) / (x * (T(2.43f) * x + T(0.59f)) + T(0.14f));
}

template <class T>
Vec3<T> hill(const Vec3<T>& x) {
  const Vec3<T> ap1 =
      byRows<T>({T(0.59719f), T(0.35458f), T(0.04823f)}, {T(0.07600f), T(0.90834f), T(0.01566f)},
                {T(0.02840f), T(0.13383f), T(0.83777f)}, x);
  return byRows<T>({T(1.60475f), T(-0.53108f), T(-0.07367f)},
                   {T(-0.10208f), T(1.10813f), T(-0.00605f)},
                   {T(-0.00327f), T(-0.07276f), T(1.07602f)}, map(ap1, rrtAndOdtFit<T>));
}

template <class T>
T encodeGamma(const T& x) {
  const T least(std::numeric_limits<float>::min());
  return select(x >= least, pow(max(x, least), T(static_cast<float>(1 / 2.2))), T(0));
}

template <class T>
T encodeSrgb(const T& x) {
  const T threshold(0.0031308f);
  const T power = pow(max(x, threshold), T(static_cast<float>(1 / 2.4)));
  return select(x <= threshold, T(12.92f) * x, T(1.055f) * power - T(0.055f));
}

template <class T>
Vec3<T> curve(uint which, const Vec3<T>& x) {
  switch (which) {
    case kReinhard:
      return map(x, reinhard<T>);
    case kNarkowicz:
      return map(x, narkowicz<T>);
    case kHill:
      return hill(x);
    default:
      return x;
  }
}

template <class T>
T transfer(uint which, const T& x) {
  switch (which) {
    case kGamma:
      return encodeGamma(x);
    case kSrgb:
      return encodeSrgb(x);
    default:
      return x;
  }
}

template <class T>
Vec3<T> bloomAt(const Pixels& bloom, const uvec2& size, const uvec2& pixel) {
  const auto [x, wx] = position<T>(pixel.x, size.x, bloom.size.x);
  const auto [y, wy] = position<T>(pixel.y, size.y, bloom.size.y);
  const Vec3<T> above = mix(texel<T>(bloom, x, y), texel<T>(bloom, x + 1, y), wx);
  const Vec3<T> below = mix(texel<T>(bloom, x, y + 1), texel<T>(bloom, x + 1, y + 1), wx);
  return mix(above, below, wy);
}

template <class T>
Vec4<T> resolve(const Resolve& push, const Pixels& hdr, const Pixels& bloom, const uvec2& pixel) {
  const Vec3<T> scene = named(
      reported(texel<T>(hdr, pixel.x, pixel.y), "hdr") +
          reported(bloomAt<T>(bloom, push.size, pixel), "bloom") * input<T>(push.bloomIntensity),
      "scene");
  const Vec3<T> exposed =
      named(clamp(scene * input<T>(push.exposure), T(0), T(kMaxScene)), "exposed");
  const Vec3<T> display =
      named(clamp(reported(curve(push.curve, exposed), "curved"), T(0), T(1)), "display");
  return {map(display, [&](const T& x) { return transfer(push.transfer, x); }), T(1)};
}

template double reinhard(const double&);
template double narkowicz(const double&);
template Vec3<double> hill(const Vec3<double>&);
template double encodeGamma(const double&);
template double encodeSrgb(const double&);
template Vec3<double> curve(uint, const Vec3<double>&);
template double transfer(uint, const double&);
template Vec3<double> bloomAt(const Pixels&, const uvec2&, const uvec2&);
template Vec4<double> resolve(const Resolve&, const Pixels&, const Pixels&, const uvec2&);
template Bounded reinhard(const Bounded&);
template Bounded narkowicz(const Bounded&);
template Vec3<Bounded> hill(const Vec3<Bounded>&);
template Bounded encodeGamma(const Bounded&);
template Bounded encodeSrgb(const Bounded&);
template Vec3<Bounded> curve(uint, const Vec3<Bounded>&);
template Bounded transfer(uint, const Bounded&);
template Vec3<Bounded> bloomAt(const Pixels&, const uvec2&, const uvec2&);
template Vec4<Bounded> resolve(const Resolve&, const Pixels&, const Pixels&, const uvec2&);
template Altered reinhard(const Altered&);
template Altered narkowicz(const Altered&);
template Vec3<Altered> hill(const Vec3<Altered>&);
template Altered encodeGamma(const Altered&);
template Altered encodeSrgb(const Altered&);
template Vec3<Altered> curve(uint, const Vec3<Altered>&);
template Altered transfer(uint, const Altered&);
template Vec3<Altered> bloomAt(const Pixels&, const uvec2&, const uvec2&);
template Vec4<Altered> resolve(const Resolve&, const Pixels&, const Pixels&, const uvec2&);

}  // namespace gnomon::tonemap
