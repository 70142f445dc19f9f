// Images in hygiene and verdicts: outputs in every format, seen before and after a narrow one
// rounds them; inputs in every format, shape and mip level; what contradicts the record; narrow
// verdicts. Not covered: comparing and min/max samplers, arrays of cubes, several levels of an
// output.
#include "harness/hygiene/observe.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "harness/verdict/verdict.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

constexpr unsigned kWidth = 7, kHeight = 3;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

struct Texel {
  vec4 value;
};

BufferSpec texels(unsigned binding) {
  return {"texels", binding, Access::kWrite,
          describe<Texel>("Texel", field("value", &Texel::value))};
}

ImageSpec output(PixelFormat format, const std::string& type = "image2D") {
  return {.name = "target", .binding = 0, .access = Access::kWrite, .type = type, .format = format};
}

ImageSpec source(const std::string& type, const SamplerDescription& sampler = {}) {
  return {.name = "source",
          .binding = 0,
          .access = Access::kRead,
          .type = type,
          .format = PixelFormat::kRgba32f,
          .sampler = sampler};
}

KernelRecord recordOf(std::vector<ImageSpec> images, std::vector<BufferSpec> buffers = {}) {
  return {.stage = "test",
          .entry = "images",
          .file = {},
          .buffers = std::move(buffers),
          .images = std::move(images),
          .push = {},
          .features = {"scalarBlockLayout", "shaderStorageImageWriteWithoutFormat"}};
}

/// A kernel over the pixels p of an extent; `body` stands in its main.
SpirvWords kernel(const std::string& bindings, const std::string& body) {
  return compileText(fmt::format(R"(#version 450
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 8, local_size_y = 8) in;
struct Texel {{ vec4 value; }};
{}
void main() {{
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  {}
}})",
                                 bindings, body));
}

/// Writes an expression of the pixel p and its index i to an image.
SpirvWords painter(const std::string& value, const std::string& type = "image2D") {
  return kernel(fmt::format("layout(set = 0, binding = 0) writeonly uniform {} target;", type),
                fmt::format(R"(ivec2 size = imageSize(target).xy;
  if (p.x >= size.x || p.y >= size.y) return;
  int i = p.y * size.x + p.x;
  {})",
                            value));
}

std::string paint(const std::string& value) {
  return fmt::format("imageStore(target, p, {});", value);
}

std::string all(const Observation& seen) {
  return fmt::format("findings: {}", fmt::join(seen.findings, "\n"));
}

