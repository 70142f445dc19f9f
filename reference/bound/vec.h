// Vectors and matrices of a model, over double or Bounded, with the shader's names for members and
// built-ins. GLM's own templates refuse foreign number types.
//
// + - * / and scalar products are componentwise and correctly rounded. dot, length, distance,
// normalize, cross, reflect and the matrix products inherit their precision from formulas, so for
// Bounded they are bounded over every order of evaluation (sum.h).
#ifndef GNOMON_REFERENCE_BOUND_VEC_H
#define GNOMON_REFERENCE_BOUND_VEC_H

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "reference/bound/builtins.h"
#include "reference/bound/sum.h"

namespace gnomon {

template <class T>
struct Vec2 {
  using Scalar = T;
  static constexpr std::size_t kSize = 2;
  T x{}, y{};

  Vec2() = default;
  Vec2(T x_, T y_) : x(x_), y(y_) {}
  explicit Vec2(T all) : x(all), y(all) {}
  T& operator[](std::size_t i) { return i == 0 ? x : y; }
  const T& operator[](std::size_t i) const { return i == 0 ? x : y; }
  auto scalars() { return std::tie(x, y); }
};

template <class T>
struct Vec3 {
  using Scalar = T;
  static constexpr std::size_t kSize = 3;
  T x{}, y{}, z{};

  Vec3() = default;
  Vec3(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
  Vec3(const Vec2<T>& xy_, T z_) : x(xy_.x), y(xy_.y), z(z_) {}
  explicit Vec3(T all) : x(all), y(all), z(all) {}
  T& operator[](std::size_t i) { return i == 0 ? x : i == 1 ? y : z; }
  const T& operator[](std::size_t i) const { return i == 0 ? x : i == 1 ? y : z; }
  Vec2<T> xy() const { return {x, y}; }
  auto scalars() { return std::tie(x, y, z); }
};

template <class T>
struct Vec4 {
  using Scalar = T;
  static constexpr std::size_t kSize = 4;
  T x{}, y{}, z{}, w{};

  Vec4() = default;
  Vec4(T x_, T y_, T z_, T w_) : x(x_), y(y_), z(z_), w(w_) {}
  Vec4(const Vec3<T>& xyz_, T w_) : x(xyz_.x), y(xyz_.y), z(xyz_.z), w(w_) {}
  explicit Vec4(T all) : x(all), y(all), z(all), w(all) {}
  T& operator[](std::size_t i) { return i < 2 ? (i == 0 ? x : y) : (i == 2 ? z : w); }
  const T& operator[](std::size_t i) const { return i < 2 ? (i == 0 ? x : y) : (i == 2 ? z : w); }
  Vec2<T> xy() const { return {x, y}; }
  Vec3<T> xyz() const { return {x, y, z}; }
  auto scalars() { return std::tie(x, y, z, w); }
};

template <class V>
concept AnyVec = requires {
  typename V::Scalar;
  V::kSize;
};

// f for each component.
template <AnyVec V, class F>
V map(const V& a, const F& f) {
  V result;
  for (std::size_t i = 0; i < V::kSize; ++i) result[i] = f(a[i]);
  return result;
}
template <AnyVec V, class F>
V zip(const V& a, const V& b, const F& f) {
  V result;
  for (std::size_t i = 0; i < V::kSize; ++i) result[i] = f(a[i], b[i]);
  return result;
}

template <AnyVec V>
using ScalarOf = typename V::Scalar;

template <AnyVec V>
V operator-(const V& a) {
  return map(a, [](const auto& x) { return -x; });
}
template <AnyVec V>
V operator+(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return x + y; });
}
template <AnyVec V>
V operator-(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return x - y; });
}
template <AnyVec V>
V operator*(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return x * y; });
}
template <AnyVec V>
V operator/(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return x / y; });
}
template <AnyVec V>
V operator+(const V& a, const ScalarOf<V>& s) {
  return a + V(s);
}
template <AnyVec V>
V operator-(const V& a, const ScalarOf<V>& s) {
  return a - V(s);
}
template <AnyVec V>
V operator*(const V& a, const ScalarOf<V>& s) {
  return a * V(s);
}
template <AnyVec V>
V operator*(const ScalarOf<V>& s, const V& a) {
  return V(s) * a;
}
template <AnyVec V>
V operator/(const V& a, const ScalarOf<V>& s) {
  return a / V(s);
}
template <AnyVec V, class B>
V& operator+=(V& a, const B& b) {
  return a = a + b;
}
template <AnyVec V, class B>
V& operator-=(V& a, const B& b) {
  return a = a - b;
}
template <AnyVec V, class B>
V& operator*=(V& a, const B& b) {
  return a = a * b;
}
template <AnyVec V, class B>
V& operator/=(V& a, const B& b) {
  return a = a / b;
}

