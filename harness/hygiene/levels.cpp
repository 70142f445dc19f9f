#include "harness/hygiene/levels.h"

#include <stdexcept>

#include <fmt/format.h>

#include "harness/vulkan/gpu.h"

namespace gnomon {
namespace {

std::array<unsigned, 2> sizeOf(const Levels& image, unsigned level) {
  return mipSize({.width = image.width, .height = image.height}, level);
}

}  // namespace

std::size_t pixelsOf(const Levels& image) {
  std::size_t pixels = 0;
  for (unsigned level = 0; level < image.count; ++level) {
    const auto [width, height] = sizeOf(image, level);
    pixels += std::size_t{width} * height;
  }
  return pixels;
}

LevelPixel pixelAt(const Levels& image, std::size_t element) {
  std::size_t left = element;
  for (unsigned level = 0; level < image.count; ++level) {
    const auto [width, height] = sizeOf(image, level);
    const std::size_t pixels = std::size_t{width} * height;
    if (left < pixels)
      return {level, static_cast<unsigned>(left % width), static_cast<unsigned>(left / width)};
    left -= pixels;
  }
  throw std::out_of_range(fmt::format("pixel {} of {} levels of {} x {}", element, image.count,
                                      image.width, image.height));
}

std::string placeOn(const std::string& name, const LevelPixel& pixel) {
  return fmt::format("{} level {} ({}, {})", name, pixel.level, pixel.x, pixel.y);
}

}  // namespace gnomon
