#include "harness/image/colour.h"

#include <array>
#include <cmath>

namespace gnomon {
namespace {

using Matrix = std::array<Vec, 3>;  // rows

constexpr Vec operator*(const Matrix& m, const Vec& v) {
  const auto dot = [&v](const Vec& row) { return row.x * v.x + row.y * v.y + row.z * v.z; };
  return {dot(m[0]), dot(m[1]), dot(m[2])};
}

constexpr Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// By Cramer's rule: the columns of the inverse are the rows' cross products over the determinant.
constexpr Matrix inverse(const Matrix& m) {
  const Vec a = cross(m[1], m[2]), b = cross(m[2], m[0]), c = cross(m[0], m[1]);
  const double det = m[0].x * a.x + m[0].y * a.y + m[0].z * a.z;
  return {{{a.x / det, b.x / det, c.x / det},
           {a.y / det, b.y / det, c.y / det},
           {a.z / det, b.z / det, c.z / det}}};
}

// The matrix follows from ITU-R BT.709-6, table 1: the chromaticities of the primaries and of D65.
// A column holds a primary's XYZ at Y = 1; its scale is such that (1, 1, 1) makes white.

constexpr Vec fromChromaticity(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

constexpr Vec kWhite = fromChromaticity(0.3127, 0.3290);

constexpr Matrix xyzFromRgb() {
  const Vec r = fromChromaticity(0.64, 0.33), g = fromChromaticity(0.30, 0.60),
            b = fromChromaticity(0.15, 0.06);
  const Matrix primaries = {{{r.x, g.x, b.x}, {r.y, g.y, b.y}, {r.z, g.z, b.z}}};
  const Vec s = inverse(primaries) * kWhite;
  return {{{r.x * s.x, g.x * s.y, b.x * s.z},
           {r.y * s.x, g.y * s.y, b.y * s.z},
           {r.z * s.x, g.z * s.y, b.z * s.z}}};
}

constexpr Matrix kXyzFromRgb = xyzFromRgb();
constexpr Matrix kRgbFromXyz = inverse(kXyzFromRgb);

/// CIE 15:2004, eq. 8.6 to 8.8: cube root, with a line below (6/29)^3.
double labCurve(double t) {
  constexpr double kDelta = 6.0 / 29;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
}

}  // namespace

Vec ycxczFromRgb(const Vec& rgb) {
  const Vec c = kXyzFromRgb * rgb;
  const double x = c.x / kWhite.x, y = c.y / kWhite.y, z = c.z / kWhite.z;
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Vec rgbFromYcxcz(const Vec& v) {
  const double y = (v.x + 16) / 116, x = y + v.y / 500, z = y - v.z / 200;
  return kRgbFromXyz * Vec{x * kWhite.x, y * kWhite.y, z * kWhite.z};
}

Vec huntLabFromRgb(const Vec& rgb) {
  const Vec c = kXyzFromRgb * rgb;
  const double x = labCurve(c.x / kWhite.x), y = labCurve(c.y / kWhite.y),
               z = labCurve(c.z / kWhite.z);
  const double L = 116 * y - 16;
  return {L, 0.01 * L * 500 * (x - y), 0.01 * L * 200 * (y - z)};
}

double hyab(const Vec& a, const Vec& b) {
  return std::abs(a.x - b.x) + std::sqrt((a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z));
}

}  // namespace gnomon
