// precision/load_*, store_*: one texel read or written without a filter.
//
// Covered: every code of RGBA8 as texelFetch reads it (device model: the specification does not say
// how exact); stores to RGBA8 and RGBA16F at, next to and half-way between all codes, of negatives,
// of what is too large, of infinities, in a format's own image as in a float one.
// Not covered: NaN (a normalised format may keep any code of it), R11G11B10, SNORM, sRGB.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "kernels/precision/precision.h"
#include "reference/bound/sampling.h"

namespace gnomon::precision {
namespace {

constexpr std::uint32_t kCodes = 256;      // of 8 bits
constexpr std::uint32_t kHalves = 0x7c00;  // finite ones without a sign

/// Every code once in each of the four channels, beside other codes.
struct AllCodes {
  uvec2 size{16, 16};
  std::vector<std::byte> texels;

  AllCodes() {
    for (std::uint32_t i = 0; i < kCodes; ++i)
      for (const std::uint32_t turn : {1u, 3u, 5u, 7u})  // odd, so a permutation of the codes
        texels.push_back(static_cast<std::byte>(i * turn % kCodes));
  }
  std::uint32_t code(std::size_t pixel, std::size_t channel) const {
    return static_cast<std::uint32_t>(texels[4 * pixel + channel]);
  }
};

class PrecisionLoadRgba8 : public KernelCase {
 protected:
  PrecisionLoadRgba8() : KernelCase("precision/load_rgba8") {}
};

TEST_F(PrecisionLoadRgba8, EveryCodeIsInsideTheDeviceModel) {
  const AllCodes all;
  const Pixels push{.size = all.size};
  const Observation seen =
      run({.outputs = {{"results", kCodes}},
           .inputImages = {{"source", {.width = all.size.x, .height = all.size.y}, all.texels}},
           .push = std::as_bytes(std::span(&push, 1)),
           .extent = {all.size.x, all.size.y}});
  const auto model = [&]<class T>(std::size_t i) {
    Vec4<T> texel;
    for (std::size_t c = 0; c < 4; ++c)
      if constexpr (std::is_same_v<T, double>)
        texel[c] = decode(all.code(i, c), Storage::unorm8);
      else
        texel[c] = loaded(all.code(i, c), Storage::unorm8);
    return texel;
  };
  Expectation expected = expectationOf("results", kCodes, model, [&](std::size_t i) {
    return fmt::format("    codes {} {} {} {}\n", all.code(i, 0), all.code(i, 1), all.code(i, 2),
                       all.code(i, 3));
  });
  expected.corners = kCodes;
  expected.judgesRules = true;
  expectWithinSpecification(seen, expected);
}

class StoreCase : public KernelCase {
 protected:
  using KernelCase::KernelCase;

  void SetUp() override {
    KernelCase::SetUp();
    if (!IsSkipped()) skipWhereUnsupported([&] { dispatch(pixelsFrom({0})); });
  }

  /// Four values a pixel, in rows of 64 pixels, the last one filled up with zeros.
  static Picture pixelsFrom(std::vector<float> values) {
    constexpr unsigned kRow = 64;
    const auto rows = static_cast<uint>((values.size() + 4 * kRow - 1) / (4 * kRow));
    values.resize(std::size_t{rows} * 4 * kRow);
    Picture picture{.size = {kRow, rows}};
    for (std::size_t i = 0; i < values.size(); i += 4)
      picture.texels.emplace_back(values[i], values[i + 1], values[i + 2], values[i + 3]);
    return picture;
  }

  Observation dispatch(const Picture& picture) {
    const Pixels push{.size = picture.size};
    return run({.inputs = {{"texels", std::as_bytes(std::span(picture.texels))}},
                .outputImages = {{"target", picture.size.x, picture.size.y}},
                .push = std::as_bytes(std::span(&push, 1)),
                .extent = {picture.size.x, picture.size.y}});
  }

