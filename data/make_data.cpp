// Makes the data that the repository keeps: make_data DIR.
#include <exception>
#include <filesystem>

#include <fmt/format.h>

#include "harness/image/exr.h"
#include "harness/scene/sky.h"

namespace {

void makeSky(const std::filesystem::path& file) {
  using namespace gnomon;
  const Image image = skyFrame(kSkyWidth, kSkyHeight);
  writeExr(file, image, {.attributes = {{"made by", "data/make_data.cpp, skyFrame"}}});
  fmt::print("{}: {}, half, ZIP, {} bytes\n", file.string(), shapeOf(image),
             std::filesystem::file_size(file));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    fmt::print(stderr, "usage: make_data DIR    writes DIR/frames/sky.exr\n");
    return 2;
  }
  const std::filesystem::path frames = std::filesystem::path(argv[1]) / "frames";
  std::filesystem::create_directories(frames);
  makeSky(frames / "sky.exr");
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "make_data: {}\n", e.what());
  return 2;
}
