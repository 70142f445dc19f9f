// Every mip level of an image written in one dispatch, through an array of descriptors.
//
// Covered: where each level's pixels are, before and after a narrow format, with levels that are
// forgotten and levels in each other's place; descriptors past the last level; rows from below; the
// length of the array in the contract and in a shader, ours or foreign; devices with too few
// descriptors, or without what a capability asks for.
// Not covered: dynamic indices into the array, layers with mip levels, which no output has; images
// that are read while written.
#include "harness/hygiene/levels.h"

#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

// 13 x 5, 6 x 2, 3 x 1 and 1 x 1: every halving of a side loses a pixel somewhere.
constexpr Levels kImage{.width = 13, .height = 5, .count = 4};
constexpr std::size_t kPixels = 65 + 12 + 3 + 1;
constexpr unsigned kDescriptors = 6;

KernelRecord record(PixelFormat format = PixelFormat::kR32f) {
  return {.stage = "test",
          .entry = "levels",
          .images = {{.name = "pyramid",
                      .binding = 2,
                      .access = Access::kWrite,
                      .type = "image2D",
                      .format = format,
                      .descriptors = kDescriptors}},
          .push = {},
          .features = {"shaderStorageImageWriteWithoutFormat"},
          .conventions = {{"y", {"down", "up"}}}};
}

// Multiples of 2^-7 below 1, which RG16F holds exactly.
float valueOf(const LevelPixel& p) {
  return static_cast<float>(p.level * 32 + p.y * 16 + p.x) / 128;
}

/// A kernel that writes a level m after the other, which `store` does with a pixel. The indices are
/// constants: not every device has shaderStorageImageArrayDynamicIndexing.
SpirvWords writer(const std::string& store, unsigned descriptors = kDescriptors,
                  const std::string& place = "set = 0, binding = 2") {
  return compileText(fmt::format(R"(#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout({}) writeonly uniform image2D pyramid[{}];
#define LEVEL(m) {{ \
    ivec2 size = max(ivec2(13, 5) >> m, ivec2(1)); \
    vec4 value = vec4((m * 32 + p.y * 16 + p.x) / 128.0); \
    if (p.x < size.x && p.y < size.y) {{ {} }} \
  }}
void main() {{
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  LEVEL(0) LEVEL(1) LEVEL(2) LEVEL(3)
}})",
                                 place, descriptors, store));
}

const std::string kStore = "imageStore(pyramid[m], p, value);";

using Lines = std::vector<std::string>;

class MipLevels : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }

  static Observation observed(const SpirvWords& words, const KernelRecord& r = record(),
                              const std::optional<Adapter>& adapter = {}) {
    return observe({*gpu, r, {.words = words, .origin = "levels.comp", .adapter = adapter}},
                   {.outputImages = {{.image = "pyramid", .width = 13, .height = 5, .mips = 4}},
                    .extent = {13, 5}});
  }

  static inline std::unique_ptr<Gpu> gpu;
};

void expectEveryLevel(const Observation& seen) {
  EXPECT_EQ(seen.findings, Lines{});
  for (const auto* outputs : {&seen.plain, &seen.twin})
    for (const auto& [name, bytes] : *outputs) {
      const std::vector<float> got = elementsOf<float>(bytes);
      ASSERT_EQ(got.size() % kPixels, 0u) << name;
      const std::size_t channels = got.size() / kPixels;
      for (std::size_t i = 0; i < got.size(); ++i) {
        const LevelPixel pixel = pixelAt(kImage, i / channels);
        ASSERT_EQ(got[i], valueOf(pixel)) << placeOn(name, pixel);
      }
    }
}

// ---- places ---------------------------------------------------------------------------------

TEST(Levels, PixelsAreCountedLevelAfterLevel) {
  EXPECT_EQ(pixelsOf(kImage), kPixels);
  const auto place = [](std::size_t i) { return placeOn("p", pixelAt(kImage, i)); };
  EXPECT_EQ(place(0), "p level 0 (0, 0)");
  EXPECT_EQ(place(64), "p level 0 (12, 4)");
  EXPECT_EQ(place(65), "p level 1 (0, 0)");
  EXPECT_EQ(place(65 + 7), "p level 1 (1, 1)");
  EXPECT_EQ(place(65 + 12 + 2), "p level 2 (2, 0)");
  EXPECT_EQ(place(80), "p level 3 (0, 0)");
  EXPECT_THROW(pixelAt(kImage, kPixels), std::out_of_range);
}

// ---- outputs --------------------------------------------------------------------------------

TEST_F(MipLevels, AreSeenOneAfterTheOther) {
  for (const PixelFormat format :
       {PixelFormat::kR32f, PixelFormat::kRg16f, PixelFormat::kRgba32f}) {
    const Observation seen = observed(writer(kStore), record(format));
    expectEveryLevel(seen);
    EXPECT_EQ(seen.twin.size(), isNarrow(format) ? 2u : 1u);
  }
}

TEST_F(MipLevels, PastTheLastDescriptorsSeeTheLast) {
  expectEveryLevel(observed(writer("imageStore(pyramid[m == 3 ? 5 : m], p, value);")));
}

TEST_F(MipLevels, ThatAreForgottenAreNamed) {
  const std::string what =
      "left 3 of 81 words of 'pyramid' unwritten, first pyramid level 2 (0, 0).r";
  EXPECT_EQ(observed(writer("if (m != 2) " + kStore)).findings,
            (Lines{"the kernel " + what, "the strict twin " + what}));
}

