#include "tests/tonemap/frames.h"

#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "harness/image/exr.h"

namespace gnomon::tonemap {
namespace {

// Not 1, so that a kernel which passes it on is seen.
constexpr float kAlpha = 0.25f;

vec4 colour(Random& random, double lo, double hi) {
  const auto component = [&] { return static_cast<float>(random.logUniform(lo, hi)); };
  const float grey = component();
  switch (random.below(3)) {
    case 0:
      return {grey, grey, grey, kAlpha};
    case 1: {
      vec4 pure(0, 0, 0, kAlpha);
      pure[static_cast<int>(random.below(3))] = grey;
      return pure;
    }
    default:
      return {grey, component(), component(), kAlpha};
  }
}

Picture colours(Random& random, double lo, double hi, const uvec2& size) {
  Picture picture{.size = size};
  for (std::size_t i = 0; i < std::size_t{size.x} * size.y; ++i)
    picture.texels.push_back(colour(random, lo, hi));
  return picture;
}

float exposureAt(double ev) { return static_cast<float>(std::exp2(ev)); }

uvec2 half(const uvec2& size) { return glm::max(size / 2u, uvec2(1)); }

}  // namespace

Frame between(double lo, double hi, const uvec2& size, const uvec2& bloomSize, std::uint64_t seed) {
  Random random(seed);
  return {.push = {.size = size,
                   .exposure = exposureAt(random.uniform(-2, 2)),
                   .bloomIntensity = 0.3f,
                   .curve = kLinear,
                   .transfer = kNone},
          .hdr = colours(random, lo, hi, size),
          .bloom = colours(random, lo / 10, hi / 10, bloomSize)};
}

Frame bulk(const uvec2& size, std::uint64_t seed) {
  return between(0.01, 16, size, half(size), seed);
}

Frame shadows(const uvec2& size, std::uint64_t seed) {
  Frame frame = between(1e-5, 0.02, size, half(size), seed);
  frame.push.exposure = 1;
  return frame;
}

Frame highlights(const uvec2& size, std::uint64_t seed) {
  Frame frame = between(16, 65504, size, half(size), seed);
  frame.push.exposure = exposureAt(Random(seed).uniform(0, 16));
  return frame;
}

Frame degenerate() {
  const std::vector<float> special = specialFloats({0.0031308f, 65504.0f, kMaxScene});
  const auto n = static_cast<uint>(special.size());
  const uvec2 size(3 * n, 3 * n);
  Frame frame{.push = {.size = size,
                       .exposure = 0.75f,
                       .bloomIntensity = 0.3f,
                       .curve = kLinear,
                       .transfer = kNone},
              .hdr = {.size = size},
              .bloom = {.size = size}};
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x) {
      vec4 hdr(0.2f, 0.5f, 0.9f, 1), bloom(0.1f, 0.1f, 0.1f, 1);
      hdr[static_cast<int>(x % 3)] = special[x / 3];
      bloom[static_cast<int>(y % 3)] = special[y / 3];
      frame.hdr.texels.push_back(hdr);
      frame.bloom.texels.push_back(bloom);
    }
  return frame;
}

Frame thresholds() {
  constexpr float kSmallest = std::numeric_limits<float>::min(), kSrgbEnd = 0.0031308f;
  std::vector<float> values;
  for (const float x : {kSmallest, kSrgbEnd, 1.0f})
    for (const float scale : {0.99991f, 1.0f, 1.00009f})
      for (const float towards : {0.0f, 2.0f, scale * x}) {
        const float value = std::nextafter(scale * x, towards);
        if (value >= kSmallest) values.push_back(value);  // a denormal may be flushed: ambiguous
      }
  const uvec2 size(values.size(), 1);
  Frame frame{.push = {.size = size,
                       .exposure = 1,
                       .bloomIntensity = 0,
                       .curve = kLinear,
                       .transfer = kNone},
              .hdr = {.size = size},
              .bloom = {.size = {1, 1}, .texels = {vec4(0)}}};
  for (const float x : values) frame.hdr.texels.emplace_back(x, x, x, 1);
  return frame;
}

Picture load(const std::filesystem::path& file) {
  const Image image = readExr(file).image;
  Picture picture{.size = uvec2(image.width, image.height)};
  picture.texels.assign(image.pixels(), vec4(1));
  const std::array names = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    const auto plane = image.plane(image.find(names[static_cast<std::size_t>(c)]).value());
    for (std::size_t i = 0; i < plane.size(); ++i) picture.texels[i][c] = plane[i];
  }
  return picture;
}

Picture halved(const Picture& picture, float scale) {
  Picture small{.size = half(picture.size)};
  const auto at = [&](uint x, uint y) { return picture.texels[y * picture.size.x + x]; };
  for (uint y = 0; y < small.size.y; ++y)
    for (uint x = 0; x < small.size.x; ++x)
      small.texels.push_back(scale / 4 *
                             (at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) +
                              at(2 * x + 1, 2 * y + 1)));
  return small;
}

void parts(Parts& p, Frame& frame) {
  p.push(frame.push);
  p.imageOfExtent("hdr", frame.hdr);
  p.image("bloom", frame.bloom);
  p.extent(frame.push.size);
}

bool admits(const Frame& frame) {
  return frame.push.exposure >= 0x1p-32f && frame.push.exposure <= 0x1p32f &&
         frame.push.bloomIntensity >= 0 && frame.push.bloomIntensity <= 1;
}

std::string describe(const Frame& frame, std::size_t pixel) {
  const vec4& hdr = frame.hdr.at(pixel);
  const uint x = static_cast<uint>(pixel) % frame.push.size.x;
  const uint y = static_cast<uint>(pixel) / frame.push.size.x;
  const uvec2 nearest = uvec2(x, y) * frame.bloom.size / frame.push.size;
  const vec4& bloom = frame.bloom.at(nearest.y * frame.bloom.size.x + nearest.x);
  return fmt::format(
      "    hdr        ({:.9g}, {:.9g}, {:.9g})\n"
      "    bloom      ({:.9g}, {:.9g}, {:.9g}) in the texel ({}, {}) of {} x {}, times {:.9g}\n"
      "    exposure   {:.9g}\n    curve      {}, transfer {}\n",
      hdr.x, hdr.y, hdr.z, bloom.x, bloom.y, bloom.z, nearest.x, nearest.y, frame.bloom.size.x,
      frame.bloom.size.y, frame.push.bloomIntensity, frame.push.exposure, frame.push.curve,
      frame.push.transfer);
}

}  // namespace gnomon::tonemap