bool finds(const std::vector<std::string>& lines, std::string_view words) {
  return std::ranges::any_of(
      lines, [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

/// Of the strict twin.
Bytes outputOf(const Observation& seen, const std::string& name) {
  const auto found = seen.twin.find(name);
  if (found != seen.twin.end()) return found->second;
  ADD_FAILURE() << "nothing was observed as '" << name << "'";
  return {};
}

std::vector<float> floats(const Bytes& bytes) { return elementsOf<float>(bytes); }

template <class T>
InputImage inputOf(const ImageDescription& description, const std::vector<T>& codes) {
  return {.image = "source", .description = description, .texels = std::as_bytes(std::span(codes))};
}

class ImageHygiene : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }

  static Observation painted(const KernelRecord& record, const SpirvWords& module,
                             unsigned layers = 1) {
    const Subject subject(*gpu, record, {.words = module, .origin = "painter.comp"});
    return observe(subject, {.outputImages = {{"target", kWidth, kHeight, layers}},
                             .extent = {kWidth, kHeight}});
  }

  /// What a kernel read of a source image, texel by texel, into a buffer of that many.
  static std::vector<vec4> readBack(const std::vector<ImageSpec>& images, const InputImage& given,
                                    const SpirvWords& module, std::size_t count) {
    const KernelRecord record = recordOf(images, {texels(7)});
    const Subject subject(*gpu, record, {.words = module, .origin = "reader.comp"});
    const Observation seen = observe(
        subject, {.outputs = {{"texels", count}}, .inputImages = {given}, .extent = {count}});
    EXPECT_TRUE(seen.findings.empty()) << all(seen);
    EXPECT_EQ(seen.plain.at("texels"), seen.twin.at("texels"));
    return elementsOf<vec4>(seen.twin.at("texels"));
  }

  static inline std::unique_ptr<Gpu> gpu;
};

// ---- outputs --------------------------------------------------------------------------------

TEST_F(ImageHygiene, ANarrowOutputIsSeenBeforeAndAfterItsFormatRoundsIt) {
  const KernelRecord record = recordOf({output(PixelFormat::kRgba8)});
  const Observation seen = painted(record, painter(paint("vec4(0.3, 2.0, -1.0, i / 255.0)")));
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  for (const auto* outputs : {&seen.plain, &seen.twin}) {
    ASSERT_EQ(outputs->size(), 2u);
    const std::vector<float> wide = floats(outputs->at("target"));
    const std::vector<float> narrow = floats(outputs->at("target as RGBA8"));
    ASSERT_EQ(wide.size(), 4 * kPixels);
    ASSERT_EQ(narrow.size(), 4 * kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) {
      EXPECT_EQ(std::vector(&wide[4 * i], &wide[4 * i + 3]), (std::vector{0.3f, 2.0f, -1.0f}));
      EXPECT_NEAR(narrow[4 * i] * 255, 76.5f, 0.5001f);  // either code around 0.3
      EXPECT_EQ(narrow[4 * i + 1], 1.0f);
      EXPECT_EQ(narrow[4 * i + 2], 0.0f);
      EXPECT_FLOAT_EQ(narrow[4 * i + 3], static_cast<float>(i) / 255);
    }
  }
}

template <class T>
struct GreyOf {
  T r;
  auto scalars() { return std::tie(r); }
};

template <class F>
Verdict judged(const Gpu& gpu, const KernelRecord& record, const Observation& seen, F model,
               Storage storage, const std::string& name) {
  static const Policy policy =
      Policy::load(std::filesystem::path(GNOMON_SOURCE_DIR) / "tests/policy.json");
  Expectation e = pixelsOf(name, {kWidth, kHeight}, model,
                           [](std::size_t i) { return fmt::format("    i  {}\n", i); });
  e.storage = storage;
  return judge(pixelLayout(record.image("target").format), seen, e,
               Bounds::specification(gpu.info().roundingRteFloat32), policy, 1);
}

TEST_F(ImageHygiene, AKernelWithoutSaturateIsWrongThoughItsFormatHidesIt) {
  const KernelRecord record = recordOf({output(PixelFormat::kR8)});
  const Observation seen = painted(record, painter(paint("vec4(float(i) * 0.125)")));
  ASSERT_TRUE(seen.twin.contains("target as R8"));
  const auto saturated = []<class T>(std::size_t i) {
    return GreyOf<T>{min(T(static_cast<float>(i)) * T(0.125f), T(1.0f))};
  };
  const Verdict wide = judged(*gpu, record, seen, saturated, Storage::float32, "target");
  EXPECT_EQ(wide.verdict, Class::kWrong);
  EXPECT_EQ(wide.outside, kPixels - 9);  // 8 / 8 is 1 still
  const Verdict narrow = judged(*gpu, record, seen, saturated, Storage::unorm8, "target as R8");
  EXPECT_EQ(narrow.verdict, Class::kConforms)
      << fmt::format("{}", fmt::join(narrow.problems, "\n"));
}

TEST_F(ImageHygiene, APixelLeftUnwrittenIsNamed) {
  for (const PixelFormat format :
       {PixelFormat::kRgba8, PixelFormat::kR8, PixelFormat::kRgba16f, PixelFormat::kR32f}) {
    const KernelRecord record = recordOf({output(format)});
    const Observation seen =
        painted(record, painter("if (p != ivec2(3, 1)) " + paint("vec4(0.5)")));
    const unsigned n = channels(format);
    for (const char* module : {"kernel", "strict twin"})
      EXPECT_TRUE(finds(seen.findings,
                        fmt::format("the {} left {} of {} words of 'target' unwritten, first "
                                    "target(3, 1).r",
                                    module, n, n * kPixels)))
          << nameOf(format) << "\n"
          << all(seen);
    EXPECT_EQ(seen.findings.size(), isNarrow(format) ? 4u : 2u) << all(seen);
    if (isNarrow(format)) {
      EXPECT_TRUE(finds(seen.findings, fmt::format("'target as {}' unwritten", nameOf(format))))
          << all(seen);
    }
  }
}

struct Stored {
  PixelFormat format;
  const char* value;  ///< of pixel i
  float first, step;  ///< of channel c in pixel i: first + c + step * i
};

// Numbers that every one of the formats holds exactly.
constexpr Stored kStored[] = {
    {PixelFormat::kRg16f, "vec4(0.5 * i, 0.5 * i + 1, 9, 9)", 0, 0.5f},
    {PixelFormat::kR16f, "vec4(-0.25 * i, 9, 9, 9)", 0, -0.25f},
    {PixelFormat::kRgba16f, "vec4(i) + vec4(0, 1, 2, 3)", 0, 1},
    {PixelFormat::kRgba32f, "vec4(i / 1024.0) + vec4(0, 1, 2, 3)", 0, 1 / 1024.0f},
    {PixelFormat::kRg32f, "vec4(i / 1024.0) + vec4(0, 1, 2, 3)", 0, 1 / 1024.0f},
    {PixelFormat::kR32f, "vec4(1e-30 * i, 9, 9, 9)", 0, 1e-30f},
};

TEST_F(ImageHygiene, OutputsOfFloatFormatsAreTheNumbersThatWereStored) {
  for (const Stored& s : kStored) {
    const Observation seen = painted(recordOf({output(s.format)}), painter(paint(s.value)));
    EXPECT_TRUE(seen.findings.empty()) << nameOf(s.format) << " " << all(seen);
    const unsigned n = channels(s.format);
    for (const auto& [name, bytes] : seen.twin) {
      const std::vector<float> got = floats(bytes);
      ASSERT_EQ(got.size(), n * kPixels) << name;
      for (std::size_t k = 0; k < got.size(); ++k)
        ASSERT_FLOAT_EQ(got[k],
                        s.first + static_cast<float>(k % n) + s.step * static_cast<float>(k / n))
            << name << " of " << nameOf(s.format) << ", word " << k;
    }
    EXPECT_EQ(seen.twin.size(), isNarrow(s.format) ? 2u : 1u);
  }
}

TEST_F(ImageHygiene, AnOutputOfR8IsItsCodes) {
  const Observation seen =
      painted(recordOf({output(PixelFormat::kR8)}), painter(paint("vec4(i * 12 / 255.0)")));
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  const std::vector<float> codes = floats(outputOf(seen, "target as R8"));
  ASSERT_EQ(codes.size(), kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    ASSERT_FLOAT_EQ(codes[i], static_cast<float>(12 * i) / 255);
}

TEST_F(ImageHygiene, AnOutputOfIntegersKeepsEveryBit) {
  const KernelRecord record = recordOf({output(PixelFormat::kR32ui, "uimage2D")});
  const Observation seen =
      painted(record, painter(paint("uvec4(0xfffffff0u + uint(i))"), "uimage2D"));
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  const auto got = elementsOf<std::uint32_t>(outputOf(seen, "target"));
  ASSERT_EQ(got.size(), kPixels);
  for (std::uint32_t i = 0; i < kPixels; ++i) ASSERT_EQ(got[i], 0xfffffff0u + i);
}

TEST_F(ImageHygiene, LayersOfAnOutputFollowEachOther) {
  const KernelRecord record = recordOf({output(PixelFormat::kR16f, "image2DArray")});
  const Observation seen = painted(record,
                                   painter("for (int k = 0; k < 3; ++k)"
                                           "  imageStore(target, ivec3(p, k), vec4(100 * k + i));",
                                           "image2DArray"),
                                   3);
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  for (const char* name : {"target", "target as R16F"}) {
    const std::vector<float> got = floats(outputOf(seen, name));
    ASSERT_EQ(got.size(), 3 * kPixels);
    for (std::size_t k = 0; k < got.size(); ++k)
      ASSERT_EQ(got[k], static_cast<float>(100 * (k / kPixels) + k % kPixels)) << name;
  }
}

// Below the least normal half, the largest, one with all of its bits, a zero with its sign.
TEST_F(ImageHygiene, HalvesAtTheEndsOfTheirRangeAreReadBackBitForBit) {
  const Observation seen = painted(recordOf({output(PixelFormat::kRgba16f)}),
                                   painter(paint("vec4(ldexp(1.0, -24), -65504.0, "
                                                 "uintBitsToFloat(0x3faaa000u), -0.0)")));
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  const auto got = elementsOf<std::uint32_t>(seen.twin.at("target as RGBA16F"));
  ASSERT_EQ(got.size(), 4 * kPixels);
  for (std::size_t i = 0; i < kPixels; ++i)
    EXPECT_EQ(std::vector(&got[4 * i], &got[4 * i] + 4),
              (std::vector{0x33800000u, 0xc77fe000u, 0x3faaa000u, 0x80000000u}));
}

TEST_F(ImageHygiene, AnUnwrittenPixelOfALaterLayerIsNamedWithItsLayer) {
  const Observation seen =
      painted(recordOf({output(PixelFormat::kR32f, "image2DArray")}),
              painter("for (int k = 0; k < 3; ++k) if (k != 2 || p != ivec2(3, 1))"
                      "  imageStore(target, ivec3(p, k), vec4(1));",
                      "image2DArray"),
              3);
  EXPECT_TRUE(finds(seen.findings, "first target(3, 1, 2).r")) << all(seen);
}

// ---- inputs ---------------------------------------------------------------------------------

/// Reads the source with an expression, texel i of the count, into the buffer.
SpirvWords reader(const std::string& declaration, const std::string& read) {
  return kernel(declaration + R"(
layout(set = 0, binding = 7, scalar) writeonly buffer Texels { Texel texels[]; };)",
                fmt::format(R"(int i = p.x;
  if (p.y > 0 || i >= COUNT) return;
  texels[i].value = {};)",
                            read));
}

