// FLIP: the error that a person sees who alternates between two images.
//
// LDR-FLIP: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020.
// HDR-FLIP: Andersson, Nilsson, Shirley, Akenine-Moller, "Visualizing Errors in Rendered High
// Dynamic Range Images", Eurographics Short Papers, 2021. Written from the papers, in double;
// comments name the papers' sections.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "harness/image/image.h"

namespace gnomon {

/// The papers' viewer: 0.7 m from a screen 0.7 m wide of 3840 pixels, 0.7 x 3840 / 0.7 x pi / 180.
inline constexpr double kPixelsPerDegree = 67.02064327658226;

/// One layer's red, green and blue: linear light, BT.709 primaries, D65 white.
struct RgbView {
  int width = 0, height = 0;
  std::array<std::span<const float>, 3> planes{};
};

/// The layers that have R, G and B: "" for the channels without a layer, "diffuse" for "diffuse.R".
std::vector<std::string> colourLayers(const Image& image);

/// Throws UsageError where the image lacks one of the three.
RgbView rgbOf(const Image& image, const std::string& layer = {});

/// Exposure compensations in stops, evenly spaced from start to stop.
struct Exposures {
  double start = 0, stop = 0;
  int count = 0;
};

struct Flip {
  bool hdr = false;
  Exposures exposures{};     ///< of HDR-FLIP
  std::vector<float> map{};  ///< each pixel's error in [0, 1]; infinite where a NaN or an infinity
                             ///< is in one image and not the same in the other
  double mean = 0;
  double max = 0;
  Pixel maxAt{};
};

/// Values are clamped to [0, 1] first.
Flip ldrFlip(const RgbView& reference, const RgbView& test,
             double pixelsPerDegree = kPixelsPerDegree);

/// The largest LDR-FLIP error over the exposures, each pixel by itself. Negative values count as 0.
Flip hdrFlip(const RgbView& reference, const RgbView& test, const Exposures& exposures,
             double pixelsPerDegree = kPixelsPerDegree);

/// HDR-FLIP where a finite value of either image exceeds 1, with the reference's exposures; else
/// LDR-FLIP.
Flip flip(const RgbView& reference, const RgbView& test, double pixelsPerDegree = kPixelsPerDegree);

/// Start and stop put the reference's largest and its median luminance at 85 % of the tone-mapped
/// range. Where at least half of the reference is black, the median is that of what is not black
/// (the paper's stop would be infinite: NVlabs/flip issue 42); a black reference counts as one of
/// luminance 1.
Exposures exposuresOf(const RgbView& reference);

}  // namespace gnomon
