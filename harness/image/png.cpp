#include "harness/image/png.h"

#include <cassert>
#include <fstream>
#include <string>

#include <fmt/format.h>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

#include "harness/error.h"
#include "harness/image/image.h"

namespace gnomon {
namespace {

void append(void* text, void* bytes, int size) {
  static_cast<std::string*>(text)->append(static_cast<const char*>(bytes),
                                          static_cast<std::size_t>(size));
}

}  // namespace

void writePng(const std::filesystem::path& file, int width, int height, int channels,
              std::span<const std::uint8_t> bytes) {
  assert(channels == 3 || channels == 4);
  // Also keeps stb's sizes, which are ints, from overflowing.
  checkSize(width, height, static_cast<std::size_t>(channels), file.string());
  assert(bytes.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                             static_cast<std::size_t>(channels));
  std::string png;
  const bool encoded = stbi_write_png_to_func(append, &png, width, height, channels, bytes.data(),
                                              width * channels) != 0;
  std::ofstream out(file, std::ios::binary);
  out << png;
  out.close();
  if (!encoded || !out)
    throw UsageError(
        fmt::format("{}: cannot be written; check the path and the space left", file.string()));
}

}  // namespace gnomon
