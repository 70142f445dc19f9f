#include "harness/scene/sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <half.h>

#include "harness/cases/random.h"

namespace gnomon {
namespace {

using glm::dvec2;
using glm::dvec3;
using std::numbers::pi;

constexpr double kLargestHalf = 65504;  // (2 - 2^-10) 2^15

// Sunlight: IES Lighting Handbook, "Daylighting": illuminance outside the atmosphere in klx, and
// a clear sky's extinction for each air mass.
constexpr double kSolarConstant = 127.5, kExtinction = 0.21;

// CIE illuminant B stands for direct sunlight at noon (4874 K): Wyszecki, Stiles 1982, "Color
// Science".
constexpr XyY kSunlight = {0.34842, 0.35161, 1};

// Choices of composition: metres, and the angle from the camera's axes to the squares' sides.
constexpr double kEyeHeight = 1.6, kSquare = 1.8, kGroundTurn = 30 * kDegree;

// Squares repeat after so many; samples a pixel and axis against jagged edges.
constexpr int kTiles = 64, kSamples = 4;

// Random numbers of tiles and specks; how many specks a frame of kSkyWidth x kSkyHeight has.
constexpr std::uint64_t kTileSeed = 1, kSpeckSeed = 2, kSpecks = 300;

// Reflectances. Half of the squares are grey: mid-grey (twice as often), paper, stone, coal, a
// perfect trap for light, and carbon nanotubes (4e-4, which gives values below 1e-3).
constexpr std::array<double, 7> kGreys = {0.18, 0.18, 0.80, 0.40, 0.04, 0, 4e-4};

// The other half: paints, then three primaries pure, which give zeros.
const std::array<dvec3, 11> kPaints = {{{0.46, 0.06, 0.04},
                                        {0.62, 0.20, 0.03},
                                        {0.70, 0.48, 0.05},
                                        {0.10, 0.30, 0.06},
                                        {0.05, 0.25, 0.28},
                                        {0.04, 0.10, 0.38},
                                        {0.25, 0.06, 0.22},
                                        {0.50, 0.33, 0.22},
                                        {0.30, 0, 0},
                                        {0, 0.22, 0},
                                        {0, 0, 0.30}}};

double linear(double slope, double T, double constant) { return slope * T + constant; }

/// Rows for T^2, T, 1; columns for thetaS^3, thetaS^2, thetaS, 1.
using Polynomial = std::array<std::array<double, 4>, 3>;

double evaluate(const Polynomial& m, double T, double thetaS) {
  const auto row = [thetaS](const std::array<double, 4>& c) {
    return ((c[0] * thetaS + c[1]) * thetaS + c[2]) * thetaS + c[3];
  };
  return (row(m[0]) * T + row(m[1])) * T + row(m[2]);
}

/// Between unit vectors; the arctangent keeps its digits at small angles, where acos loses half.
double angleBetween(const dvec3& a, const dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Illuminance in klx of a plane that faces the sun: IES Lighting Handbook, E exp(-c m), with the
/// air mass m = 1 / sin(elevation) of a flat atmosphere.
double sunIlluminance() {
  return kSolarConstant * std::exp(-kExtinction / std::sin(kSunElevation));
}

/// In kcd/m^2, the illuminance over the solid angle 2 pi (1 - cos r) of the real disk, so an
/// enlarged disk is as bright.
dvec3 sunRadiance() {
  const double halfSine = std::sin(kSunRadius / 2);
  return rgbFromXyY(kSunlight) * (sunIlluminance() / (4 * pi * halfSine * halfSine));
}

/// What white ground reflects, in kcd/m^2: Lambert, (E_sun sin(elevation) + E_sky) / pi. A sky as
/// bright as its zenith all over gives E_sky = pi Y.
dvec3 groundLight() {
  const double E = sunIlluminance() * std::sin(kSunElevation);
  return rgbFromXyY(kSunlight) * (E / pi) + rgbFromXyY(zenith(kTurbidity, pi / 2 - kSunElevation));
}

/// Luminance: ITU-R BT.709-6, table 3.
double luminance(const dvec3& rgb) { return glm::dot(rgb, dvec3(0.2126, 0.7152, 0.0722)); }

/// Squares of a plane that repeats: grey and paint in turn.
class Ground {
 public:
  Ground() : tiles(std::size_t{kTiles} * kTiles) {
    Random random(kTileSeed);
    for (int j = 0; j < kTiles; ++j)
      for (int i = 0; i < kTiles; ++i) {
        const dvec3 tile = (i + j) % 2 == 0 ? dvec3(kGreys[random.below(kGreys.size())])
                                            : kPaints[random.below(kPaints.size())];
        tiles[index(i, j)] = tile;
        mean += tile / static_cast<double>(tiles.size());
      }
  }

  /// The reflectance where a ray below the horizon meets the ground. The camera stands in the
  /// middle of a square: on a side, that side would be upright in the frame.
  dvec3 at(const dvec3& ray) const {
    const dvec2 p = dvec2(ray) * (-kEyeHeight / ray.z) / kSquare;
    const double c = std::cos(kGroundTurn), s = std::sin(kGroundTurn);
    return tiles[index(square(c * p.x - s * p.y + 0.5), square(s * p.x + c * p.y + 0.5))];
  }

  dvec3 average() const { return mean; }

 private:
  /// In [0, kTiles); reduced as a double, since far squares exceed an int.
  static int square(double x) {
    return static_cast<int>(std::floor(x) - kTiles * std::floor(std::floor(x) / kTiles));
  }
  static std::size_t index(int i, int j) { return static_cast<std::size_t>(j * kTiles + i); }

  std::vector<dvec3> tiles;
  dvec3 mean{};
};

/// Share of the mean in a pixel's reflectance: squares that a pixel cannot resolve fade into it. A
/// pixel covers d^2 / (focal height) of ground in depth, d = height focal / rows below the horizon.
double faded(const SkyCamera& camera, double rows) {
  const double covered = kEyeHeight * camera.focal / (rows * rows) / kSquare;
  const double t = std::clamp((covered - 0.25) / 1.75, 0.0, 1.0);  // from 1/4 square to 2
  return t * t * (3 - 2 * t);
}

dvec3 reflectance(const Ground& ground, const SkyCamera& camera, const dvec2& corner) {
  const double far = faded(camera, corner.y + 0.5 - camera.centre.y);
  if (far == 1) return ground.average();
  dvec3 sum(0);
  for (int j = 0; j < kSamples; ++j)
    for (int i = 0; i < kSamples; ++i)
      sum += ground.at(camera.ray(corner + (dvec2(i, j) + 0.5) / double{kSamples}));
  return glm::mix(sum / double{kSamples * kSamples}, ground.average(), far);
}

/// Share of a pixel that the disk covers, by the distance of its centre from the disk's edge.
double sunCoverage(const SkyCamera& camera, const dvec3& ray) {
  const double pixels = (sunRadiusIn(camera) - angleBetween(ray, sunDirection())) * camera.focal;
  return std::clamp(pixels + 0.5, 0.0, 1.0);
}

dvec3 skyRadiance(const SkyCamera& camera, const dvec3& ray) {
  const dvec3 sky = rgbFromXyY(clearSky(kTurbidity, sunDirection(), ray));
  return glm::mix(sky, sunRadiance(), sunCoverage(camera, ray));
}

float toHalf(double x) { return Imath::half(static_cast<float>(std::clamp(x, 0.0, kLargestHalf))); }

void set(Image& image, int x, int y, const dvec3& rgb) {
  image.at(x, y, 0) = toHalf(rgb.z);
  image.at(x, y, 1) = toHalf(rgb.y);
  image.at(x, y, 2) = toHalf(rgb.x);
}

/// A pure colour or white, times `value`.
dvec3 tinted(std::uint64_t tint, double value) {
  const std::array<dvec3, 4> tints = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}};
  return tints[tint] * value;
}

/// As many for each pixel as in the stored frame. The last three are the largest half in red,
/// green and blue.
void addSpecks(Image& image) {
  Random random(kSpeckSeed);
  const std::uint64_t count = kSpecks * image.pixels() / (kSkyWidth * kSkyHeight) + 3;
  const auto draw = [&random](int n) {
    return static_cast<int>(random.below(static_cast<std::uint64_t>(n)));
  };
  for (std::uint64_t i = 0; i < count; ++i) {
    const int x = draw(image.width), y = draw(image.height), size = 1 + draw(2);
    const std::uint64_t tint = random.below(4), left = count - 1 - i;
    const double value = random.logUniform(1, kLargestHalf);
    const dvec3 rgb = left < 3 ? tinted(2 - left, kLargestHalf) : tinted(tint, value);
    for (int v = y; v < std::min(y + size, image.height); ++v)
      for (int u = x; u < std::min(x + size, image.width); ++u) set(image, u, v, rgb);
  }
}

}  // namespace

