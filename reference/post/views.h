// CPU model of post/views: the debug views of a G-buffer.
#pragma once

#include "kernels/post/post.h"
#include "reference/bound/vec.h"

namespace gnomon::post {

/// Distance along the view axis of a reverse-Z depth d in (0, 1]: a projection with near -> 1 and
/// far -> 0 has d = n (f - z) / (z (f - n)), so z = n f / (n + d (f - n)).
template <class T>
T linearDepth(const T& d, const T& near, const T& far);

/// What the G-buffer holds at one pixel.
struct Surface {
  vec3 albedo;
  vec3 normal;
  float depth;
};

/// One pixel of the view, alpha 1. Joins nothing by itself: call it through explore().
template <class T>
Vec4<T> view(const Views& push, const Surface& surface);

}  // namespace gnomon::post
