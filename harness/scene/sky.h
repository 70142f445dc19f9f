// A made frame of high dynamic range: a clear sky with its sun over a chequered ground.
//
// The sky is that of Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight"
// (SIGGRAPH 99); names and letters are the paper's. Directions are unit vectors, x right, y ahead,
// z up; angles are in radians, luminances in kcd/m^2.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "harness/image/image.h"

namespace gnomon {

/// CIE 1931 chromaticity, and luminance in kcd/m^2.
struct XyY {
  double x = 0, y = 0, Y = 0;
};

/// The paper's five parameters: gradient at the horizon (A, B), around the sun (C, D), light
/// scattered back (E).
struct Perez {
  double A = 0, B = 0, C = 0, D = 0, E = 0;
};

/// The parameters of chromaticity and of luminance.
struct PerezXyY {
  Perez x{}, y{}, Y{};
};

/// Relative luminance of a sky's direction, eq. 3. cosTheta in (0, 1] is of the angle from the
/// zenith, gamma in [0, pi] the angle from the sun.
double perez(const Perez& p, double cosTheta, double gamma);

/// Appendix A.2: linear in turbidity T.
PerezXyY perezParameters(double T);

/// Appendix A.2: the sky at the zenith, thetaS in [0, pi/2] the sun's angle from it.
XyY zenith(double T, double thetaS);

/// The sky in direction `view` above the horizon, eq. 4: the zenith's x, y and Y, each times the
/// ratio of Perez functions.
XyY clearSky(double T, const glm::dvec3& sun, const glm::dvec3& view);

/// Linear Rec. 709; components of colours outside its gamut are negative.
glm::dvec3 rgbFromXyY(const XyY& colour);

// The scene. What has no source is a choice of composition.
inline constexpr double kTurbidity = 2;                    ///< clear; 1 is pure air
inline constexpr double kDegree = 0.017453292519943295;    ///< pi / 180, in radians
inline constexpr double kSunElevation = 23 * kDegree;      ///< above the horizon
inline constexpr double kSunAzimuth = -24 * kDegree;       ///< from ahead to the right
inline constexpr double kSunRadius = 0.2666 * kDegree;     ///< the mean, 959.63" (Auwers)
inline constexpr double kFieldOfView = 75 * kDegree;       ///< of the width at the level of the eye
inline constexpr double kHorizonRow = 0.75;                ///< of the height, from the top
inline constexpr int kSkyWidth = 1920, kSkyHeight = 1080;  ///< of data/frames/sky.exr

/// Towards the centre of the sun's disk.
glm::dvec3 sunDirection();

/// A pinhole camera that looks level ahead. Its film is shifted up, not tilted, so that the horizon
/// is one straight row and stands below the middle. Pixel (i, j) has its centre at (i + 0.5,
/// j + 0.5).
struct SkyCamera {
  double focal = 1;     ///< pixels
  glm::dvec2 centre{};  ///< where straight ahead is seen: column, row

  glm::dvec3 ray(const glm::dvec2& at) const;
  /// Where a direction with y > 0 is seen.
  glm::dvec2 project(const glm::dvec3& direction) const;
};

SkyCamera skyCamera(int width, int height);

/// Angular radius of the sun's disk in the frame: the real one, or that of two pixels where the
/// real disk is smaller. At kSkyWidth it is the real one, 6 pixels.
double sunRadiusIn(const SkyCamera& camera);

/// Channels B, G, R: linear Rec. 709, finite, not negative, each rounded to half (to nearest, ties
/// to even). Scaled so that a white ground is of luminance 1, thus mid-grey 0.18; the sun's disk
/// exceeds what a half holds and ends at the largest, 65504. A few hundred specks are fireflies:
/// single pixels and 2 x 2, some pure red, green or blue. The same arguments give the same bits.
/// Throws UsageError like makeImage.
Image skyFrame(int width, int height);

}  // namespace gnomon
