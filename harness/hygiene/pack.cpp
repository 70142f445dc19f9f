#include "harness/hygiene/pack.h"

#include <cmath>
#include <cstring>
#include <limits>

namespace gnomon {
namespace {

constexpr unsigned kWord = 4;

/// Bytes of a field's k-th scalar in the module. A matrix of ours is column-major and tight.
unsigned offsetOf(const Place& place, unsigned scalar) {
  if (place.matrixStride == 0) return place.offset + kWord * scalar;
  const unsigned side = place.field.scalars == 9 ? 3 : 4;
  const unsigned column = scalar / side, row = scalar % side;
  return place.offset + (place.rowMajor ? row * place.matrixStride + kWord * column
                                        : column * place.matrixStride + kWord * row);
}

bool says(const Conventions& conventions, const char* name, const char* value) {
  const auto found = conventions.find(name);
  return found != conventions.end() && found->second == value;
}

void convert(std::byte* word, const Place& place, const Conventions& conventions, Way way) {
  if (place.field.meaning.empty() || conventions.empty()) return;
  float x = 0;
  std::memcpy(&x, word, kWord);
  x = converted(x, place.field.meaning, conventions, way);
  std::memcpy(word, &x, kWord);
}

}  // namespace

float converted(float x, const std::string& meaning, const Conventions& conventions, Way way) {
  if (!std::isfinite(x)) return x;
  if (meaning == "depth" && says(conventions, "depth", "standard")) return 1 - x;
  if (meaning == "roughness" && says(conventions, "roughness", "alpha") && way == Way::kIn)
    // What is outside the range stays outside, and finite.
    return std::copysign(std::fmin(x * x, std::numeric_limits<float>::max()), x);
  return x;
}

void pack(const Place& place, std::span<const std::byte> element, std::span<std::byte> target,
          const Conventions& conventions) {
  for (unsigned s = 0; s < place.field.scalars; ++s) {
    std::byte* word = target.data() + offsetOf(place, s);
    std::memcpy(word, element.data() + place.field.offset + kWord * s, kWord);
    convert(word, place, conventions, Way::kIn);
  }
}

void unpack(const Place& place, std::span<const std::byte> source, std::span<std::byte> element,
            const Conventions& conventions) {
  for (unsigned s = 0; s < place.field.scalars; ++s) {
    std::byte* word = element.data() + place.field.offset + kWord * s;
    std::memcpy(word, source.data() + offsetOf(place, s), kWord);
    convert(word, place, conventions, Way::kOut);
  }
}

void convertRows(std::span<std::byte> rows, PixelFormat format, unsigned height,
                 const std::string& meaning, const Conventions& conventions, Way way) {
  const std::size_t rowBytes = rows.size() / height;
  if (says(conventions, "y", "up"))
    for (unsigned y = 0; y < height / 2; ++y)
      std::ranges::swap_ranges(rows.subspan(y * rowBytes, rowBytes),
                               rows.subspan((height - 1 - y) * rowBytes, rowBytes));
  const bool floats = bytesPerPixel(format) == kWord * channels(format);
  if (meaning == "depth" && floats && !conventions.empty())  // the first channel is the depth
    for (std::size_t at = 0; at < rows.size(); at += bytesPerPixel(format)) {
      float x = 0;
      std::memcpy(&x, rows.data() + at, kWord);
      x = converted(x, meaning, conventions, way);
      std::memcpy(rows.data() + at, &x, kWord);
    }
}

}  // namespace gnomon
