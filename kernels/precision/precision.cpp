// Host side of stage precision: one entry for each operation, all from one shader; one for each
// format or sampler of those that read and write images.
#include "precision.h"

#include <fmt/format.h>

#include "harness/program/kernel.h"

namespace gnomon::precision {
namespace {

KernelRecord entry(const char* name, uint operation) {
  return {
      .order = 0,
      .stage = "precision",
      .entry = name,
      .file = "precision/operation.comp",
      .buffers = {{"arguments", kArguments, Access::kRead,
                   describe<Arguments>("Arguments", field("x", &Arguments::x),
                                       field("y", &Arguments::y))},
                  {"results", kResults, Access::kWrite,
                   describe<Result>("Result", field("value", &Result::value))}},
      .push = describe<Measure>("Measure", field("count", &Measure::count)),
      .features = {"scalarBlockLayout"},
      .specialization = {{kOperationId, operation}},
      .deterministic = true,
      .mutates = false,
      .summary = fmt::format("the built-in {} over its domain, and its worst error here", name),
  };
}

Struct texel() { return describe<Texel>("Texel", field("value", &Texel::value)); }

/// Pixel by pixel between an image and a buffer.
KernelRecord copies(const char* name, const char* file, const BufferSpec& buffer,
                    const ImageSpec& image, const char* summary) {
  return {.order = 0,
          .stage = "precision",
          .entry = name,
          .file = file,
          .buffers = {buffer},
          .images = {image},
          .push = describe<Pixels>("Pixels", field("size", &Pixels::size)),
          .features = {"scalarBlockLayout"},
          .mutates = false,
          .summary = summary};
}

KernelRecord load(const char* name, PixelFormat format) {
  return copies(name, "precision/load.comp", {"results", kResults, Access::kWrite, texel()},
                {.name = "source", .binding = kImage, .type = "texture2D", .format = format},
                "device model: what texelFetch reads of every code");
}

KernelRecord store(const char* name, PixelFormat format) {
  KernelRecord record =
      copies(name, "precision/store.comp", {"texels", kTexels, Access::kRead, texel()},
             {.name = "target",
              .binding = kImage,
              .access = Access::kWrite,
              .type = "image2D",
              .format = format},
             "what imageStore leaves of floats in a narrower format");
  record.features.emplace_back("shaderStorageImageWriteWithoutFormat");
  return record;
}

KernelRecord sample(const char* name, PixelFormat format, SamplerDescription sampler) {
  const bool compares = sampler.compare;
  return {.order = 0,
          .stage = "precision",
          .entry = name,
          .file = compares ? "precision/compare.comp" : "precision/sample.comp",
          .buffers = {{"places", kPlaces, Access::kRead,
                       describe<Place>("Place", field("uv", &Place::uv), field("lod", &Place::lod),
                                       field("depth", &Place::depth))},
                      {"results", kResults, Access::kWrite,
                       compares ? describe<Result>("Result", field("value", &Result::value))
                                : texel()}},
          .images = {{.name = "source",
                      .binding = kImage,
                      .type = compares ? "sampler2DShadow" : "sampler2D",
                      .format = format,
                      .sampler = sampler}},
          .push = describe<Measure>("Measure", field("count", &Measure::count)),
          .features = {"scalarBlockLayout"},
          .mutates = false,
          .summary = compares ? "device model: comparisons with the nearest texel"
                              : "device model: textureLod of one format, filter and address mode"};
}

using Address = SamplerDescription::Address;
constexpr SamplerDescription linearAt(Address address) {
  return {.linear = true, .linearMips = true, .address = address};
}

// The comparison is with the nearest texel: llvmpipe does not filter depth, and a case that is
// unsupported there would not count as run.
const bool imagesRegistered =
    registerKernel(load("load_rgba8", PixelFormat::kRgba8)) &&
    registerKernel(store("store_rgba8", PixelFormat::kRgba8)) &&
    registerKernel(store("store_rgba16f", PixelFormat::kRgba16f)) &&
    registerKernel(sample("sample_rgba8", PixelFormat::kRgba8, linearAt(Address::kClamp))) &&
    registerKernel(
        sample("sample_rgba8_repeat", PixelFormat::kRgba8, linearAt(Address::kRepeat))) &&
    registerKernel(
        sample("sample_rgba8_mirror", PixelFormat::kRgba8, linearAt(Address::kMirror))) &&
    registerKernel(
        sample("sample_rgba8_nearest", PixelFormat::kRgba8, {.address = Address::kRepeat})) &&
    registerKernel(sample("sample_rgba16f", PixelFormat::kRgba16f, linearAt(Address::kClamp))) &&
    registerKernel(sample("sample_rgba32f", PixelFormat::kRgba32f, linearAt(Address::kClamp))) &&
    registerKernel(sample("sample_compare", PixelFormat::kD32, {.compare = true}));

const bool registered =
    registerKernel(entry("divide", kDivide)) &&
    registerKernel(entry("inversesqrt", kInverseSqrt)) && registerKernel(entry("sqrt", kSqrt)) &&
    registerKernel(entry("exp", kExp)) && registerKernel(entry("exp2", kExp2)) &&
    registerKernel(entry("log", kLog)) && registerKernel(entry("log2", kLog2)) &&
    registerKernel(entry("pow", kPow)) && registerKernel(entry("sin", kSin)) &&
    registerKernel(entry("cos", kCos)) && registerKernel(entry("tan", kTan)) &&
    registerKernel(entry("asin", kAsin)) && registerKernel(entry("acos", kAcos)) &&
    registerKernel(entry("atan", kAtan)) && registerKernel(entry("atan2", kAtan2)) &&
    registerKernel(entry("add", kAdd)) && registerKernel(entry("multiply", kMultiply)) &&
    registerKernel(entry("fma", kFma));

}  // namespace
}  // namespace gnomon::precision