  void expectStored(const std::vector<float>& values) {
    const Picture picture = pixelsFrom(values);
    Expectation expected = pixelsOf(
        "target", picture.size, [&]<class T>(std::size_t i) { return input<T>(picture.at(i)); },
        [&](std::size_t i) {
          const vec4& p = picture.at(i);
          return fmt::format("    texel ({:.9g}, {:.9g}, {:.9g}, {:.9g})\n", p.x, p.y, p.z, p.w);
        });
    expected.corners = picture.pixels();
    expected.judgesRules = true;
    expectWithinSpecification(dispatch(picture), expected);
  }
};

void addWithNeighbours(std::vector<float>& values, double x) {
  const auto at = static_cast<float>(x);
  constexpr float kFar = std::numeric_limits<float>::infinity();
  for (const float value : {std::nextafter(at, -kFar), at, std::nextafter(at, kFar)})
    values.push_back(value);
}

/// Every code, the middle between it and the next, and a float to each side of both.
std::vector<float> aroundCodes(std::uint32_t codes, Storage storage) {
  std::vector<float> values;
  for (std::uint32_t code = 0; code < codes; ++code) {
    const double at = decode(code, storage);
    addWithNeighbours(values, at);
    if (code + 1 < codes) addWithNeighbours(values, (at + decode(code + 1, storage)) / 2);
  }
  return values;
}

constexpr float kHuge = std::numeric_limits<float>::max();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

class PrecisionStoreRgba8 : public StoreCase {
 protected:
  PrecisionStoreRgba8() : StoreCase("precision/store_rgba8") {}
};

TEST_F(PrecisionStoreRgba8, ValuesAroundEveryCodeBecomeOneOfTheirTwoCodes) {
  expectStored(aroundCodes(kCodes, Storage::unorm8));
}

TEST_F(PrecisionStoreRgba8, ValuesOutsideAreClamped) {
  expectStored({-0.0f, -0x1p-20f, -0.5f, -1, -kHuge, -kInfinite, 1.5f, 2, 255, 256, 65536, kHuge,
                kInfinite});
}

class PrecisionStoreRgba16f : public StoreCase {
 protected:
  PrecisionStoreRgba16f() : StoreCase("precision/store_rgba16f") {}
};

TEST_F(PrecisionStoreRgba16f, ValuesAroundEveryHalfBecomeOneOfItsNeighbours) {
  std::vector<float> values = aroundCodes(kHalves, Storage::half);
  expectStored(values);
  std::ranges::transform(values, values.begin(), std::negate<>());
  expectStored(values);
}

TEST_F(PrecisionStoreRgba16f, ValuesThatAreTooLargeBecomeTheLargestOrInfinite) {
  std::vector<float> values{kInfinite, kHuge, 65536, 1e6f, -65536, -1e6f, -kHuge, -kInfinite};
  // From 65520 on, half a step above the largest half, the nearest is infinite.
  addWithNeighbours(values, 65520);
  addWithNeighbours(values, -65520);
  expectStored(values);
}

TEST(PrecisionLoadRgba8Model, BothWaysToReadACodeAreInside) {
  const float reciprocal = 1.0f / 255;
  for (std::uint32_t code = 0; code < kCodes; ++code) {
    const auto c = static_cast<float>(code);
    const Bounded allowed = loaded(code, Storage::unorm8);
    EXPECT_TRUE(admits(allowed, c / 255)) << code;
    EXPECT_TRUE(admits(allowed, c * reciprocal)) << code;
  }
}

TEST(PrecisionLoadRgba8Model, HalvesAreReadExactly) {
  for (std::uint32_t code = 0; code < kHalves; ++code) {
    const Bounded half = loaded(code, Storage::half);
    EXPECT_TRUE(half.isPoint() && half.value == decode(code, Storage::half)) << code;
  }
}

}  // namespace
}  // namespace gnomon::precision