template <class T>
struct GreyOf {
  T r;
  auto scalars() { return std::tie(r); }
};

// The values differ at level 3 alone, and level 2 is left out.
TEST_F(MipLevels, InThePlaceOfAnotherAreWrongThere) {
  const Observation seen =
      observed(writer("if (m != 3) imageStore(pyramid[m == 2 ? 3 : m], p, value);"));
  ASSERT_EQ(seen.findings.size(), 2u) << fmt::format("{}", fmt::join(seen.findings, "\n"));
  EXPECT_TRUE(seen.findings[0].ends_with("unwritten, first pyramid level 2 (0, 0).r"))
      << seen.findings[0];
  const Expectation expected = levelsOf(
      "pyramid", kImage,
      []<class T>(std::size_t i) { return GreyOf<T>{T(valueOf(pixelAt(kImage, i)))}; },
      [](std::size_t i) { return fmt::format("    i  {}\n", i); });
  const Policy policy =
      Policy::load(std::filesystem::path(GNOMON_SOURCE_DIR) / "tests/policy.json");
  Observation last = seen;  // of which level 2 is as it should be
  for (auto* outputs : {&last.plain, &last.twin})
    for (std::size_t i = 77; i < 80; ++i) {
      const float value = valueOf(pixelAt(kImage, i));
      std::memcpy(outputs->at("pyramid").data() + i * sizeof value, &value, sizeof value);
    }
  const Verdict verdict = judge(record().layoutOf("pyramid"), last, expected,
                                Bounds::specification(gpu->info().roundingRteFloat32), policy, 1);
  EXPECT_EQ(verdict.verdict, Class::kWrong);
  EXPECT_EQ(verdict.outside, 1u);
  EXPECT_NE(explain(verdict, expected).find("worst: pyramid level 3 (0, 0).r"), std::string::npos)
      << explain(verdict, expected);
}

TEST_F(MipLevels, HaveNoLayers) {
  const KernelRecord r = record();
  const Subject subject(*gpu, r, {.words = writer(kStore), .origin = "levels.comp"});
  EXPECT_THROW(
      observe(subject,
              {.outputImages =
                   {{.image = "pyramid", .width = 13, .height = 5, .layers = 2, .mips = 4}}}),
      std::logic_error);
}

// ---- foreign kernels, and what contradicts --------------------------------------------------

TEST_F(MipLevels, OfAKernelThatCountsRowsFromBelowAreTurnedOneByOne) {
  const Adapter up{.conventions = {{"y", "up"}}};
  expectEveryLevel(observed(writer("imageStore(pyramid[m], ivec2(p.x, size.y - 1 - p.y), value);"),
                            record(), up));
}

TEST_F(MipLevels, AForeignKernelMayHaveFewerDescriptors) {
  const Adapter elsewhere{.bindings = {{"pyramid", {1, 7}}}};
  expectEveryLevel(observed(writer(kStore, 4, "set = 1, binding = 7"), record(), elsewhere));
}

std::string refusal(Gpu& gpu, unsigned ours, unsigned theirs,
                    const std::optional<Adapter>& adapter) {
  KernelRecord r = record();
  r.images[0].descriptors = ours;
  try {
    const Subject subject(
        gpu, r, {.words = writer(kStore, theirs), .origin = "levels.comp", .adapter = adapter});
  } catch (const UsageError& error) {
    const std::string said = error.what();
    return said.substr(said.find("\n  ") + 3);
  }
  return "accepted";
}

TEST_F(MipLevels, TheLengthOfTheArrayIsTheContracts) {
  EXPECT_EQ(refusal(*gpu, 6, 4, {}),
            "'pyramid' is an array of 4 in the shader, an array of 6 in the contract");
  EXPECT_EQ(refusal(*gpu, 6, 6, {}), "accepted");
  EXPECT_EQ(refusal(*gpu, 6, 7, Adapter{}),
            "'pyramid' is an array of 7 in the shader, an array of 6 in the contract");
  EXPECT_EQ(refusal(*gpu, 1, 4, Adapter{}),
            "'pyramid' is an array of 4 in the shader, one image in the contract");
}

// glslang does not declare the capability of dynamic indices; other compilers do.
TEST_F(MipLevels, WhatACapabilityAsksOfTheDeviceIsUnsupportedWhereItIsMissing) {
  const char* const feature = "shaderStorageImageArrayDynamicIndexing";
  constexpr std::uint32_t kOpCapability = 2 << 16 | 17, kStorageImageArrayDynamicIndexing = 31;
  SpirvWords declaring = writer(kStore);
  declaring.insert(declaring.begin() + 5,  // behind the header
                   {kOpCapability, kStorageImageArrayDynamicIndexing});
  try {
    expectEveryLevel(observed(declaring));
    EXPECT_TRUE(gpu->info().features.at(feature));
  } catch (const Unsupported& why) {
    EXPECT_EQ(why.what(), fmt::format("{} lacks {}", gpu->info().name, feature));
    EXPECT_FALSE(gpu->info().features.at(feature));
  }
}

TEST_F(MipLevels, ADeviceWithTooFewDescriptorsIsUnsupported) {
  try {
    gpu->build(
        {.spirv = writer(kStore), .slots = {{0, 2, BindingSlot::Kind::kStorageImage, 1u << 30}}});
    ADD_FAILURE() << "built";
  } catch (const Unsupported& why) {
    EXPECT_TRUE(std::string(why.what()).starts_with("1073741824 storage images; ")) << why.what();
  }
}

}  // namespace
}  // namespace gnomon
