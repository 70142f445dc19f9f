#include "harness/image/metrics.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace {

std::size_t channelOf(const Image& image, const std::string& name) {
  const auto found = image.find(name);
  if (!found)
    throw UsageError(fmt::format("no channel {} in an image of {}", name, shapeOf(image)));
  return *found;
}

/// Squared errors of each block, summed up over all channels.
class Blocks {
 public:
  Blocks(int w, int h) : width(w), height(h), columns(blocksIn(w)) {
    sums.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(blocksIn(h)));
  }

  double& sumAt(int x, int y) {
    return sums[static_cast<std::size_t>(y / kBlockSize * columns + x / kBlockSize)];
  }

  /// RMSE of the block with that top left, over so many channels.
  double rmse(Pixel at, std::size_t channels) {
    const int w = std::min(kBlockSize, width - at.x), h = std::min(kBlockSize, height - at.y);
    return std::sqrt(sumAt(at.x, at.y) /
                     (static_cast<double>(w * h) * static_cast<double>(channels)));
  }

  void findWorst(Difference& d, std::size_t channels) {
    for (int y = 0; y < height; y += kBlockSize)
      for (int x = 0; x < width; x += kBlockSize)
        if (const double r = rmse({x, y}, channels); r > d.worstBlock) {
          d.worstBlock = r;
          d.worstBlockAt = {x, y};
        }
  }

 private:
  static int blocksIn(int length) { return (length + kBlockSize - 1) / kBlockSize; }

  int width, height, columns;
  std::vector<double> sums;
};

struct Sample {
  const std::string& channel;
  Pixel at;
  float reference, test;
};

/// Takes one sample into everything but the blocks; returns its error.
double take(Difference& d, const Sample& s) {
  const double error = sampleError(s.reference, s.test);
  if (std::isinf(error))
    d.mismatched += 1;
  else if (!std::isfinite(s.reference))
    d.nonFinite += 1;
  if (std::isfinite(s.reference))
    d.peak = std::max(d.peak, std::abs(static_cast<double>(s.reference)));
  if (error > d.max) {
    d.max = error;
    d.maxChannel = s.channel;
    d.maxAt = s.at;
    d.reference = static_cast<double>(s.reference);
    d.test = static_cast<double>(s.test);
  }
  return error;
}

/// Takes one channel; returns its sum of squared errors. In double: the square of the largest
/// float's error is 1e77.
double takeChannel(Difference& d, Blocks& blocks, const Image& reference, const Image& test,
                   const std::string& name) {
  const auto a = reference.plane(channelOf(reference, name));
  const auto b = test.plane(channelOf(test, name));
  double sum = 0;
  std::size_t i = 0;
  for (int y = 0; y < reference.height; ++y) {
    for (int x = 0; x < reference.width; ++x, ++i) {
      const double error = take(d, {name, {x, y}, a[i], b[i]});
      blocks.sumAt(x, y) += error * error;
      sum += error * error;
    }
  }
  return sum;
}

}  // namespace

double sampleError(float reference, float test) {
  if (std::isnan(reference) && std::isnan(test)) return 0;
  if (reference == test) return 0;  // equal infinities too, whose difference is NaN
  const double error = std::abs(static_cast<double>(test) - static_cast<double>(reference));
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
}

Difference difference(const Image& reference, const Image& test,
                      const std::vector<std::string>& channels) {
  requireSameShape(reference, test);
  Difference d{.channels = channels.size() == 1 ? channels.front() : "all"};
  Blocks blocks(reference.width, reference.height);
  double sum = 0;
  for (const std::string& name : channels) sum += takeChannel(d, blocks, reference, test, name);
  d.rmse = std::sqrt(sum / static_cast<double>(reference.pixels() * channels.size()));
  blocks.findWorst(d, channels.size());
  d.psnr = 20 * std::log10(d.peak / d.rmse);
  return d;
}

void requireSameShape(const Image& reference, const Image& test) {
  const auto sorted = [](std::vector<std::string> names) {
    std::ranges::sort(names);
    return names;
  };
  if (reference.width != test.width || reference.height != test.height ||
      sorted(reference.channels) != sorted(test.channels))
    throw UsageError(fmt::format("the images differ in size or channels: {} and {}",
                                 shapeOf(reference), shapeOf(test)));
}

}  // namespace gnomon
