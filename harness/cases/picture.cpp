#include "harness/cases/picture.h"

#include "reference/bound/storage.h"

namespace gnomon {

InputImage floatImage(std::string image, const Picture& picture) {
  return {.image = std::move(image),
          .description = {.format = PixelFormat::kRgba32f,
                          .width = picture.size.x,
                          .height = picture.size.y},
          .texels = std::as_bytes(std::span(picture.texels))};
}

HalfImage::HalfImage(std::string image, const Picture& picture, PixelFormat format)
    : name(std::move(image)),
      description{.format = format, .width = picture.size.x, .height = picture.size.y},
      read{.size = picture.size, .texels = {}} {
  const int n = static_cast<int>(channels(format));
  for (const vec4& texel : picture.texels) {
    vec4 kept(0, 0, 0, 1);
    for (int c = 0; c < n; ++c) {
      codes.push_back(static_cast<std::uint16_t>(encode(double{texel[c]}, Storage::half)));
      kept[c] = static_cast<float>(decode(codes.back(), Storage::half));
    }
    read.texels.push_back(kept);
  }
}

InputImage HalfImage::input() const {
  return {.image = name, .description = description, .texels = std::as_bytes(std::span(codes))};
}

}  // namespace gnomon
