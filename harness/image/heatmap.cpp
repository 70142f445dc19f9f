#include "harness/image/heatmap.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "harness/image/png.h"

namespace gnomon {
namespace {

using Colour = std::array<std::uint8_t, 3>;

/// Ten evenly spaced colours of "magma" (Smith and van der Walt, 2015, made for matplotlib,
/// dedicated to the public domain under CC0), as viridisLite's magma(10) prints them; sRGB. Between
/// them, lines.
constexpr std::array<Colour, 10> kMagma = {{{0x00, 0x00, 0x04},
                                            {0x18, 0x0f, 0x3e},
                                            {0x45, 0x10, 0x77},
                                            {0x72, 0x1f, 0x81},
                                            {0x9f, 0x2f, 0x7f},
                                            {0xcd, 0x40, 0x71},
                                            {0xf1, 0x60, 0x5d},
                                            {0xfd, 0x95, 0x67},
                                            {0xfe, 0xc9, 0x8d},
                                            {0xfc, 0xfd, 0xbf}}};
constexpr Colour kCyan = {0x00, 0xff, 0xff};

/// Pixels: the bar's height, and black above it.
constexpr int kBar = 12, kGap = 4;

}  // namespace

std::array<std::uint8_t, 3> heatColour(double error) {
  if (!std::isfinite(error)) return kCyan;
  const double at = std::clamp(error, 0.0, 1.0) * (kMagma.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kMagma.size() - 2);
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] = static_cast<std::uint8_t>(
        std::lround(std::lerp(static_cast<double>(kMagma[i][c]),
                              static_cast<double>(kMagma[i + 1][c]), at - static_cast<double>(i))));
  return colour;
}

void writeHeatmap(const std::filesystem::path& file, int width, int height,
                  std::span<const float> map, double top) {
  assert(top > 0 &&
         map.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<std::uint8_t> bytes;
  const auto paint = [&bytes](const Colour& c) { bytes.insert(bytes.end(), c.begin(), c.end()); };
  for (const float error : map) paint(heatColour(static_cast<double>(error) / top));
  for (int i = 0; i < kGap * width; ++i) paint({});
  for (int y = 0; y < kBar; ++y)
    for (int x = 0; x < width; ++x) paint(heatColour((x + 0.5) / width));
  writePng(file, width, height + kGap + kBar, 3, bytes);
}

}  // namespace gnomon