// Eq. 3: (1 + A e^(B / cos theta)) (1 + C e^(D gamma) + E cos^2 gamma).
double perez(const Perez& p, double cosTheta, double gamma) {
  const double cosGamma = std::cos(gamma);
  return (1 + p.A * std::exp(p.B / cosTheta)) *
         (1 + p.C * std::exp(p.D * gamma) + p.E * cosGamma * cosGamma);
}

// Appendix A.2.
PerezXyY perezParameters(double T) {
  return {.x = {linear(-0.0193, T, -0.2592), linear(-0.0665, T, 0.0008), linear(-0.0004, T, 0.2125),
                linear(-0.0641, T, -0.8989), linear(-0.0033, T, 0.0452)},
          .y = {linear(-0.0167, T, -0.2608), linear(-0.0950, T, 0.0092), linear(-0.0079, T, 0.2102),
                linear(-0.0441, T, -1.6537), linear(-0.0109, T, 0.0529)},
          .Y = {linear(0.1787, T, -1.4630), linear(-0.3554, T, 0.4275), linear(-0.0227, T, 5.3251),
                linear(0.1206, T, -2.5771), linear(-0.0670, T, 0.3703)}};
}

// Appendix A.2: Y = (4.0453 T - 4.9710) tan chi - 0.2155 T + 2.4192 with
// chi = (4/9 - T/120)(pi - 2 thetaS); x and y are polynomials in T and thetaS.
XyY zenith(double T, double thetaS) {
  constexpr Polynomial kX = {{{0.00166, -0.00375, 0.00209, 0},
                              {-0.02903, 0.06377, -0.03202, 0.00394},
                              {0.11693, -0.21196, 0.06052, 0.25886}}};
  constexpr Polynomial kY = {{{0.00275, -0.00610, 0.00317, 0},
                              {-0.04214, 0.08970, -0.04153, 0.00516},
                              {0.15346, -0.26756, 0.06670, 0.26688}}};
  const double chi = (4.0 / 9 - T / 120) * (pi - 2 * thetaS);
  return {evaluate(kX, T, thetaS), evaluate(kY, T, thetaS),
          linear(4.0453, T, -4.9710) * std::tan(chi) + linear(-0.2155, T, 2.4192)};
}

