// How far two images are apart, sample by sample.
//
// A NaN or an infinity in one image and not the same in the other is an infinite error: it makes
// the maximum, the RMSE and the block's RMSE infinite, so no limit passes it. NaN and NaN, or equal
// infinities, at the same place are equal; they are counted.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "harness/image/image.h"

namespace gnomon {

/// Blocks are 16 x 16 pixels from the top left; those at the right and lower edge may be smaller.
inline constexpr int kBlockSize = 16;

struct Difference {
  std::string channels{};    ///< one channel's name, or "all"
  double max = 0;            ///< largest |test - reference|
  std::string maxChannel{};  ///< where: channel, pixel, and what both images hold
  Pixel maxAt{};
  double reference = 0, test = 0;
  double rmse = 0;
  double worstBlock = 0;  ///< largest RMSE of one block: a small wrong area cannot average away
  Pixel worstBlockAt{};   ///< its top left
  double peak = 1;        ///< the signal's peak: 1, or the reference's largest finite |value|
  double psnr = std::numeric_limits<double>::infinity();  ///< dB: 20 log10(peak / RMSE)
  std::size_t nonFinite = 0;                              ///< the same NaN or infinity in both
  std::size_t mismatched = 0;  ///< NaN or infinity in one and not the same in the other
};

/// The error of one pair of samples: |test - reference|, 0 or infinity as said above.
double sampleError(float reference, float test);

/// Over the channels of that name in both images. Throws UsageError where the sizes or the channels
/// differ, with both.
Difference difference(const Image& reference, const Image& test,
                      const std::vector<std::string>& channels);

/// Throws UsageError unless both have the same size and the same set of channels.
void requireSameShape(const Image& reference, const Image& test);

}  // namespace gnomon
