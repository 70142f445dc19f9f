#include "reference/post/views.h"

#include <array>
#include <cmath>

#include "reference/bound/altered.h"
#include "reference/bound/builtins.h"

namespace gnomon::post {
namespace {

float finiteOrZero(float x) { return std::isfinite(x) ? x : 0.0f; }

template <class T>
Vec3<T> finiteInput(const vec3& v) {
  return {input<T>(finiteOrZero(v.x)), input<T>(finiteOrZero(v.y)), input<T>(finiteOrZero(v.z))};
}

/// The cascade whose range holds the distance, and where that range begins and ends.
template <class T>
struct Cascade {
  int number;
  vec3 colour;
  T begin, end;
  bool last;
};

template <class T>
Cascade<T> cascadeAt(const T& distance, const Views& push) {
  const std::array colours = {kCascadeColour0, kCascadeColour1, kCascadeColour2, kCascadeColour3};
  T begin = input<T>(push.near);
  for (int i = 0; i < 3; ++i) {
    const T end = input<T>(push.splits[i]);
    if (distance <= end) return {i, colours[static_cast<std::size_t>(i)], begin, end, false};
    begin = end;
  }
  return {3, colours[3], begin, input<T>(push.splits[3]), true};
}

template <class T>
Vec3<T> cascadeView(const T& distance, const Vec3<T>& albedo, const Views& push) {
  const Cascade<T> cascade = cascadeAt(distance, push);
  reported(input<T>(static_cast<float>(cascade.number)), "cascade");
  const vec3 tint = kCascadeTint * cascade.colour;  // a float product, as a compiler folds it
  const Vec3<T> shown = reported(input<T>(tint) + T(kCascadeDim) * albedo, "tinted");
  if (cascade.last) return shown;
  const T blendStart =
      reported(cascade.end - T(kCascadeBlend) * (cascade.end - cascade.begin), "blendStart");
  return select(distance > blendStart, T(kBlendBrighter) * shown, shown);
}

template <class T>
Vec3<T> shown(const Views& push, const Surface& surface, const T& depth) {
  const Vec3<T> albedo = reported(clamp(finiteInput<T>(surface.albedo), T(0), T(1)), "albedo");
  const auto distance = [&] {
    return reported(linearDepth(depth, input<T>(push.near), input<T>(push.far)), "distance");
  };
  switch (push.mode) {
    case kNormal:
      return finiteInput<T>(surface.normal);
    case kDepth:
      return Vec3<T>(distance() / input<T>(push.far));
    case kCascades:
      return cascadeView(distance(), albedo, push);
    default:
      return albedo;
  }
}

}  // namespace

template <class T>
T linearDepth(const T& d, const T& near, const T& far) {
  return near * far / (near + d * (far - near));
}

template <class T>
Vec4<T> view(const Views& push, const Surface& surface) {
  const T depth = reported(clamp(input<T>(finiteOrZero(surface.depth)), T(0), T(1)), "depth");
  if (depth == T(0)) return {Vec3<T>(T(0)), T(1)};  // sky
  return {clamp(reported(shown(push, surface, depth), "shown"), T(0), T(1)), T(1)};
}

template double linearDepth(const double&, const double&, const double&);
template Vec4<double> view(const Views&, const Surface&);
template Vec4<Bounded> view(const Views&, const Surface&);
template Altered linearDepth(const Altered&, const Altered&, const Altered&);
template Vec4<Altered> view(const Views&, const Surface&);

}  // namespace gnomon::post
