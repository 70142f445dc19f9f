// Pixels of one image: named channels of 32-bit floats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gnomon {

/// Most samples (width x height x channels) of one image: a gigabyte of floats, an 8K frame of
/// eight channels. What claims more is refused before anything is allocated.
inline constexpr std::uint64_t kMaxSamples = std::uint64_t{1} << 28;

/// A pixel's column and row; (0, 0) is the top left of the stored pixels.
struct Pixel {
  int x = 0, y = 0;
  bool operator==(const Pixel&) const = default;
};

/// Planar: the pixels of channel c stand together, rows from the top. Metrics and filters work on
/// one channel at a time, so they read memory in order, and a channel more moves no other.
struct Image {
  int width = 0, height = 0;
  std::vector<std::string> channels{};
  std::vector<float> data{};  ///< channels x height x width

  std::size_t pixels() const;

  /// The channel's index; none where the image has no such channel.
  std::optional<std::size_t> find(const std::string& channel) const;

  /// All pixels of a channel. Throws std::out_of_range.
  std::span<float> plane(std::size_t channel);
  std::span<const float> plane(std::size_t channel) const;

  /// One sample. Throws std::out_of_range.
  float& at(int x, int y, std::size_t channel);
  float at(int x, int y, std::size_t channel) const;
};

/// An image of zeros. Throws UsageError like checkSize.
Image makeImage(int width, int height, const std::vector<std::string>& channels);

/// Throws UsageError, with `what` first, unless each number is positive and their product is within
/// kMaxSamples.
void checkSize(std::int64_t width, std::int64_t height, std::size_t channels,
               const std::string& what);

/// "640 x 480, channels R G B".
std::string shapeOf(const Image& image);

}  // namespace gnomon
