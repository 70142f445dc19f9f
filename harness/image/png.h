// PNG files, out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace gnomon {

/// Writes 8-bit RGB (3 bytes a pixel) or RGBA (4), rows from the top. The bytes are written as they
/// are: encoding to sRGB is the caller's. Throws UsageError where the file cannot be written.
void writePng(const std::filesystem::path& file, int width, int height, int channels,
              std::span<const std::uint8_t> bytes);

}  // namespace gnomon
