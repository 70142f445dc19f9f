// CPU model of culling/occlusion: what a sphere covers of the screen, against the pyramid of
// farthest depths.
#pragma once

#include <tuple>
#include <vector>

#include "kernels/culling/culling.h"
#include "reference/bound/vec.h"

namespace gnomon::culling {

/// The slopes x / d at which the planes through the eye and parallel to the other axis touch a
/// sphere: Mara and McGuire 2013, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D
/// Sphere", section 2.
///
/// With the eye in the origin, the sphere's centre C = (c, d), its radius r and the tangents'
/// length t^2 = c^2 + d^2 - r^2, the points of contact are C turned by -+ the angle whose cosine is
/// t / |C| and whose sine is r / |C|. Their slopes are (t c -+ r d) / (t d +- r c). Divided by d
/// throughout, with x = c / d and rho = r / d: (t' x -+ rho) / (t' +- rho x), t'^2 = x^2 + 1 -
/// rho^2. For x >= 0 the far side's denominator cancels where the sphere reaches near the eye; it
/// is multiplied by its conjugate, t'^2 - rho^2 x^2 = (1 - rho^2) (1 + x^2), and 1 - rho comes from
/// the nearest distance, which the caller has.
template <class T>
struct Slopes {
  T least, most;
  auto scalars() { return std::tie(least, most); }
};
/// The sphere lies wholly before the eye: nearest = d - r > 0, r >= 0.
template <class T>
Slopes<T> tangents(const T& c, const T& d, const T& r, const T& nearest);

/// A depth buffer with its pyramid, as culling/hiz has it.
struct Pyramid {
  uvec2 size{1, 1};
  std::vector<std::vector<float>> levels{};  ///< from the depth buffer itself; rows tight

  float farthest(uint level, uint x, uint y) const;
};

/// What the query reads for the pixels [x0, x1] x [y0, y1] of the screen.
struct PixelRect {
  std::int64_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
};
/// The smallest L with 2^L >= the longer side, in whole numbers; at most the last level.
uint queryLevel(const PixelRect& rect, const uvec2& size);
/// The farthest depth of the texels that hold the rectangle's corners on that level.
float farthestIn(const Pyramid& pyramid, const PixelRect& rect);

/// What decides whether a sphere, grown by push.pad, is hidden.
template <class T>
struct Sight {
  /// 1 where it is not, 0 where it is; of bounds both, where rounding may decide.
  T visible{};
  /// Where its edges are, in pixels, clamped to [0, size - 1] (rows from the top), and the depth of
  /// its nearest point (reverse-Z). 0 where it is visible whatever they are.
  T left{}, right{}, top{}, bottom{}, depth{};
  auto scalars() { return std::tie(visible, left, right, top, bottom, depth); }
};

/// More pixels never make a sphere less visible (their texels are inside those of fewer pixels,
/// whose farthest depth is no nearer), so an uncertain rectangle is visible for sure where its
/// smallest form is, and hidden for sure where its largest is.
template <class T>
Sight<T> sightOf(const Camera& camera, const Bounds& sphere, const Occlusion& push,
                 const Pyramid& pyramid);

template <class T>
T unoccluded(const Camera& camera, const Bounds& sphere, const Occlusion& push,
             const Pyramid& pyramid) {
  return sightOf<T>(camera, sphere, push, pyramid).visible;
}

}  // namespace gnomon::culling
