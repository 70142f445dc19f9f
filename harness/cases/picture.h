// Pictures on the host, and how they become a kernel's input images.
#pragma once

#include <string>
#include <vector>

#include "harness/hygiene/stimulus.h"
#include "kernels/contract.h"

namespace gnomon {

/// Rows from the top, x fastest; components as a kernel sees them.
struct Picture {
  uvec2 size{1, 1};
  std::vector<vec4> texels{};

  const vec4& at(std::size_t pixel) const { return texels[pixel]; }
  std::size_t pixels() const { return texels.size(); }
};

/// An input image of 32-bit floats, so that a kernel sees the picture's own numbers. The picture
/// must outlive it.
InputImage floatImage(std::string image, const Picture& picture);

/// A picture as a frame keeps it, in a format of halves: what the kernel is given, and the picture
/// that it reads there.
class HalfImage {
 public:
  /// Keeps as many components as the format has channels; the others read as 0, alpha as 1.
  HalfImage(std::string image, const Picture& picture, PixelFormat format = PixelFormat::kRgba16f);

  /// Lives as long as this.
  InputImage input() const;
  const Picture& picture() const { return read; }

 private:
  std::string name;
  ImageDescription description;
  std::vector<std::uint16_t> codes;
  Picture read;
};

}  // namespace gnomon
