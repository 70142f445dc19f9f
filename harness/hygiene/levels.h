// Where an element of an image with mip levels lies: level after level, rows tight.
#pragma once

#include <cstddef>
#include <string>

namespace gnomon {

/// Of an image's largest level, and how many levels it has.
struct Levels {
  unsigned width = 0, height = 0, count = 1;
};

struct LevelPixel {
  unsigned level = 0, x = 0, y = 0;
};

/// Pixels of all levels.
std::size_t pixelsOf(const Levels& image);

/// Throws std::out_of_range behind the last level's last pixel.
LevelPixel pixelAt(const Levels& image, std::size_t element);

/// "pyramid level 2 (3, 4)".
std::string placeOn(const std::string& name, const LevelPixel& pixel);

}  // namespace gnomon
