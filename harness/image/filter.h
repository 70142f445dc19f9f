// Planes of doubles and separable filters over them. Rows are spread over the cores; each is
// computed by itself, so results do not depend on how many there are.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include <tbb/parallel_for.h>

namespace gnomon {

/// Filters work on blocks of so many pixels.
inline constexpr std::size_t kFilterBlock = 8;

/// One value a pixel. Rows are padded to whole blocks; what is in the padding does not matter.
struct Plane {
  Plane(int w, int h);

  double* row(std::size_t y) { return &values[y * stride]; }
  const double* row(std::size_t y) const { return &values[y * stride]; }

  std::size_t width, height, stride;
  std::vector<double> values;  ///< zeros at first
};
using Planes = std::array<Plane, 3>;

/// Calls work(x, y) for each pixel.
template <class Work>
void forEachPixel(std::size_t width, std::size_t height, const Work& work) {
  tbb::parallel_for(std::size_t{0}, height, [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) work(x, y);
  });
}

/// Taps from -radius to radius, of odd number.
using Kernel = std::vector<double>;

/// A kernel of that radius; `value` takes the tap's distance in pixels.
Kernel sampled(int radius, const std::function<double(double)>& value);

/// Each row filtered; taps beyond a row's end see its end again.
void filterRows(const Plane& in, const Kernel& kernel, Plane& out);

/// Adds to `out` each column filtered; taps beyond a column's end see its end again.
void addFilteredColumns(const Plane& in, const Kernel& kernel, Plane& out);

}  // namespace gnomon
