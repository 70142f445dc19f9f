// precision/sample_*: textureLod through a sampler against a DEVICE MODEL (reference/bound/sampling
// says what of it is specification); the model itself is tested in sampling_model_test.cpp.
//
// Covered: linear filter and linear mips of RGBA8, RGBA16F, RGBA32F, clamped; RGBA8 also repeated,
// mirrored, and nearest repeated; comparisons with the nearest texel of D32. Sides that are odd,
// powers of two and 1; texels of any code and of four neighbouring ones; coordinates in the bulk,
// at texel centres, within an ULP of every boundary, outside [0, 1]; LODs between, at, next to and
// beyond levels; references within an ULP of a texel.
// Not covered: linear comparisons (llvmpipe filters no depth; the model has them), cube maps,
// implicit LOD (compute has none), anisotropy, borders, coordinates beyond 100, texels that are
// NaN or infinite, halves and floats with address modes other than clamp.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "kernels/precision/precision.h"
#include "reference/bound/sampling.h"

namespace gnomon::precision {
namespace {

Sampling samplingOf(const SamplerDescription& sampler, const GpuInfo& device) {
  constexpr std::array kModes = {AddressMode::clamp, AddressMode::repeat, AddressMode::mirror};
  return {.linear = sampler.linear,
          .linearMips = sampler.linearMips,
          .address = kModes[static_cast<std::size_t>(sampler.address)],
          .subTexelBits = device.subTexelBits,
          .mipmapBits = device.mipmapBits};
}

/// An image as the device gets it and as the model sees it.
struct Source {
  ImageDescription description;
  std::vector<std::byte> bytes{};
  TexelImage texels{};
};

/// Of 8 bits, from the first on.
struct Codes {
  std::uint32_t first, count;
};
constexpr Codes kAllCodes{0, 256};
/// Texels so close that weights hardly matter, and what is left is a fixed-point filter's rounding.
constexpr Codes kFewCodes{100, 4};

/// Any of these codes in a normalised format; floats of either sign over twenty binades, halves'
/// normal ones; depths in [0, 1], as copies into a depth image need.
std::uint32_t anyCode(PixelFormat format, const Codes& codes, Random& random) {
  const Storage storage = storageOf(format);
  if (storage == Storage::unorm8)
    return codes.first + static_cast<std::uint32_t>(random.below(codes.count));
  if (format == PixelFormat::kD32) return encode(random.uniform(), storage);
  return encode(random.logUniform(0x1p-10, 0x1p10) * (random.chance(0.5) ? 1 : -1), storage);
}

Source anySource(PixelFormat format, const uvec2& size, const Codes& codes, unsigned mips,
                 Random& random) {
  Source source{.description = {.format = format, .width = size.x, .height = size.y, .mips = mips},
                .texels = {.storage = storageOf(format)}};
  const unsigned codeBytes = bytesPerPixel(format) / channels(format);
  for (unsigned mip = 0; mip < source.description.mips; ++mip) {
    const auto [width, height] = mipSize(source.description, mip);
    TexelLevel level{.width = static_cast<int>(width), .height = static_cast<int>(height)};
    for (unsigned i = 0; i < width * height; ++i) {
      Vec4<Bounded> texel;
      for (unsigned c = 0; c < channels(format); ++c) {
        const std::uint32_t code = anyCode(format, codes, random);
        texel[c] = loaded(code, source.texels.storage);
        for (unsigned b = 0; b < codeBytes; ++b)
          source.bytes.push_back(static_cast<std::byte>(code >> (8 * b) & 0xff));
      }
      level.texels.push_back(texel);
    }
    source.texels.levels.push_back(std::move(level));
  }
  return source;
}

/// Of a float, or the one above or below it.
float nearby(double x, Random& random) {
  const auto at = static_cast<float>(x);
  const float to = random.chance(0.5) ? 1e9f : -1e9f;
  return random.chance(1.0 / 3) ? at : std::nextafter(at, to);
}

/// One coordinate over a level with so many texels: a quarter each in the bulk, at a texel's
/// centre, next to a boundary between texels, and outside.
float anyCoordinate(int texels, Random& random) {
  const auto index = static_cast<double>(random.below(static_cast<std::uint64_t>(texels) + 1));
  switch (random.below(4)) {
    case 0:
      return static_cast<float>(random.uniform());
    case 1:
      return static_cast<float>((index + 0.5) / texels);
    case 2:
      return nearby(index / texels, random);
    default:
      return static_cast<float>(random.chance(0.25) ? random.uniform(-100, 100)
                                                    : random.uniform(-2, 3));
  }
}

/// At a level, next to it or half-way to the next; anywhere, half of the time.
float anyLod(std::size_t level, std::size_t levels, Random& random) {
  if (random.chance(0.5))
    return static_cast<float>(random.uniform(-1, static_cast<double>(levels)));
  return random.chance(0.5) ? static_cast<float>(level)
                            : nearby(static_cast<double>(level) + 0.5 * random.uniform(), random);
}

/// Half of the references lie within an ULP of the nearest texel.
Place anyPlace(const TexelImage& image, Random& random) {
  const std::size_t index = random.below(image.levels.size());
  const TexelLevel& level = image.levels[index];
  Place place{.uv = {anyCoordinate(level.width, random), anyCoordinate(level.height, random)},
              .lod = anyLod(index, image.levels.size(), random),
              .depth = static_cast<float>(random.uniform(-0.5, 1.5))};
  if (random.chance(0.5))
    place.depth = nearby(sampled(image, {}, input<double>(place.uv), place.lod).x, random);
  return place;
}

template <class T>
struct Compared {
  T value;
  auto scalars() { return std::tie(value); }
};

/// A kernel sample_* on any image, at places of every kind.
class EveryPlaceIsInsideTheDeviceModel : public KernelCase {
 public:
  explicit EveryPlaceIsInsideTheDeviceModel(const char* entry)
      : KernelCase(std::string("precision/") + entry),
        spec(findKernel(kernelName).image("source")) {}