std::string counted(std::size_t count, const std::string& declaration) {
  return fmt::format("#define COUNT {}\n{}", count, declaration);
}

const char* const kFetched = "layout(set = 0, binding = 0) uniform texture2D source;";

struct Given {
  PixelFormat format;
  std::vector<std::uint32_t> words;  ///< the bits of two pixels, rows tight, padded
  vec4 first, second;
};

// Codes of two pixels side by side, and what Vulkan says a shader reads of them.
TEST_F(ImageHygiene, InputsOfEveryFormatArrive) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  const Given all[] = {
      {PixelFormat::kRgba8, {0xff336600, 0x00ff0000}, {0, 0.4f, 0.2f, 1}, {0, 0, 1, 0}},
      {PixelFormat::kR8, {0xff33}, {0.2f, 0, 0, 1}, {1, 0, 0, 1}},
      {PixelFormat::kRgba16f,
       {0x40003c00, 0x44004200, 0xc000bc00, 0x00003800},
       {1, 2, 3, 4},
       {-1, -2, 0.5f, 0}},
      {PixelFormat::kRg16f, {0x40003c00, 0xc000bc00}, {1, 2, 0, 1}, {-1, -2, 0, 1}},
      {PixelFormat::kR16f, {0x40003c00}, {1, 0, 0, 1}, {2, 0, 0, 1}},
      {PixelFormat::kRgba32f,
       {bits(1), bits(2), bits(3), bits(4), bits(5), bits(6), bits(7), bits(8)},
       {1, 2, 3, 4},
       {5, 6, 7, 8}},
      {PixelFormat::kRg32f, {bits(1), bits(2), bits(3), bits(4)}, {1, 2, 0, 1}, {3, 4, 0, 1}},
      {PixelFormat::kR32f, {bits(1e9f), bits(-2)}, {1e9f, 0, 0, 1}, {-2, 0, 0, 1}},
      {PixelFormat::kD32, {bits(0.25f), bits(1)}, {0.25f, 0, 0, 1}, {1, 0, 0, 1}}};
  const SpirvWords module = reader(counted(2, kFetched), "texelFetch(source, ivec2(i, 0), 0)");
  for (const Given& g : all) {
    const ImageDescription two{.format = g.format, .width = 2, .height = 1};
    InputImage input = inputOf(two, g.words);
    input.texels = input.texels.first(mipBytes(two, 0));
    const std::vector<vec4> got = readBack({source("texture2D")}, input, module, 2);
    for (int c = 0; c < 4; ++c) {
      if (g.format == PixelFormat::kD32 && c > 0) continue;  // undefined but for the first
      EXPECT_FLOAT_EQ(got[0][c], g.first[c]) << nameOf(g.format) << ", channel " << c;
      EXPECT_FLOAT_EQ(got[1][c], g.second[c]) << nameOf(g.format) << ", channel " << c;
    }
  }
}

