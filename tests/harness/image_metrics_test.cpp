// Differences of images, the pictures of them, and the PNG file.
//
// Covered: maximum, RMSE, worst block and PSNR against closed forms; blocks cut by the edge; what a
// mean hides; NaN and infinities; sizes and channels that differ; the heat map's order and its
// file. Not covered: stb's PNG encoder, but for what stb's decoder reads back.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

#include "harness/error.h"
#include "harness/image/heatmap.h"
#include "harness/image/metrics.h"
#include "harness/image/png.h"

namespace gnomon {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Image constant(int width, int height, const std::vector<std::string>& channels, float value) {
  Image image = makeImage(width, height, channels);
  std::ranges::fill(image.data, value);
  return image;
}

TEST(Metrics, EqualImagesDifferByNothing) {
  const Image a = constant(33, 17, {"R", "G"}, 0.5f);
  const Difference d = difference(a, a, a.channels);
  EXPECT_EQ(d.max, 0);
  EXPECT_EQ(d.maxChannel, "");  // there is no place to name
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.worstBlock, 0);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
}

TEST(Metrics, AConstantDifferenceIsEveryMetric) {
  const Image a = constant(33, 17, {"R"}, 0.5f), b = constant(33, 17, {"R"}, 0.25f);
  const Difference d = difference(a, b, {"R"});
  EXPECT_EQ(d.max, 0.25);
  EXPECT_EQ(d.rmse, 0.25);
  EXPECT_EQ(d.worstBlock, 0.25);
  EXPECT_DOUBLE_EQ(d.psnr, 20 * std::log10(4.0));
}

TEST(Metrics, OnePixelAveragesAwayInTheRmseAndNotInItsBlock) {
  const Image a = constant(1024, 512, {"R", "G", "B"}, 0);
  Image b = a;
  b.at(700, 300, 1) = 1;
  const Difference d = difference(a, b, {"G"});
  EXPECT_EQ(d.max, 1);
  EXPECT_EQ(d.maxAt, (Pixel{700, 300}));
  EXPECT_EQ(d.maxChannel, "G");
  EXPECT_EQ(d.test, 1);
  EXPECT_DOUBLE_EQ(d.rmse, 1 / std::sqrt(1024.0 * 512));
  EXPECT_DOUBLE_EQ(d.worstBlock, 1.0 / 16);  // one of 256 pixels
  EXPECT_EQ(d.worstBlockAt, (Pixel{688, 288}));
  const Difference all = difference(a, b, a.channels);
  EXPECT_DOUBLE_EQ(all.worstBlock, std::sqrt(1 / (256.0 * 3)));
  EXPECT_DOUBLE_EQ(all.rmse, std::sqrt(1 / (1024.0 * 512 * 3)));
}

TEST(Metrics, ABlockAtTheEdgeIsAveragedOverItsOwnPixels) {
  const Image a = constant(17, 19, {"Y"}, 0);
  Image b = a;
  b.at(16, 18, 0) = 3;
  const Difference d = difference(a, b, {"Y"});
  EXPECT_EQ(d.worstBlockAt, (Pixel{16, 16}));
  EXPECT_DOUBLE_EQ(d.worstBlock, std::sqrt(9.0 / 3));  // 1 x 3 pixels
}

TEST(Metrics, ThePeakIsTheReferencesWhereThatIsAboveOne) {
  Image a = constant(4, 4, {"R"}, 8), b = a;
  b.at(0, 0, 0) = 4;
  const Difference d = difference(a, b, {"R"});
  EXPECT_EQ(d.peak, 8);
  EXPECT_DOUBLE_EQ(d.psnr, 20 * std::log10(8.0));  // RMSE is 4 / 4
}

TEST(Metrics, TheLargestFloatsDoNotOverflow) {
  const float huge = std::numeric_limits<float>::max();
  const Image a = constant(2, 2, {"R"}, huge), b = constant(2, 2, {"R"}, -huge);
  const Difference d = difference(a, b, {"R"});
  EXPECT_EQ(d.max, 2 * static_cast<double>(huge));
  EXPECT_DOUBLE_EQ(d.rmse, 2 * static_cast<double>(huge));
  EXPECT_EQ(d.mismatched, 0u);
}

TEST(Metrics, ANanInOneImageIsAnInfiniteErrorInEveryMetric) {
  const Image good = constant(64, 64, {"R"}, 1);
  for (const float bad : {kNan, kInf, -kInf}) {
    Image broken = good;
    broken.at(40, 20, 0) = bad;
    for (const bool swapped : {false, true}) {
      const Difference d =
          swapped ? difference(broken, good, {"R"}) : difference(good, broken, {"R"});
      EXPECT_TRUE(std::isinf(d.max) && std::isinf(d.rmse) && std::isinf(d.worstBlock)) << bad;
      EXPECT_EQ(d.psnr, -std::numeric_limits<double>::infinity());
      EXPECT_EQ(d.mismatched, 1u);
      EXPECT_EQ(d.maxAt, (Pixel{40, 20}));
      EXPECT_EQ(d.worstBlockAt, (Pixel{32, 16}));
      EXPECT_FALSE(d.max <= 1e300);  // no limit passes it
    }
  }
}

