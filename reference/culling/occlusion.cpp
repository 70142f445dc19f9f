#include "reference/culling/occlusion.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "reference/bound/altered.h"
#include "reference/culling/frustum.h"

namespace gnomon::culling {
namespace {

/// A pixel's coordinate: what the double model has, and between what it may be.
struct Coordinate {
  std::int64_t value = 0, least = 0, most = 0;
};

Coordinate pixelAt(const Bounded& x) {
  const auto whole = [](double at) { return static_cast<std::int64_t>(std::floor(at)); };
  return {whole(x.value), whole(x.lo), whole(x.hi)};
}
Coordinate pixelAt(double x) {
  const auto at = static_cast<std::int64_t>(std::floor(x));
  return {at, at, at};
}
Coordinate pixelAt(const Altered& x) { return pixelAt(x.value); }

/// First and last pixel along one axis.
struct PixelRange {
  Coordinate first, last;
};

/// From clip coordinates to pixels, clamped to the screen.
template <class T>
Slopes<T> onScreen(const Slopes<T>& clip, uint size) {
  const auto pixel = [&](const T& at) {
    const T scaled = (at * T(0.5f) + T(0.5f)) * input<T>(static_cast<float>(size));
    return clamp(scaled, T(0), input<T>(static_cast<float>(size - 1)));
  };
  return {pixel(clip.least), pixel(clip.most)};
}

template <class T>
PixelRange rangeOf(const Slopes<T>& pixels) {
  return {pixelAt(pixels.least), pixelAt(pixels.most)};
}

template <class T>
Slopes<T> ordered(const T& a, const T& b) {
  return {min(a, b), max(a, b)};
}

/// A row of a projection: what it makes of one axis. Of perspective (scale x + skew z) / -z, of
/// an orthographic one scale x + shift.
template <class T>
struct Axis {
  T scale, skew, shift;
};
template <class T>
Axis<T> axisOf(const mat4& projection, int row) {
  return {input<T>(projection[row][row]), input<T>(projection[2][row]),
          input<T>(projection[3][row])};
}

bool isPerspective(const Camera& camera) { return camera.projection[2][3] != 0; }

/// The sphere in view space; d is the distance of its centre along the view axis.
template <class T>
struct Seen {
  T x, y, d, r, nearest;
};

template <class T>
Seen<T> seenBy(const Camera& camera, const Bounds& sphere, float pad) {
  const Vec4<T> c = input<T>(camera.view) * Vec4<T>(input<T>(sphere.centre), input<T>(1.0f));
  const T d = -c.z, r = input<T>(sphere.radius) + input<T>(pad);
  return {c.x, c.y, d, r, d - r};
}

template <class T>
Slopes<T> covered(const T& c, const Seen<T>& s, const Axis<T>& axis, bool perspective) {
  if (!perspective)
    return ordered(axis.scale * (c - s.r) + axis.shift, axis.scale * (c + s.r) + axis.shift);
  const Slopes<T> slopes = tangents(c, s.d, s.r, s.nearest);
  return ordered(axis.scale * slopes.least - axis.skew, axis.scale * slopes.most - axis.skew);
}

/// Reverse-Z depth at a distance along the view axis.
template <class T>
T depthAt(const T& distance, const Camera& camera) {
  const T a = input<T>(camera.projection[2][2]), b = input<T>(camera.projection[3][2]);
  return isPerspective(camera) ? b / distance - a : b - a * distance;
}

enum class Form { kValue, kLargest, kSmallest };

PixelRect rectOf(const PixelRange& x, const PixelRange& y, Form form) {
  const auto first = [&](const Coordinate& c) {
    return form == Form::kValue ? c.value : form == Form::kLargest ? c.least : c.most;
  };
  const auto last = [&](const Coordinate& c) {
    return form == Form::kValue ? c.value : form == Form::kLargest ? c.most : c.least;
  };
  return {first(x.first), last(x.last), first(y.first), last(y.last)};
}

template <class T>
T notHidden(const T& z, const PixelRange& x, const PixelRange& y, const Pyramid& pyramid) {
  const auto nearerThan = [&](Form form) {
    const PixelRect rect = rectOf(x, y, form);
    if (rect.x0 > rect.x1 || rect.y0 > rect.y1) return T(0);  // nobody knows which pixel
    return select(z >= input<T>(farthestIn(pyramid, rect)), T(1), T(0));
  };
  if constexpr (std::is_same_v<T, Bounded>)
    return join(nearerThan(Form::kValue),
                join(nearerThan(Form::kLargest), nearerThan(Form::kSmallest)));
  else
    return nearerThan(Form::kValue);
}

}  // namespace

template <class T>
Slopes<T> tangents(const T& c, const T& d, const T& r, const T& nearest) {
  const T x = abs(c) / d, rho = r / d;
  const T rest = nearest / d * (T(1) + rho);  // 1 - rho^2
  const T t = sqrt(square(x) + rest);
  const T sum = t + rho * x;
  const T far = (t * x + rho) * sum / (rest * (T(1) + square(x)));
  const T near = (t * x - rho) / sum;
  const auto mirrored = c < input<T>(0.0f);
  return {select(mirrored, -far, near), select(mirrored, -near, far)};
}

float Pyramid::farthest(uint level, uint x, uint y) const {
  return levels[level][std::size_t{y} * std::max(size.x >> level, 1u) + x];
}

uint queryLevel(const PixelRect& rect, const uvec2& size) {
  const auto side = static_cast<std::uint64_t>(std::max(rect.x1 - rect.x0, rect.y1 - rect.y0) + 1);
  uint level = 0;
  while ((std::uint64_t{1} << level) < side) ++level;
  uint last = 0;
  while (std::max(size.x, size.y) >> (last + 1) > 0) ++last;
  return std::min(level, last);
}

float farthestIn(const Pyramid& pyramid, const PixelRect& rect) {
  const uint level = queryLevel(rect, pyramid.size);
  const auto texel = [&](std::int64_t pixel, uint pixels) {
    return std::min(static_cast<uint>(pixel) >> level, std::max(pixels >> level, 1u) - 1);
  };
  float farthest = std::numeric_limits<float>::infinity();
  for (const std::int64_t y : {rect.y0, rect.y1})
    for (const std::int64_t x : {rect.x0, rect.x1})
      farthest = std::min(
          farthest, pyramid.farthest(level, texel(x, pyramid.size.x), texel(y, pyramid.size.y)));
  return farthest;
}

template <class T>
Sight<T> sightOf(const Camera& camera, const Bounds& sphere, const Occlusion& push,
                 const Pyramid& pyramid) {
  if (!isUsable(sphere)) return {.visible = T(1)};
  const Seen<T> s = seenBy<T>(camera, sphere, push.pad);
  const auto crosses = s.nearest < input<T>(camera.near);
  if (certainly(crosses)) return {.visible = T(1)};
  const bool perspective = isPerspective(camera);
  const auto steep = max(abs(s.x), abs(s.y)) > input<T>(kSteepest) * s.d;
  if (perspective && certainly(steep)) return {.visible = T(1)};
  const Slopes<T> x =
      onScreen(covered(s.x, s, axisOf<T>(camera.projection, 0), perspective), push.size.x);
  const Slopes<T> y =
      onScreen(covered(s.y, s, axisOf<T>(camera.projection, 1), perspective), push.size.y);
  const T depth = depthAt(s.nearest, camera);
  const T shown = notHidden(depth, rangeOf(x), rangeOf(y), pyramid);
  const auto kept = perspective ? crosses || steep : crosses;
  return {select(kept, T(1), shown), x.least, x.most, y.least, y.most, depth};
}

template Slopes<double> tangents(const double&, const double&, const double&, const double&);
template Slopes<Altered> tangents(const Altered&, const Altered&, const Altered&, const Altered&);
template Sight<double> sightOf(const Camera&, const Bounds&, const Occlusion&, const Pyramid&);
template Sight<Bounded> sightOf(const Camera&, const Bounds&, const Occlusion&, const Pyramid&);
template Sight<Altered> sightOf(const Camera&, const Bounds&, const Occlusion&, const Pyramid&);

}  // namespace gnomon::culling