TEST_F(ImageHygiene, AnInputOfIntegersArrives) {
  const std::vector<std::uint32_t> codes = {7, 0xffffff};
  for (const char* type : {"utexture2D", "usampler2D"}) {
    const auto got = readBack(
        {source(type)}, inputOf({.format = PixelFormat::kR32ui, .width = 2}, codes),
        reader(counted(2, fmt::format("layout(set = 0, binding = 0) uniform {} source;", type)),
               "vec4(texelFetch(source, ivec2(i, 0), 0))"),
        2);
    EXPECT_EQ(got[0].x, 7) << type;
    EXPECT_EQ(got[1].x, 0xffffff) << type;
  }
}

/// Numbers 0, 1, 2, ... as texels of one channel.
std::vector<float> counting(std::size_t count) {
  std::vector<float> numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = static_cast<float>(i);
  return numbers;
}

void expectNumbers(const std::vector<vec4>& got, const std::vector<float>& expected) {
  std::vector<float> numbers;
  for (const vec4& texel : got) numbers.push_back(texel.x);
  EXPECT_EQ(numbers, expected);
}

TEST_F(ImageHygiene, LayersOfAnInputArrive) {
  const auto numbers = counting(2 * 1 * 3);
  expectNumbers(
      readBack(
          {source("texture2DArray")},
          inputOf({.format = PixelFormat::kR32f, .width = 2, .height = 1, .layers = 3}, numbers),
          reader(counted(6, "layout(set = 0, binding = 0) uniform texture2DArray source;"),
                 "texelFetch(source, ivec3(i % 2, 0, i / 2), 0)"),
          6),
      numbers);
}