XyY clearSky(double T, const dvec3& sun, const dvec3& view) {
  const double gamma = angleBetween(sun, view), thetaS = angleBetween(sun, {0, 0, 1});
  const auto ratio = [&](const Perez& p) { return perez(p, view.z, gamma) / perez(p, 1, thetaS); };
  const PerezXyY p = perezParameters(T);
  const XyY z = zenith(T, thetaS);
  return {z.x * ratio(p.x), z.y * ratio(p.y), z.Y * ratio(p.Y)};
}

// XYZ = Y (x / y, 1, (1 - x - y) / y); then IEC 61966-2-1, the inverse of Rec. 709's primaries.
dvec3 rgbFromXyY(const XyY& c) {
  const dvec3 X(c.x * c.Y / c.y, c.Y, (1 - c.x - c.y) * c.Y / c.y);
  return {glm::dot(dvec3(3.2406, -1.5372, -0.4986), X), glm::dot(dvec3(-0.9689, 1.8758, 0.0415), X),
          glm::dot(dvec3(0.0557, -0.2040, 1.0570), X)};
}

dvec3 sunDirection() {
  const double c = std::cos(kSunElevation);
  return {c * std::sin(kSunAzimuth), c * std::cos(kSunAzimuth), std::sin(kSunElevation)};
}

dvec3 SkyCamera::ray(const dvec2& at) const {
  return glm::normalize(dvec3(at.x - centre.x, focal, centre.y - at.y));
}

dvec2 SkyCamera::project(const dvec3& d) const { return centre + dvec2(d.x, -d.z) * (focal / d.y); }

SkyCamera skyCamera(int width, int height) {
  return {width / (2 * std::tan(kFieldOfView / 2)), {width / 2.0, height * kHorizonRow}};
}

double sunRadiusIn(const SkyCamera& camera) { return std::max(kSunRadius, 2 / camera.focal); }

Image skyFrame(int width, int height) {
  Image image = makeImage(width, height, {"B", "G", "R"});
  const SkyCamera camera = skyCamera(width, height);
  const Ground ground;
  const dvec3 light = groundLight();
  const double scale = 1 / luminance(light);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const dvec3 ray = camera.ray({x + 0.5, y + 0.5});
      const dvec3 seen =
          ray.z > 0 ? skyRadiance(camera, ray) : light * reflectance(ground, camera, {x, y});
      set(image, x, y, seen * scale);
    }
  addSpecks(image);
  return image;
}

}  // namespace gnomon
