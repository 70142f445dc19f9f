// The colour spaces of FLIP; see flip.h for the paper.
#pragma once

namespace gnomon {

/// A colour's three components, in the space that the function names.
struct Vec {
  double x = 0, y = 0, z = 0;
};

/// From linear BT.709 to YCxCz, the opponent space of "Spatial Filtering": L*a*b* without its
/// non-linearity. Y from -16 (black) to 100.
Vec ycxczFromRgb(const Vec& rgb);
Vec rgbFromYcxcz(const Vec& v);

/// From linear BT.709 to L*a*b* with Hunt's adjustment ("Perceptual Color Difference"): chroma
/// fades with lightness.
Vec huntLabFromRgb(const Vec& rgb);

/// The distance of two L*a*b* colours for large differences: Abasi, Tehran, Fairchild, "Distance
/// metrics for very large color differences", Color Research and Application 45(2), 2020.
double hyab(const Vec& a, const Vec& b);

}  // namespace gnomon