TEST_F(ImageHygiene, AnArrayOfOneLayerIsAnArrayStill) {
  const auto numbers = counting(2);
  expectNumbers(
      readBack({source("texture2DArray")},
               inputOf({.format = PixelFormat::kR32f, .width = 2}, numbers),
               reader(counted(2, "layout(set = 0, binding = 0) uniform texture2DArray source;"),
                      "texelFetch(source, ivec3(i, 0, 0), 0)"),
               2),
      numbers);
}

TEST_F(ImageHygiene, FacesOfACubeArriveInVulkansOrder) {
  const auto numbers = counting(6);
  expectNumbers(
      readBack({source("samplerCube")},
               inputOf({.format = PixelFormat::kR32f, .layers = 6, .cube = true}, numbers),
               reader(counted(6, "layout(set = 0, binding = 0) uniform samplerCube source;"),
                      "textureLod(source, (i % 2 == 0 ? 1.0 : -1.0) * vec3(i / 2 == 0, i / 2 == 1, "
                      "i / 2 == 2), 0.0)"),
               6),
      numbers);
}

// Levels of 4 x 2, 2 x 1 and 1 x 1 texels: numbers 0 to 7, 8 to 9, 10.
constexpr ImageDescription kLevels{
    .format = PixelFormat::kR32f, .width = 4, .height = 2, .mips = 3};

TEST_F(ImageHygiene, MipLevelsAreFetched) {
  const auto numbers = counting(11);
  expectNumbers(readBack({source("texture2D")}, inputOf(kLevels, numbers),
                         reader(counted(11, kFetched),
                                "i < 8 ? texelFetch(source, ivec2(i % 4, i / 4), 0) : "
                                "i < 10 ? texelFetch(source, ivec2(i - 8, 0), 1) : "
                                "texelFetch(source, ivec2(0), 2)"),
                         11),
                numbers);
}

// Which of the two orders it is, neither layers nor levels alone would show.
TEST_F(ImageHygiene, EveryLayerBringsItsMipLevels) {
  ImageDescription layered = kLevels;
  layered.layers = 3;
  const auto numbers = counting(33);
  expectNumbers(
      readBack({source("texture2DArray")}, inputOf(layered, numbers),
               reader(counted(33, "layout(set = 0, binding = 0) uniform texture2DArray source;"),
                      "i % 11 < 8 ? texelFetch(source, ivec3(i % 11 % 4, i % 11 / 4, i / 11), 0) : "
                      "i % 11 < 10 ? texelFetch(source, ivec3(i % 11 - 8, 0, i / 11), 1) : "
                      "texelFetch(source, ivec3(0, 0, i / 11), 2)"),
               33),
      numbers);
}

