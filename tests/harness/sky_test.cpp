// The made frame with a sky, and the stored copy of it.
//
// Covered: the stored file against the code; values and their range; where the camera shows sun,
// horizon and white balance; the sky's formulas against the numbers that the paper's appendix A.2
// gives by hand, and against facts that any clear sky obeys. Not covered: that the sky looks like a
// measured one, and the ground's composition.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "harness/image/exr.h"
#include "harness/scene/sky.h"

namespace gnomon {
namespace {

using std::numbers::pi;

constexpr float kLargestHalf = 65504;  // (2 - 2^-10) 2^15
constexpr std::size_t kB = 0, kG = 1, kR = 2;

/// Made once: every test reads it.
const Image& frame() {
  static const Image image = skyFrame(kSkyWidth, kSkyHeight);
  return image;
}

const ExrPart& stored() {
  static const ExrPart part =
      readExr(std::filesystem::path(GNOMON_SOURCE_DIR) / "data/frames/sky.exr");
  return part;
}

/// From the bits, without a half type: of a float's 23 fraction bits a half keeps 10; below 2^-14
/// halves are the multiples of 2^-24.
bool isHalf(float x) {
  if (std::abs(x) > kLargestHalf) return false;
  if (std::abs(x) < 0x1p-14f) return x * 0x1p24f == std::floor(x * 0x1p24f);
  return (std::bit_cast<std::uint32_t>(x) & 0x1fffu) == 0;
}

glm::dvec3 direction(double theta, double azimuth) {
  return {std::sin(theta) * std::sin(azimuth), std::sin(theta) * std::cos(azimuth),
          std::cos(theta)};
}

double luminanceOf(const Image& image, int x, int y) {  // ITU-R BT.709-6, table 3
  return 0.2126 * image.at(x, y, kR) + 0.7152 * image.at(x, y, kG) + 0.0722 * image.at(x, y, kB);
}

/// Largest value whose channels are all at least that: specks of one colour do not count.
double whiteness(const Image& image, int x, int y) {
  return std::min({image.at(x, y, kR), image.at(x, y, kG), image.at(x, y, kB)});
}

void expectNear(const Perez& got, const Perez& want) {
  constexpr double kRounding = 1e-12;  // far above double's, far below the table's last digit, 1e-4
  EXPECT_NEAR(got.A, want.A, kRounding);
  EXPECT_NEAR(got.B, want.B, kRounding);
  EXPECT_NEAR(got.C, want.C, kRounding);
  EXPECT_NEAR(got.D, want.D, kRounding);
  EXPECT_NEAR(got.E, want.E, kRounding);
}

// --- The frame -----------------------------------------------------------------------------------

TEST(Sky, TheStoredFileIsTheFrameToTheBit) {
  const Image& file = stored().image;
  ASSERT_EQ(shapeOf(file), shapeOf(frame()));
  std::size_t differing = 0;
  for (std::size_t i = 0; i < file.data.size(); ++i)
    differing +=
        std::bit_cast<std::uint32_t>(file.data[i]) != std::bit_cast<std::uint32_t>(frame().data[i]);
  EXPECT_EQ(differing, 0u) << "run make_data data if the frame was meant to change";
}

TEST(Sky, TheStoredFileSaysWhatMadeIt) { EXPECT_TRUE(stored().attributes.contains("made by")); }

TEST(Sky, EveryValueIsAHalfAndNotNegative) {
  std::size_t bad = 0;
  for (const float v : frame().data) bad += !(std::isfinite(v) && !std::signbit(v) && isHalf(v));
  EXPECT_EQ(bad, 0u);
}

TEST(Sky, ValuesReachFromZeroToTheLargestHalf) {
  for (const std::size_t c : {kB, kG, kR}) {
    const auto plane = frame().plane(c);
    EXPECT_EQ(std::ranges::min(plane), 0);
    EXPECT_EQ(std::ranges::max(plane), kLargestHalf);
    EXPECT_TRUE(std::ranges::any_of(plane, [](float v) { return v > 0 && v < 1e-3f; }));
    for (const float lo : {1e-2f, 1e-1f, 1.0f, 10.0f, 100.0f, 1e3f, 1e4f})  // every decade
      EXPECT_TRUE(std::ranges::any_of(plane, [lo](float v) { return v > lo && v < 10 * lo; }))
          << lo;
  }
}

TEST(Sky, EveryPrimaryHasAPureSpeckOfTheLargestHalf) {
  for (const std::size_t c : {kB, kG, kR}) {
    std::size_t found = 0;
    for (int y = 0; y < kSkyHeight; ++y)
      for (int x = 0; x < kSkyWidth; ++x)
        found += frame().at(x, y, c) == kLargestHalf && frame().at(x, y, (c + 1) % 3) == 0 &&
                 frame().at(x, y, (c + 2) % 3) == 0;
    EXPECT_GE(found, 1u) << frame().channels[c];
  }
}

TEST(Sky, OtherSizesAreTheSameScene) {
  const Image small = skyFrame(96, 54);  // 1/20: its sun is held at a radius of two pixels
  const auto at = skyCamera(96, 54).project(sunDirection());
  EXPECT_GT(whiteness(small, static_cast<int>(at.x), static_cast<int>(at.y)), 0.99 * kLargestHalf);
  EXPECT_EQ(skyFrame(1, 1).pixels(), 1u);
}

// Where the sun stands by trigonometry alone: straight ahead is column w/2, row 0.75 h; the focal
// length is w / (2 tan 37.5 deg). A direction of elevation e and azimuth a is seen at
// w/2 + f tan a, 0.75 h - f tan e / cos a.
glm::dvec2 whereTheSunIs() {
  const double degree = pi / 180, f = 1920 / (2 * std::tan(37.5 * degree));
  return {960 + f * std::tan(-24 * degree),
          810 - f * std::tan(23 * degree) / std::cos(24 * degree)};
}

TEST(Sky, TheSunsDiskIsTheLargestHalfWhereTheCameraSays) {
  // f tan(0.2666 deg) = 5.8 pixels, more off the axis; within 4 the disk covers pixels whole.
  const glm::dvec2 sun = whereTheSunIs();
  const int i = static_cast<int>(sun.x), j = static_cast<int>(sun.y);
  for (int y = j - 6; y <= j + 6; ++y)
    for (int x = i - 6; x <= i + 6; ++x)
      if (glm::length(glm::dvec2(x, y) + 0.5 - sun) < 4) {
        EXPECT_EQ(whiteness(frame(), x, y), kLargestHalf) << x << " " << y;
      }
}

TEST(Sky, TheBrightestRegionHoldsTheSun) {
  constexpr int kBlock = 24;  // wider than the disk, so that its mean outdoes any speck's
  double brightest = 0;
  glm::ivec2 best{};
  for (int by = 0; by < kSkyHeight / kBlock; ++by)
    for (int bx = 0; bx < kSkyWidth / kBlock; ++bx) {
      double sum = 0;
      for (int y = by * kBlock; y < (by + 1) * kBlock; ++y)
        for (int x = bx * kBlock; x < (bx + 1) * kBlock; ++x) sum += luminanceOf(frame(), x, y);
      if (sum > brightest) brightest = sum, best = {bx, by};
    }
  const glm::dvec2 middle = (glm::dvec2(best) + 0.5) * double{kBlock};
  EXPECT_LT(glm::length(middle - whereTheSunIs()), kBlock);
}

TEST(Sky, TheDisksAreaIsThatOfTheRealSun) {
  // A small cap of angular radius r at angle b off the axis has the area pi (f r)^2 / cos^3 b on a
  // plane film: 1 / cos^2 for the distance, 1 / cos for the slant. cos b = y of the direction.
  const double degree = pi / 180, f = 1920 / (2 * std::tan(37.5 * degree));
  const double cosine = std::cos(23 * degree) * std::cos(24 * degree);
  const double expected = pi * std::pow(f * std::tan(0.2666 * degree), 2) / std::pow(cosine, 3);
  const glm::dvec2 sun = whereTheSunIs();
  int area = 0;
  for (int y = static_cast<int>(sun.y) - 12; y <= sun.y + 12; ++y)
    for (int x = static_cast<int>(sun.x) - 12; x <= sun.x + 12; ++x)
      area += whiteness(frame(), x, y) > kLargestHalf / 2;  // half covered, as a disk's pixels are
  // The edge crosses some 8 r = 50 pixels, each counted or not by its middle: as many too many as
  // too few, root(50) / 2 = 4 pixels of 150 left over; 10 % is four times that.
  EXPECT_NEAR(area, expected, 0.1 * expected);
}

TEST(Sky, TheCameraSeesWhatItProjects) {
  const SkyCamera camera = skyCamera(kSkyWidth, kSkyHeight);
  for (const glm::dvec2 at : {glm::dvec2(0, 0), {1920, 0}, {960, 810}, {3.5, 1079.5}})
    EXPECT_LT(glm::length(camera.project(camera.ray(at)) - at), 1e-9);  // pixels
  EXPECT_NEAR(glm::length(camera.project(sunDirection()) - whereTheSunIs()), 0, 1e-9);
}

TEST(Sky, MidGreyGroundIsAboutEighteenPercent) {
  // Squares of reflectance 0.18 under light of luminance 1: most common value of the ground.
  std::size_t greys = 0, pixels = 0;
  for (int y = 900; y < kSkyHeight; ++y)
    for (int x = 0; x < kSkyWidth; ++x, ++pixels)
      greys += std::abs(luminanceOf(frame(), x, y) - 0.18) < 1e-3;  // half rounds by 2^-11 of it
  EXPECT_GT(greys, pixels / 20);  // two greys of seven in half of the squares: 1/7 is expected
}

// --- The model -----------------------------------------------------------------------------------

// Appendix A.2 at T = 2, by hand: slope x 2 + constant.
TEST(Sky, PerezParametersAreThoseOfTheAppendixAtTurbidityTwo) {
  const PerezXyY p = perezParameters(2);
  expectNear(p.Y, {-1.1056, -0.2833, 5.2797, -2.3359, 0.2363});
  expectNear(p.x, {-0.2978, -0.1322, 0.2117, -1.0271, 0.0386});
  expectNear(p.y, {-0.2942, -0.1808, 0.1944, -1.7419, 0.0311});
}

// At T = 10 every parameter is 8 slopes further.
TEST(Sky, PerezParametersAreThoseOfTheAppendixAtTurbidityTen) {
  const PerezXyY p = perezParameters(10);
  expectNear(p.Y, {0.3240, -3.1265, 5.0981, -1.3711, -0.2997});
  expectNear(p.x, {-0.4522, -0.6642, 0.2085, -1.5399, 0.0122});
  expectNear(p.y, {-0.4278, -0.9408, 0.1312, -2.0947, -0.0561});
}

// A sun on the horizon: pi - 2 thetaS = 0, so chi = 0 and Y = 2.4192 - 0.2155 T.
TEST(Sky, ZenithLuminanceUnderASettingSunIsTheLinearRest) {
  EXPECT_NEAR(zenith(2, pi / 2).Y, 1.9882, 1e-12);
  EXPECT_NEAR(zenith(6, pi / 2).Y, 1.1262, 1e-12);
}

// T = 40/3 makes 4/9 - T/120 = 1/3. With thetaS = pi/8, chi = (1/3)(3 pi/4) = pi/4 and tan chi = 1:
// Y = 4.0453 T - 4.9710 - 0.2155 T + 2.4192 = 3.8298 (40/3) - 2.5518 = 51.0640 - 2.5518 = 48.5122.
TEST(Sky, ZenithLuminanceIsTheAppendixsWhereTheTangentIsOne) {
  EXPECT_NEAR(zenith(40.0 / 3, pi / 8).Y, 48.5122, 1e-12);
}

// thetaS = 0 leaves the matrices' last columns: x = 0.00394 T + 0.25886, y = 0.00516 T + 0.26688.
TEST(Sky, ZenithChromaticityUnderAnOverheadSunIsTheLastColumn) {
  EXPECT_NEAR(zenith(2, 0).x, 0.26674, 1e-12);
  EXPECT_NEAR(zenith(2, 0).y, 0.27720, 1e-12);
}

// thetaS = 1 adds up the rows: x has 0 (T^2), 0.00666 (T), 0.22435; y has -0.00018, 0.01119,
// 0.21948. thetaS = -1 is no sun, but adds them with alternating signs, so that no two columns can
// be exchanged: x has -0.00750, 0.12876, -0.13055; y has -0.01202, 0.17853, -0.22084.
TEST(Sky, ZenithChromaticityAtOneRadianIsTheSumOfTheRows) {
  EXPECT_NEAR(zenith(2, 1).x, 0.23767, 1e-12);   // 0.22435 + 2 x 0.00666
  EXPECT_NEAR(zenith(2, 1).y, 0.24114, 1e-12);   // 0.21948 + 2 x 0.01119 - 4 x 0.00018
  EXPECT_NEAR(zenith(2, -1).x, 0.09697, 1e-12);  // -0.13055 + 2 x 0.12876 - 4 x 0.00750
  EXPECT_NEAR(zenith(2, -1).y, 0.08814, 1e-12);  // -0.22084 + 2 x 0.17853 - 4 x 0.01202
}

// Eq. 3 with parameters that make the result a whole number; e^(n ln 2) = 2^n.
TEST(Sky, PerezFunctionIsEquationThree) {
  EXPECT_DOUBLE_EQ(perez({2, 0, 0, 0, 0}, 0.5, 1), 3);              // 1 + A
  EXPECT_DOUBLE_EQ(perez({1, std::log(2.0), 0, 0, 0}, 0.5, 1), 5);  // 1 + 2^(1 / 0.5)
  EXPECT_DOUBLE_EQ(perez({0, 0, 3, std::log(2.0), 0}, 1, 2), 13);   // 1 + 3 x 2^2
  EXPECT_DOUBLE_EQ(perez({0, 0, 0, 0, 4}, 1, pi / 3), 2);           // 1 + 4 cos^2 60 deg
  EXPECT_DOUBLE_EQ(perez({1, 0, 1, 0, 1}, 1, 0), 6);                // 2 x 3
}

TEST(Sky, StraightUpTheSkyIsItsZenith) {
  for (const double T : {2.0, 4.0, 8.0})
    for (const double thetaS : {0.2, 0.8, 1.4}) {
      const XyY up = clearSky(T, direction(thetaS, 0.7), {0, 0, 1}), z = zenith(T, thetaS);
      EXPECT_NEAR(up.x, z.x, 1e-12);  // the ratio of equal Perez functions, to rounding
      EXPECT_NEAR(up.y, z.y, 1e-12);
      EXPECT_NEAR(up.Y, z.Y, 1e-12 * z.Y);
    }
}

TEST(Sky, LeftAndRightOfTheSunAreAlike) {
  const glm::dvec3 sun = direction(1.1, 0.4);
  for (const double theta : {0.3, 0.9, 1.5})
    for (const double off : {0.1, 1.0, 2.5}) {
      const XyY left = clearSky(2, sun, direction(theta, 0.4 - off));
      const XyY right = clearSky(2, sun, direction(theta, 0.4 + off));
      EXPECT_NEAR(left.x, right.x, 1e-12);
      EXPECT_NEAR(left.y, right.y, 1e-12);
      EXPECT_NEAR(left.Y, right.Y, 1e-12 * left.Y);
    }
}

TEST(Sky, AClearSkysHorizonIsBrighterThanItsZenith) {
  const glm::dvec3 sun = direction(0.6, 0);
  for (double azimuth = 0; azimuth < 2 * pi; azimuth += 0.25)
    EXPECT_GT(clearSky(2, sun, direction(1.55, azimuth)).Y, clearSky(2, sun, {0, 0, 1}).Y);
}

TEST(Sky, TheSkyFadesAwayFromTheSunAtTheSameHeight) {
  double last = INFINITY;
  for (double azimuth = 0; azimuth < pi / 2; azimuth += 0.1) {
    const double Y = clearSky(2, direction(1.1, 0), direction(1.1, azimuth)).Y;
    EXPECT_LT(Y, last) << azimuth;
    last = Y;
  }
}

// Blue: on the far side of D65 (0.3127, 0.3290) from yellow, so both coordinates are below white's.
TEST(Sky, AClearSkyAwayFromTheSunIsBlue) {
  for (const double theta : {0.0, 0.4, 0.8}) {
    const XyY sky = clearSky(2, direction(0.8, 0), direction(theta, pi));
    EXPECT_LT(sky.x, 0.3127);
    EXPECT_LT(sky.y, 0.3290);
    const glm::dvec3 rgb = rgbFromXyY(sky);
    EXPECT_GT(rgb.z, rgb.y);
    EXPECT_GT(rgb.z, rgb.x);
  }
}

// Rec. 709's own definition: white is D65, and the primaries' chromaticities are those of one
// channel alone (ITU-R BT.709-6, tables 1 and 3). Matrix and luminances have four digits; most
// comes from blue's luminance, 5e-5 / 0.0722 = 7e-4.
TEST(Sky, ColoursAreInRec709) {
  static constexpr double kFourDigits = 1e-3;
  const auto expectColour = [](const XyY& c, const glm::dvec3& want) {
    const glm::dvec3 d = rgbFromXyY(c) - want;
    EXPECT_LT(std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}), kFourDigits);
  };
  expectColour({0.3127, 0.3290, 1}, {1, 1, 1});
  expectColour({0.64, 0.33, 0.2126}, {1, 0, 0});
  expectColour({0.30, 0.60, 0.7152}, {0, 1, 0});
  expectColour({0.15, 0.06, 0.0722}, {0, 0, 1});
}

}  // namespace
}  // namespace gnomon
