#include "reference/culling/frustum.h"

#include <cmath>

#include "reference/bound/altered.h"

namespace gnomon::culling {

bool isUsable(const Bounds& sphere) {
  const auto usable = [](float x) { return std::abs(x) <= kMostWorld; };  // NaN is not
  return usable(sphere.centre.x) && usable(sphere.centre.y) && usable(sphere.centre.z) &&
         usable(sphere.radius) && !std::signbit(sphere.radius);
}

template <class T>
T inFrustum(const Camera& camera, const Bounds& sphere, const Frustum& push) {
  if (!isUsable(sphere)) return T(1);
  const Vec4<T> centre(input<T>(sphere.centre), input<T>(1.0f));
  const T radius = input<T>(sphere.radius) + input<T>(push.pad);
  const auto reaches = [&](const vec4& plane) { return dot(input<T>(plane), centre) >= -radius; };
  auto inside = reaches(camera.left) && reaches(camera.right) && reaches(camera.bottom) &&
                reaches(camera.top) && reaches(camera.farPlane);
  if (push.noNearPlane == 0) inside = inside && reaches(camera.nearPlane);
  return select(inside, T(1), T(0));
}

template double inFrustum(const Camera&, const Bounds&, const Frustum&);
template Bounded inFrustum(const Camera&, const Bounds&, const Frustum&);
template Altered inFrustum(const Camera&, const Bounds&, const Frustum&);

}  // namespace gnomon::culling