TEST_F(ImageHygiene, PicturesAreReadAsTheirOwnNumbers) {
  Picture picture{.size = {kWidth, kHeight}, .texels = {}};
  for (std::size_t i = 0; i < kPixels; ++i)
    picture.texels.emplace_back(0.1f * static_cast<float>(i), -1e5f, 0x1p-24f, 1.0f / 3);
  const SpirvWords module =
      reader(counted(kPixels, kFetched),
             fmt::format("texelFetch(source, ivec2(i % {0}, i / {0}), 0)", kWidth));
  EXPECT_EQ(readBack({source("texture2D")}, floatImage("source", picture), module, kPixels),
            picture.texels);
  for (const PixelFormat format :
       {PixelFormat::kR16f, PixelFormat::kRg16f, PixelFormat::kRgba16f}) {
    const HalfImage halves("source", picture, format);
    EXPECT_EQ(readBack({source("texture2D")}, halves.input(), module, kPixels),
              halves.picture().texels)
        << nameOf(format);
    EXPECT_NE(halves.picture().texels, picture.texels) << nameOf(format);
  }
}

TEST_F(ImageHygiene, MipLevelsAreSampled) {
  const auto got = readBack(
      {source("sampler2D", {.linear = false, .linearMips = true})}, inputOf(kLevels, counting(11)),
      reader(counted(3, "layout(set = 0, binding = 0) uniform sampler2D source;"),
             "textureLod(source, vec2(0.1), i == 2 ? 1.5 : float(i))"),
      3);
  expectNumbers(got, {0, 8, 9});  // half way between 8 and 10
}

TEST_F(ImageHygiene, ASamplerOfItsOwnSamplesAnImage) {
  const ImageSpec sampler{.name = "linear",
                          .binding = 1,
                          .access = Access::kRead,
                          .type = "sampler",
                          .sampler = {.linear = true}};
  const auto got = readBack(
      {source("texture2D"), sampler},
      inputOf({.format = PixelFormat::kR32f, .width = 2}, counting(2)),
      reader(counted(3, fmt::format("{}\nlayout(set = 0, binding = 1) uniform sampler linear;",
                                    kFetched)),
             "textureLod(sampler2D(source, linear), vec2(0.25 + 0.25 * i, 0.5), 0.0)"),
      3);
  expectNumbers(got, {0, 0.5f, 1});
}

TEST_F(ImageHygiene, AKernelMayFetchWhereTheContractHasASampler) {
  const ImageSpec sampler{
      .name = "nearest", .binding = 1, .access = Access::kRead, .type = "sampler"};
  const auto got = readBack({source("texture2D"), sampler},
                            inputOf({.format = PixelFormat::kR32f, .width = 2}, counting(2)),
                            reader(counted(2, kFetched), "texelFetch(source, ivec2(i, 0), 0)"), 2);
  expectNumbers(got, {0, 1});
}

TEST_F(ImageHygiene, ASamplerOfItsOwnIsWhatItsRecordSays) {
  using Address = SamplerDescription::Address;
  const auto sampled = [](Address address) {
    const ImageSpec sampler{.name = "how",
                            .binding = 1,
                            .access = Access::kRead,
                            .type = "sampler",
                            .sampler = {.address = address}};
    return readBack(
        {source("texture2D"), sampler},
        inputOf({.format = PixelFormat::kR32f, .width = 4}, counting(4)),
        reader(counted(4, fmt::format("{}\nlayout(set = 0, binding = 1) uniform sampler how;",
                                      kFetched)),
               "textureLod(sampler2D(source, how), vec2(1.125 + 0.25 * i, 0.5), 0.0)"),
        4);
  };
  expectNumbers(sampled(Address::kClamp), {3, 3, 3, 3});
  expectNumbers(sampled(Address::kRepeat), {0, 1, 2, 3});
  expectNumbers(sampled(Address::kMirror), {3, 2, 1, 0});
}

