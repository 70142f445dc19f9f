#include "harness/image/filter.h"

#include <algorithm>
#include <cstring>

namespace gnomon {
namespace {

/// Eight pixels in GCC's and clang's vector type. Four of two doubles, by name: at -O2 a wider
/// vector or an array of them goes through memory at every tap, and a plain loop stays scalar.
using Two = double __attribute__((vector_size(16)));
struct Block {
  Two a{}, b{}, c{}, d{};
};

Two loadTwo(const double* from) {
  Two two;
  std::memcpy(&two, from, sizeof two);
  return two;
}

Block load(const double* in) {
  return {loadTwo(in), loadTwo(in + 2), loadTwo(in + 4), loadTwo(in + 6)};
}

void store(const Block& block, double* out) {
  std::memcpy(out, &block.a, sizeof block.a);
  std::memcpy(out + 2, &block.b, sizeof block.b);
  std::memcpy(out + 4, &block.c, sizeof block.c);
  std::memcpy(out + 6, &block.d, sizeof block.d);
}

/// sum += tap * in[0, 8)
void addTap(double tap, const double* in, Block& sum) {
  sum.a += tap * loadTwo(in);
  sum.b += tap * loadTwo(in + 2);
  sum.c += tap * loadTwo(in + 4);
  sum.d += tap * loadTwo(in + 6);
}

std::size_t wholeBlocks(std::size_t width) {
  return (width + kFilterBlock - 1) / kFilterBlock * kFilterBlock;
}

/// The row with its ends repeated.
std::vector<double> padded(const double* in, std::size_t width, std::size_t radius) {
  std::vector<double> row(wholeBlocks(width) + 2 * radius, in[width - 1]);
  std::fill_n(row.begin(), radius, in[0]);
  std::copy_n(in, width, row.begin() + static_cast<std::ptrdiff_t>(radius));
  return row;
}

/// The rows that the taps of row y see.
std::vector<const double*> rowsAround(const Plane& in, std::size_t y, std::size_t taps) {
  const std::size_t radius = taps / 2;
  std::vector<const double*> rows;
  for (std::size_t k = 0; k < taps; ++k)
    rows.push_back(in.row(std::min(std::max(y + k, radius) - radius, in.height - 1)));
  return rows;
}

}  // namespace

Plane::Plane(int w, int h)
    : width(static_cast<std::size_t>(w)),
      height(static_cast<std::size_t>(h)),
      stride(wholeBlocks(width)),
      values(stride * height) {}

Kernel sampled(int radius, const std::function<double(double)>& value) {
  Kernel k;
  for (int i = -radius; i <= radius; ++i) k.push_back(value(i));
  return k;
}

void filterRows(const Plane& in, const Kernel& kernel, Plane& out) {
  tbb::parallel_for(std::size_t{0}, in.height, [&](std::size_t y) {
    const std::vector<double> row = padded(in.row(y), in.width, kernel.size() / 2);
    for (std::size_t x = 0; x < in.stride; x += kFilterBlock) {
      Block sum;
      for (std::size_t k = 0; k < kernel.size(); ++k) addTap(kernel[k], &row[x + k], sum);
      store(sum, out.row(y) + x);
    }
  });
}

void addFilteredColumns(const Plane& in, const Kernel& kernel, Plane& out) {
  tbb::parallel_for(std::size_t{0}, in.height, [&](std::size_t y) {
    const std::vector<const double*> rows = rowsAround(in, y, kernel.size());
    for (std::size_t x = 0; x < in.stride; x += kFilterBlock) {
      Block sum = load(out.row(y) + x);
      for (std::size_t k = 0; k < rows.size(); ++k) addTap(kernel[k], rows[k] + x, sum);
      store(sum, out.row(y) + x);
    }
  });
}

}  // namespace gnomon