TEST(Metrics, TheSameNonFiniteValueInBothIsEqualAndCounted) {
  Image a = constant(8, 8, {"R"}, 1);
  a.at(1, 1, 0) = kNan;
  a.at(2, 2, 0) = kInf;
  a.at(3, 3, 0) = -kInf;
  const Difference d = difference(a, a, {"R"});
  EXPECT_EQ(d.max, 0);
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.nonFinite, 3u);
  EXPECT_EQ(d.mismatched, 0u);
  EXPECT_EQ(d.peak, 1);
}

TEST(Metrics, InfinitiesOfEitherSignAndNanDiffer) {
  EXPECT_TRUE(std::isinf(sampleError(kInf, -kInf)));
  EXPECT_TRUE(std::isinf(sampleError(kInf, kNan)));
  EXPECT_EQ(sampleError(-0.0f, 0.0f), 0);
}

TEST(Metrics, OtherSizesOrChannelsAreRefusedWithBoth) {
  const Image a = constant(4, 4, {"R", "G"}, 0);
  for (const Image& b : {constant(4, 5, {"R", "G"}, 0), constant(4, 4, {"R", "B"}, 0)}) {
    try {
      difference(a, b, {"R"});
      FAIL();
    } catch (const UsageError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(shapeOf(a)), std::string::npos) << text;
      EXPECT_NE(text.find(shapeOf(b)), std::string::npos) << text;
    }
  }
}

/// CIE L* of an sRGB colour (IEC 61966-2-1, CIE 15).
double lightness(const std::array<std::uint8_t, 3>& colour) {
  constexpr double kWeights[] = {0.2126, 0.7152, 0.0722};
  double y = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = colour[c] / 255.0;
    y += kWeights[c] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : y * 24389 / 27;
}

TEST(Heatmap, LightnessRisesEvenlyWithTheError) {
  EXPECT_LT(lightness(heatColour(0)), 1);
  EXPECT_GT(lightness(heatColour(1)), 97);
  for (int i = 1; i <= 100; ++i) {
    const double step = lightness(heatColour(i / 100.0)) - lightness(heatColour((i - 1) / 100.0));
    EXPECT_GT(step, 0.3) << i;
    EXPECT_LT(step, 1.7) << i;
  }
}

TEST(Heatmap, ErrorsBeyondTheEndsHaveTheEndsColoursAndInfinityItsOwn) {
  EXPECT_EQ(heatColour(-1), heatColour(0));
  EXPECT_EQ(heatColour(2), heatColour(1));
  const std::array<std::uint8_t, 3> cyan = {0, 255, 255};
  EXPECT_EQ(heatColour(std::numeric_limits<double>::infinity()), cyan);
  EXPECT_EQ(heatColour(std::numeric_limits<double>::quiet_NaN()), cyan);
}

/// The bytes of a PNG file, as stb decodes them.
std::vector<std::uint8_t> decoded(const std::filesystem::path& file, int& width, int& height,
                                  int& channels) {
  std::uint8_t* bytes = stbi_load(file.c_str(), &width, &height, &channels, 0);
  if (!bytes) return {};
  std::vector<std::uint8_t> copy(bytes, bytes + width * height * channels);
  stbi_image_free(bytes);
  return copy;
}

class PngTest : public testing::Test {
 protected:
  ~PngTest() override { std::filesystem::remove(file); }
  std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("gnomon_png_{}.png", getpid());
};
using Png = PngTest;

TEST_F(Png, RgbAndRgbaComeBackByteForByte) {
  for (const int channels : {3, 4}) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(7 * 5 * channels));
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 73);
    writePng(file, 7, 5, channels, bytes);
    int w = 0, h = 0, c = 0;
    EXPECT_EQ(decoded(file, w, h, c), bytes);
    EXPECT_EQ((std::array{w, h, c}), (std::array{7, 5, channels}));
  }
}

TEST_F(Png, AFolderThatDoesNotExistIsAUsageError) {
  const std::vector<std::uint8_t> black(3);
  EXPECT_THROW(writePng("/nowhere/at/all.png", 1, 1, 3, black), UsageError);
}

TEST_F(Png, TheHeatmapHasTheErrorsAboveAndTheColourBarBelow) {
  const std::vector<float> map = {0, 0.5f, 1, kInf, 2, 0.25f};
  writeHeatmap(file, 3, 2, map, 2);
  int w = 0, h = 0, c = 0;
  const std::vector<std::uint8_t> bytes = decoded(file, w, h, c);
  ASSERT_EQ((std::array{w, h, c}), (std::array{3, 2 + 4 + 12, 3}));
  const auto pixel = [&bytes](std::size_t i) {
    return std::array{bytes[3 * i], bytes[3 * i + 1], bytes[3 * i + 2]};
  };
  EXPECT_EQ(pixel(1), heatColour(0.25));
  EXPECT_EQ(pixel(3), heatColour(static_cast<double>(kInf)));
  EXPECT_EQ(pixel(4), heatColour(1));
  EXPECT_EQ(pixel(3 * 17), heatColour(1.0 / 6));  // the bar's pixel centres
  EXPECT_EQ(pixel(3 * 17 + 2), heatColour(5.0 / 6));
}

}  // namespace
}  // namespace gnomon
