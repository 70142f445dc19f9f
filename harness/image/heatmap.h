// An error map as a picture.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

namespace gnomon {

/// The colour of an error in [0, 1], from black over violet and orange to pale yellow: lightness
/// rises all the way, so larger errors look larger, in grey too. Values beyond are the ends'
/// colours; NaN and infinities are cyan, which no finite error is.
std::array<std::uint8_t, 3> heatColour(double error);

/// Writes the map as PNG, with a bar of all colours from 0 to `top` below it. `top` is the error
/// that gets the last colour.
void writeHeatmap(const std::filesystem::path& file, int width, int height,
                  std::span<const float> map, double top = 1);

}  // namespace gnomon