TEST_F(ImageHygiene, AnInputWithTheWrongNumberOfBytesIsAProgrammersError) {
  const KernelRecord record = recordOf({source("texture2D")}, {texels(7)});
  const Subject subject(
      *gpu, record,
      {.words = reader(counted(1, kFetched), "texelFetch(source, p, 0)"), .origin = "reader.comp"});
  for (const std::size_t count : {std::size_t{0}, std::size_t{10}, std::size_t{12}}) {
    const auto numbers = counting(count);
    try {
      observe(subject, {.outputs = {{"texels", 1}}, .inputImages = {inputOf(kLevels, numbers)}});
      FAIL() << "accepted";
    } catch (const std::logic_error& error) {
      EXPECT_EQ(std::string(error.what()),
                fmt::format("'source' has {} bytes of texels, its description 44", 4 * count));
    }
  }
}

// ---- contradictions -------------------------------------------------------------------------

std::string refusal(Gpu& gpu, const KernelRecord& record, const SpirvWords& module) {
  try {
    const Subject subject(gpu, record, {.words = module, .origin = "images.comp"});
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(ImageHygiene, WhatContradictsTheRecordIsNamedWithBothSides) {
  const auto expectRefusal = [](const KernelRecord& record, const SpirvWords& module,
                                const std::string& words) {
    const std::string why = refusal(*gpu, record, module);
    EXPECT_NE(why.find(words), std::string::npos) << why;
    EXPECT_NE(why.find("images.comp does not fit the contract of test/images"), std::string::npos)
        << why;
  };
  const SpirvWords grey = painter(paint("vec4(0.5)"));
  expectRefusal(recordOf({output(PixelFormat::kR8, "image2DArray")}), grey,
                "'target' is image2D in the shader, image2DArray in the contract");
  expectRefusal(recordOf({output(PixelFormat::kR32ui, "uimage2D")}), grey,
                "'target' is image2D in the shader, uimage2D in the contract");
  expectRefusal(recordOf({source("texture2D"), output(PixelFormat::kR8)}), grey,
                "the shader has no image 'source', which the contract binds at set 0, binding 0");
  expectRefusal(recordOf({}), grey,
                "the shader binds storage image 'target' (set 0, binding 0), which the contract "
                "does not know");
  ImageSpec elsewhere = output(PixelFormat::kR8);
  elsewhere.binding = 4;
  expectRefusal(recordOf({elsewhere}), grey,
                "'target' is at set 0, binding 0 in the shader, set 0, binding 4 in the contract");

  const SpirvWords buffer =
      kernel("layout(set = 0, binding = 0, scalar) writeonly buffer Target { Texel target[]; };",
             "target[p.x].value = vec4(1);");
  expectRefusal(recordOf({output(PixelFormat::kR8)}), buffer,
                "'target' is a storage buffer in the shader, image2D in the contract");
  BufferSpec ours = texels(0);
  ours.name = "target";
  expectRefusal(recordOf({}, {ours}), grey,
                "'target' is a storage image in the shader, a storage buffer in the contract");
}

// ---- verdicts -------------------------------------------------------------------------------

/// Grey pixels that were read back, every one the same.
Observation allOf(float value) {
  const std::vector<float> pixels(kPixels, value);
  const auto bytes = std::as_bytes(std::span(pixels));
  return {.plain = {{"target as R8", {bytes.begin(), bytes.end()}}},
          .twin = {{"target as R8", {bytes.begin(), bytes.end()}}}};
}

// Half of 255 is 127.5: Vulkan allows either code, and no other.
TEST_F(ImageHygiene, EitherNeighbouringCodeIsAcceptedAndNoOther) {
  const KernelRecord record = recordOf({output(PixelFormat::kR8)});
  const auto half = []<class T>(std::size_t) { return GreyOf<T>{T(0.5f)}; };
  for (const auto& [code, verdict] :
       {std::pair{126, Class::kWrong}, std::pair{127, Class::kConforms},
        std::pair{128, Class::kConforms}, std::pair{129, Class::kWrong}}) {
    const Observation seen = allOf(static_cast<float>(code) / 255);
    const Verdict v = judged(*gpu, record, seen, half, Storage::unorm8, "target as R8");
    EXPECT_EQ(v.verdict, verdict) << code;
    EXPECT_EQ(v.outside, verdict == Class::kWrong ? kPixels : 0u) << code;
  }
}

TEST_F(ImageHygiene, EitherNeighbouringHalfIsAcceptedAndNoOther) {
  const KernelRecord record = recordOf({output(PixelFormat::kR16f)});
  const auto third = []<class T>(std::size_t) { return GreyOf<T>{T(1.0f / 3)}; };
  for (const auto& [half, verdict] :
       {std::pair{0x1.550p-2f, Class::kWrong}, std::pair{0x1.554p-2f, Class::kConforms},
        std::pair{0x1.558p-2f, Class::kConforms}, std::pair{0x1.55cp-2f, Class::kWrong}}) {
    Observation seen;
    const std::vector<float> pixels(kPixels, half);
    const auto bytes = std::as_bytes(std::span(pixels));
    seen.plain["target as R16F"] = seen.twin["target as R16F"] = {bytes.begin(), bytes.end()};
    EXPECT_EQ(judged(*gpu, record, seen, third, Storage::half, "target as R16F").verdict, verdict)
        << half;
  }
}

/// The verdict on a kernel that maps depths z to numbers, against a model of them.
template <class F>
Verdict judgedDepths(Gpu& gpu, const std::vector<float>& depth, const std::string& value, F model) {
  const KernelRecord record =
      recordOf({output(PixelFormat::kR32f),
                {.name = "depth", .binding = 1, .type = "texture2D", .format = PixelFormat::kD32}});
  const Subject subject(
      gpu, record,
      {.words =
           kernel(R"(layout(set = 0, binding = 0) writeonly uniform image2D target;
layout(set = 0, binding = 1) uniform texture2D depth;)",
                  fmt::format("ivec2 size = textureSize(depth, 0);\n"
                              "float z = texelFetch(depth, min(p, size - 1), 0).r;\n"
                              "if (p.x < size.x && p.y < size.y) imageStore(target, p, vec4({}));",
                              value)),
       .origin = "depths.comp"});
  const Observation seen = observe(
      subject, {.inputImages = {{"depth",
                                 {.format = PixelFormat::kD32, .width = kWidth, .height = kHeight},
                                 std::as_bytes(std::span(depth))}},
                .outputImages = {{"target", kWidth, kHeight}},
                .extent = {kWidth, kHeight}});
  EXPECT_TRUE(seen.findings.empty()) << all(seen);
  return judged(
      gpu, record, seen,
      [&]<class T>(std::size_t i) { return GreyOf<T>{model(input<T>(depth[i]))}; },
      Storage::float32, "target");
}

// A zero is exact however inputs are widened for `equivalent`: that a depth of 0 is sky is no
// question of rounding. One pixel of 21 is a share that may be ambiguous.
TEST_F(ImageHygiene, AnExactZeroThatAKernelIgnoresIsWrongAndNotEquivalent) {
  std::vector<float> depth(kPixels, 0.25f);
  depth[7] = 0;
  const auto model = []<class T>(const T& z) { return z == T(0.0f) ? T(0.0f) : z + T(1.0f); };
  const Verdict right = judgedDepths(*gpu, depth, "z == 0.0 ? 0.0 : z + 1.0", model);
  EXPECT_EQ(right.verdict, Class::kConforms);
  const Verdict v = judgedDepths(*gpu, depth, "z + 1.0", model);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.outside, 1u);
  ASSERT_TRUE(v.worst.has_value());
  EXPECT_EQ(v.worst->element, 7u);
}

// At a threshold, widening makes either side right, which is no excuse for a quarter of a picture.
TEST_F(ImageHygiene, AThresholdMissedAtLargeIsWrongAndNotEquivalent) {
  std::vector<float> depth(kPixels, 0.25f);
  for (std::size_t i = 0; i < kPixels; i += 4) depth[i] = 0.5f;
  const Verdict v = judgedDepths(*gpu, depth, "z <= 0.5 ? 0.0 : z + 1.0", []<class T>(const T& z) {
    return z < T(0.5f) ? T(0.0f) : z + T(1.0f);
  });
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.outside, (kPixels + 3) / 4);
}

}  // namespace
}  // namespace gnomon