template <AnyVec V>
V min(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return min(x, y); });
}
template <AnyVec V>
V max(const V& a, const V& b) {
  return zip(a, b, [](const auto& x, const auto& y) { return max(x, y); });
}
template <AnyVec V>
V min(const V& a, const ScalarOf<V>& s) {
  return min(a, V(s));
}
template <AnyVec V>
V max(const V& a, const ScalarOf<V>& s) {
  return max(a, V(s));
}
template <AnyVec V>
V clamp(const V& a, const ScalarOf<V>& lo, const ScalarOf<V>& hi) {
  return map(a, [&](const auto& x) { return clamp(x, lo, hi); });
}
template <AnyVec V>
V abs(const V& a) {
  return map(a, [](const auto& x) { return abs(x); });
}
template <AnyVec V>
V floor(const V& a) {
  return map(a, [](const auto& x) { return floor(x); });
}
template <AnyVec V>
V fract(const V& a) {
  return map(a, [](const auto& x) { return fract(x); });
}
template <AnyVec V>
V mix(const V& a, const V& b, const ScalarOf<V>& t) {
  return zip(a, b, [&](const auto& x, const auto& y) { return mix(x, y, t); });
}
template <AnyVec V>
V mix(const V& a, const V& b, const V& t) {
  V result;
  for (std::size_t i = 0; i < V::kSize; ++i) result[i] = mix(a[i], b[i], t[i]);
  return result;
}
template <class Condition, AnyVec V>
V select(const Condition& condition, const V& a, const V& b) {
  return zip(a, b, [&](const auto& x, const auto& y) { return select(condition, x, y); });
}
template <AnyVec V>
std::array<ScalarOf<V>, V::kSize> components(const V& a) {
  std::array<ScalarOf<V>, V::kSize> result;
  for (std::size_t i = 0; i < V::kSize; ++i) result[i] = a[i];
  return result;
}
template <AnyVec V>
V reported(const V& a, const char* name) {
  if constexpr (std::is_same_v<ScalarOf<V>, Bounded>) {
    const auto all = components(a);
    detail::report(all.data(), all.size(), name);
  }
  return a;
}
template <AnyVec V>
V named(const V& a, const char* name) {
  if constexpr (std::is_same_v<ScalarOf<V>, Bounded>)
    return reported(map(a, detail::widenedByRules), name);
  else
    return a;
}

template <AnyVec V>
ScalarOf<V> dot(const V& a, const V& b) {
  const auto u = components(a), v = components(b);
  return dot(std::span(u), std::span(v));
}
// dot(a, a), which knows that both sides are the same: never negative.
template <AnyVec V>
ScalarOf<V> lengthSquared(const V& a) {
  const auto u = components(a);
  return lengthSquared(std::span(u));
}
template <AnyVec V>
ScalarOf<V> length(const V& a) {
  const auto u = components(a);
  return length(std::span(u));
}
template <AnyVec V>
ScalarOf<V> distance(const V& a, const V& b) {
  return length(a - b);
}
template <AnyVec V>
V normalize(const V& a) {
  const auto u = components(a);
  V result;
  for (std::size_t i = 0; i < V::kSize; ++i) result[i] = normalizedComponent(std::span(u), i);
  return result;
}
template <AnyVec V>
V reflect(const V& incident, const V& normal) {
  const auto i = components(incident), n = components(normal);
  V result;
  for (std::size_t k = 0; k < V::kSize; ++k)
    result[k] = reflectedComponent(std::span(i), std::span(n), k);
  return result;
}
// OpFSub(OpFMul, OpFMul): a sum of two products.
template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  const auto minor = [](const T& p, const T& q, const T& r, const T& s) {
    return dot(Vec2<T>(p, -r), Vec2<T>(q, s));
  };
  return {minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}

// Column-major: m[c] is column c.
template <AnyVec V>
struct Mat {
  using Column = V;
  static constexpr std::size_t kSize = V::kSize;
  std::array<V, kSize> columns{};

  V& operator[](std::size_t c) { return columns[c]; }
  const V& operator[](std::size_t c) const { return columns[c]; }
  auto scalars() { return std::tie(columns); }
};
template <class T>
using Mat3 = Mat<Vec3<T>>;
template <class T>
using Mat4 = Mat<Vec4<T>>;

template <AnyVec V>
Mat<V> transpose(const Mat<V>& m) {
  Mat<V> result;
  for (std::size_t c = 0; c < V::kSize; ++c)
    for (std::size_t r = 0; r < V::kSize; ++r) result[r][c] = m[c][r];
  return result;
}
template <AnyVec V>
V operator*(const V& v, const Mat<V>& m) {
  V result;
  for (std::size_t c = 0; c < V::kSize; ++c) result[c] = dot(v, m[c]);
  return result;
}
template <AnyVec V>
V operator*(const Mat<V>& m, const V& v) {
  return v * transpose(m);
}
template <AnyVec V>
Mat<V> operator*(const Mat<V>& a, const Mat<V>& b) {
  const Mat<V> rows = transpose(a);
  Mat<V> result;
  for (std::size_t c = 0; c < V::kSize; ++c) result[c] = b[c] * rows;
  return result;
}

// A kernel's inputs, from the contract's types: a double takes the value, a Bounded is
// Bounded::input, an Altered is Altered::input.
template <class T>
T input(float x) {
  if constexpr (std::is_same_v<T, double>) {
    return x;
  } else {
    return T::input(x);
  }
}
template <class T>
Vec2<T> input(const glm::vec2& v) {
  return {input<T>(v.x), input<T>(v.y)};
}
template <class T>
Vec3<T> input(const glm::vec3& v) {
  return {input<T>(v.x), input<T>(v.y), input<T>(v.z)};
}
template <class T>
Vec4<T> input(const glm::vec4& v) {
  return {input<T>(v.x), input<T>(v.y), input<T>(v.z), input<T>(v.w)};
}
template <class T>
Mat3<T> input(const glm::mat3& m) {
  return {{input<T>(m[0]), input<T>(m[1]), input<T>(m[2])}};
}
template <class T>
Mat4<T> input(const glm::mat4& m) {
  return {{input<T>(m[0]), input<T>(m[1]), input<T>(m[2]), input<T>(m[3])}};
}

}  // namespace gnomon

#endif
