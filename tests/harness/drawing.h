// What tests of draws share: a device with validation, buffers and pixels both ways.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "harness/vulkan/draw.h"
#include "harness/vulkan/gpu.h"
#include "tests/harness/glsl.h"

namespace gnomon {

using Words = std::vector<std::uint32_t>;

inline constexpr std::chrono::seconds kDrawLimit{20};

/// Runs every test of a suite on one device with validation and fails it for every message.
class DrawingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }
  void TearDown() override { EXPECT_EQ(gpu->takeMessages(), std::vector<std::string>()); }

  inline static std::unique_ptr<Gpu> gpu;
};

template <typename T>
GpuBuffer uploaded(Gpu& gpu, const std::vector<T>& values) {
  GpuBuffer buffer = gpu.allocate(values.size() * sizeof(T));
  gpu.upload(buffer, 0, std::as_bytes(std::span(values)));
  return buffer;
}

template <typename T>
std::vector<T> pixelsOf(Gpu& gpu, const GpuImage& image, unsigned layer = 0, unsigned mip = 0) {
  std::vector<T> pixels(mipBytes(image.description(), mip) / sizeof(T));
  gpu.downloadImage(image, layer, mip, std::as_writable_bytes(std::span(pixels)));
  return pixels;
}

template <typename T>
std::vector<std::byte> pushed(const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  return {bytes.begin(), bytes.end()};
}

inline void run(Gpu& gpu, const Draw& draw) {
  const Work work = &draw;
  gpu.run(std::span(&work, 1), kDrawLimit);
}

/// What the call threw, as text; "nothing" where it returned.
template <typename Error, typename Call>
std::string thrownBy(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

}  // namespace gnomon