  void SetUp() override {
    KernelCase::SetUp();
    if (IsSkipped()) return;
    skipWhereUnsupported([&] {
      Random random(caseSeed());
      dispatch(anySource(spec.format, {1, 1}, kAllCodes, 1, random), {{}});
    });
  }

  void TestBody() override {
    // Odd sides, whose levels are no halves; powers of two; a single texel; a single row.
    for (const uvec2 size : {uvec2(13, 7), uvec2(64, 16), uvec2(1, 1), uvec2(31, 1)})
      expectInside(size, kAllCodes, fullMipCount(size.x, size.y));
    if (storageOf(spec.format) != Storage::unorm8) return;
    for (const unsigned mips : {1u, 4u}) expectInside({13, 7}, kFewCodes, mips);
  }

 private:
  void expectInside(const uvec2& size, const Codes& codes, unsigned mips) {
    Random random(caseSeed() + size.x + codes.first + mips);
    const Source source = anySource(spec.format, size, codes, mips, random);
    std::vector<Place> places(generated("boundedElements"));
    for (Place& p : places) p = anyPlace(source.texels, random);
    judge(source, places);
  }

  Observation dispatch(const Source& source, const std::vector<Place>& places) {
    const Measure push{.count = static_cast<uint>(places.size())};
    return run({.inputs = {{"places", std::as_bytes(std::span(places))}},
                .outputs = {{"results", places.size()}},
                .inputImages = {{"source", source.description, source.bytes}},
                .push = std::as_bytes(std::span(&push, 1)),
                .extent = {places.size()}});
  }

  void judge(const Source& source, const std::vector<Place>& places) {
    const Sampling by = samplingOf(spec.sampler, Session::current().gpu().info());
    const auto colour = [&]<class T>(std::size_t i) {
      return sampled(source.texels, by, input<T>(places[i].uv), input<T>(places[i].lod));
    };
    const auto comparison = [&]<class T>(std::size_t i) {
      return Compared<T>{compared(source.texels, by, input<T>(places[i].uv),
                                  input<T>(places[i].lod), input<T>(places[i].depth))};
    };
    const auto describe = [&](std::size_t i) {
      const Place& p = places[i];
      return fmt::format(
          "    size  {} x {}\n    uv    ({:.9g}, {:.9g})\n    lod   {:.9g}\n"
          "    depth {:.9g}\n",
          source.description.width, source.description.height, p.uv.x, p.uv.y, p.lod, p.depth);
    };
    Expectation expected = spec.sampler.compare
                               ? expectationOf("results", places.size(), comparison, describe)
                               : expectationOf("results", places.size(), colour, describe);
    expected.corners = places.size();  // the plain model clears none
    expected.judgesRules = true;
    expectWithinSpecification(dispatch(source, places), expected);
  }

  const ImageSpec& spec;
};

void add(const char* suite, const char* entry) {
  testing::RegisterTest(
      suite, "EveryPlaceIsInsideTheDeviceModel", nullptr, nullptr, __FILE__, __LINE__,
      [entry]() -> KernelCase* { return new EveryPlaceIsInsideTheDeviceModel(entry); });
}

const bool registered = [] {
  add("PrecisionSampleRgba8", "sample_rgba8");
  add("PrecisionSampleRgba8Repeat", "sample_rgba8_repeat");
  add("PrecisionSampleRgba8Mirror", "sample_rgba8_mirror");
  add("PrecisionSampleRgba8Nearest", "sample_rgba8_nearest");
  add("PrecisionSampleRgba16f", "sample_rgba16f");
  add("PrecisionSampleRgba32f", "sample_rgba32f");
  add("PrecisionSampleCompare", "sample_compare");
  return true;
}();

}  // namespace
}  // namespace gnomon::precision
