#include "kernels/culling/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace gnomon::culling {
namespace {

glm::dvec4 row(const glm::dmat4& m, int r) { return {m[0][r], m[1][r], m[2][r], m[3][r]}; }

vec4 normalised(const glm::dvec4& plane, double longest) {
  const double length = glm::length(glm::dvec3(plane));
  return length < 0x1p-50 * longest ? vec4(0) : vec4(plane / length);
}

/// x and y of a frustum through that rectangle of the near plane; y downward.
glm::dmat4 frustumSides(double left, double right, double bottom, double top, double near) {
  glm::dmat4 p(0);
  p[0][0] = 2 * near / (right - left);
  p[2][0] = (right + left) / (right - left);
  p[1][1] = -2 * near / (top - bottom);
  p[2][1] = -(top + bottom) / (top - bottom);
  p[2][3] = -1;
  return p;
}

}  // namespace

glm::dmat4 offAxis(double left, double right, double bottom, double top, double near) {
  glm::dmat4 p = frustumSides(left, right, bottom, top, near);
  p[3][2] = near;
  return p;
}

glm::dmat4 perspective(double fovY, double aspect, double near) {
  const double top = near * std::tan(fovY / 2);
  return offAxis(-top * aspect, top * aspect, -top, top, near);
}

glm::dmat4 perspective(double fovY, double aspect, double near, double far) {
  glm::dmat4 p = perspective(fovY, aspect, near);
  p[2][2] = near / (far - near);
  p[3][2] = near * far / (far - near);
  return p;
}

glm::dmat4 orthographic(double left, double right, double bottom, double top, double near,
                        double far) {
  glm::dmat4 p(1);
  p[0][0] = 2 / (right - left);
  p[3][0] = -(right + left) / (right - left);
  p[1][1] = -2 / (top - bottom);
  p[3][1] = (top + bottom) / (top - bottom);
  p[2][2] = 1 / (far - near);
  p[3][2] = far / (far - near);
  return p;
}

Camera cameraOf(const glm::dmat4& view, const glm::dmat4& projection, double near) {
  const glm::dmat4 m = projection * view;
  const glm::dvec4 x = row(m, 0), y = row(m, 1), z = row(m, 2), w = row(m, 3);
  const std::array planes = {w + x, w - x, w - y, w + y, w - z, z};
  double longest = 0;
  for (const glm::dvec4& plane : planes)
    longest = std::max(longest, glm::length(glm::dvec3(plane)));
  const auto at = [&](std::size_t i) { return normalised(planes[i], longest); };
  return {.view = mat4(view),
          .projection = mat4(projection),
          .viewProjection = mat4(m),
          .left = at(0),
          .right = at(1),
          .bottom = at(2),
          .top = at(3),
          .nearPlane = at(4),
          .farPlane = at(5),
          .near = static_cast<float>(near)};
}

Bounds boundsOf(const glm::dmat4& transform, const glm::dvec3& centre, double radius) {
  const glm::dmat3 m(transform);
  const glm::dmat3 squares = glm::transpose(m) * m;
  double largest = 0;
  for (int r = 0; r < 3; ++r)
    largest = std::max(largest,
                       std::abs(squares[0][r]) + std::abs(squares[1][r]) + std::abs(squares[2][r]));
  const glm::dvec3 moved(transform * glm::dvec4(centre, 1));
  const vec3 rounded(moved);
  const double exact = std::sqrt(largest) * radius + glm::length(moved - glm::dvec3(rounded));
  const auto stored = static_cast<float>(exact);
  return {rounded, std::nextafter(stored, std::numeric_limits<float>::infinity())};
}

float padAgainstRounding(double extent) { return static_cast<float>(extent * 0x1p-18); }

}  // namespace gnomon::culling
