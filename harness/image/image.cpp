#include "harness/image/image.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/error.h"

namespace gnomon {
namespace {

std::size_t indexOf(const Image& image, int x, int y, std::size_t channel) {
  if (x < 0 || x >= image.width || y < 0 || y >= image.height || channel >= image.channels.size())
    throw std::out_of_range(fmt::format("sample ({}, {}) of channel {} in an image of {}", x, y,
                                        channel, shapeOf(image)));
  const auto row = channel * static_cast<std::size_t>(image.height) + static_cast<std::size_t>(y);
  return row * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
}

}  // namespace

std::size_t Image::pixels() const {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

std::optional<std::size_t> Image::find(const std::string& channel) const {
  const auto found = std::ranges::find(channels, channel);
  if (found == channels.end()) return std::nullopt;
  return static_cast<std::size_t>(found - channels.begin());
}

std::span<float> Image::plane(std::size_t channel) {
  return {&data.at(indexOf(*this, 0, 0, channel)), pixels()};
}

std::span<const float> Image::plane(std::size_t channel) const {
  return {&data.at(indexOf(*this, 0, 0, channel)), pixels()};
}

float& Image::at(int x, int y, std::size_t channel) {
  return data.at(indexOf(*this, x, y, channel));
}

float Image::at(int x, int y, std::size_t channel) const {
  return data.at(indexOf(*this, x, y, channel));
}

Image makeImage(int width, int height, const std::vector<std::string>& channels) {
  checkSize(width, height, channels.size(), "image");
  Image image{.width = width, .height = height, .channels = channels};
  image.data.resize(channels.size() * image.pixels());
  return image;
}

void checkSize(std::int64_t width, std::int64_t height, std::size_t channels,
               const std::string& what) {
  if (width < 1 || height < 1 || channels < 1)
    throw UsageError(fmt::format("{}: {} x {} pixels of {} channels; it needs one of each at least",
                                 what, width, height, channels));
  // By division: the product of a hostile header's numbers overflows.
  const std::uint64_t rows = kMaxSamples / static_cast<std::uint64_t>(width);
  if (static_cast<std::uint64_t>(height) > rows ||
      channels > rows / static_cast<std::uint64_t>(height))
    throw UsageError(fmt::format(
        "{}: {} x {} pixels of {} channels are above the limit of {} samples; crop it or leave "
        "channels out",
        what, width, height, channels, kMaxSamples));
}

std::string shapeOf(const Image& image) {
  return fmt::format("{} x {}, channels {}", image.width, image.height,
                     fmt::join(image.channels, " "));
}

}  // namespace gnomon
