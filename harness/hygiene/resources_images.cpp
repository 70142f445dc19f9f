// The images of a stimulus: in the record's format or wider, up to the device and down again.
#include "harness/hygiene/resources.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "harness/hygiene/levels.h"

namespace gnomon {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

PixelFormat widened(PixelFormat format) {
  switch (channels(format)) {
    case 1:
      return format == PixelFormat::kR32ui ? format : PixelFormat::kR32f;
    case 2:
      return PixelFormat::kRg32f;
    default:
      return PixelFormat::kRgba32f;
  }
}

/// Codes of a narrow channel as the floats that a shader reads of them.
template <class Code>
Bytes decoded(const Bytes& texels, Storage storage) {
  std::vector<float> floats(texels.size() / sizeof(Code));
  for (std::size_t i = 0; i < floats.size(); ++i) {
    Code code;
    std::memcpy(&code, texels.data() + i * sizeof code, sizeof code);
    floats[i] = static_cast<float>(decode(code, storage));
  }
  Bytes bytes(floats.size() * kWord);
  if (!bytes.empty()) std::memcpy(bytes.data(), floats.data(), bytes.size());
  return bytes;
}

/// Texels of any format as 32-bit scalars.
Bytes widen(Bytes texels, PixelFormat format) {
  switch (storageOf(format)) {
    case Storage::unorm8:
      return decoded<std::uint8_t>(texels, Storage::unorm8);
    case Storage::half:
      return decoded<std::uint16_t>(texels, Storage::half);
    default:
      return texels;
  }
}

std::array<std::byte, 16> repeated(std::uint32_t pattern) {
  std::array<std::byte, 16> bytes{};
  for (std::size_t i = 0; i < bytes.size(); i += kWord)
    std::memcpy(bytes.data() + i, &pattern, kWord);
  return bytes;
}

/// Calls f(rows, height) for every level of every layer.
template <class Texels, class F>
void forEachLevel(const ImageDescription& image, Texels texels, const F& f) {
  std::size_t at = 0;
  for (unsigned layer = 0; layer < image.layers; ++layer)
    for (unsigned mip = 0; mip < image.mips; ++mip) {
      f(texels.subspan(at, mipBytes(image, mip)), mipSize(image, mip)[1]);
      at += mipBytes(image, mip);
    }
}

}  // namespace

Storage storageOf(PixelFormat format) {
  switch (bytesPerPixel(format) / channels(format)) {
    case 1:
      return Storage::unorm8;
    case 2:
      return Storage::half;
    default:
      return Storage::float32;
  }
}

bool isNarrow(PixelFormat format) { return storageOf(format) != Storage::float32; }

std::string narrowName(const ImageSpec& image) {
  return fmt::format("{} as {}", image.name, nameOf(image.format));
}

std::uint32_t Output::poisoned(std::uint32_t pattern, std::size_t word) const {
  if (!isImage()) return pattern;
  const PixelFormat format = image.description().format;
  const auto bytes = repeated(pattern);
  const Bytes pixel = widen({bytes.begin(), bytes.begin() + bytesPerPixel(format)}, format);
  std::uint32_t value = 0;
  std::memcpy(&value, pixel.data() + word % channels(format) * kWord, kWord);
  return value;
}

std::string Output::place(std::size_t element) const {
  if (!isImage()) return fmt::format("{}[{}]", name, element);
  const ImageDescription& pixels = image.description();
  const std::size_t x = element % width, row = element / width;
  if (pixels.mips > 1)
    return placeOn(name, pixelAt({pixels.width, pixels.height, pixels.mips}, element));
  if (pixels.layers == 1) return fmt::format("{}({}, {})", name, x, row);
  return fmt::format("{}({}, {}, {})", name, x, row % pixels.height, row / pixels.height);
}

void Resources::addInputImage(const InputImage& input) {
  const std::size_t wanted = imageBytes(input.description);
  if (input.texels.size() != wanted)
    throw std::logic_error(fmt::format("'{}' has {} bytes of texels, its description {}",
                                       input.image, input.texels.size(), wanted));
  // Once: a module can only read it.
  const Bytes theirs = conventions.empty() ? Bytes{} : inConvention(input);
  inImages.push_back(
      gpu.allocateImage(input.description, conventions.empty() ? input.texels : theirs));
  traffic += wanted;
}

Bytes Resources::inConvention(const InputImage& input) const {
  Bytes texels(input.texels.begin(), input.texels.end());
  const std::string& meaning = record.image(input.image).meaning;
  forEachLevel(input.description, std::span(texels), [&](auto rows, unsigned height) {
    convertRows(rows, input.description.format, height, meaning, conventions, Way::kIn);
  });
  return texels;
}

void Resources::addOutputImage(const OutputImage& output, Target target) {
  const ImageSpec& spec = record.image(output.image);
  if (output.layers > 1 && output.mips > 1)
    throw std::logic_error(
        fmt::format("'{}' has {} layers and {} mip levels; an output has one or "
                    "the other",
                    output.image, output.layers, output.mips));
  const bool narrow = target == Target::kContract && isNarrow(spec.format);
  const bool fromBelow = conventions.contains("y") && conventions.at("y") == "up";
  const bool single = output.layers == 1 && output.mips == 1;
  const unsigned beyond = single && !fromBelow ? output.beyond : 0;
  const ImageDescription description{
      .format = target == Target::kContract ? spec.format : widened(spec.format),
      .width = output.width + beyond,
      .height = output.height + beyond,
      .layers = output.layers,
      .mips = output.mips};
  Output o{.name = narrow ? narrowName(spec) : spec.name,
           .layout = pixelLayout(spec.format),
           .elements = output.layers * pixelsOf({output.width, output.height, output.mips}),
           .width = output.width,
           .meaning = spec.meaning,
           .given = {}};
  o.given.assign(o.layout.size / kWord, true);
  o.image = gpu.allocateImage(description);
  traffic += imageBytes(description);
  out.push_back(std::move(o));
}

void Resources::bindImages() {
  std::map<std::string, const GpuImage*> images;
  for (std::size_t i = 0; i < inImages.size(); ++i)
    images[stimulus.inputImages[i].image] = &inImages[i];
  std::size_t next = 0;
  for (const Output& o : out)
    if (o.isImage()) images[stimulus.outputImages[next++].image] = &o.image;
  for (const ModuleImage& i : interface.images) {
    const bool samples =
        i.slot.kind == BindingSlot::Kind::kSampler || i.slot.kind == BindingSlot::Kind::kCombined;
    const auto sampler = samplers.find(i.name);
    const bool isSampler = i.slot.kind == BindingSlot::Kind::kSampler;
    dispatch.images.push_back({.slot = i.slot,
                               .image = isSampler ? nullptr : images.at(i.name),
                               .sampler = !samples                    ? nullptr
                                          : sampler == samplers.end() ? &ownSampler
                                                                      : &sampler->second,
                               .asArray = i.asArray});
  }
}

void Resources::poisonImages(std::uint32_t poison) {
  for (const Output& o : out)
    if (o.isImage()) gpu.fillImage(o.image, repeated(poison));
}

Bytes Resources::cropped(const Output& output, Bytes texels, std::uint32_t poison,
                         std::vector<std::string>& strays) const {
  const ImageDescription& image = output.image.description();
  if (texels.size() == output.dataBytes()) return texels;
  const std::size_t pixel = output.layout.size, height = output.elements / output.width;
  Bytes inside;
  bool touched = false;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const auto at = std::span(texels).subspan((y * image.width + x) * pixel, pixel);
      if (x < output.width && y < height) {
        inside.insert(inside.end(), at.begin(), at.end());
        continue;
      }
      for (std::size_t w = 0; w < pixel / kWord && !touched; ++w) {
        std::uint32_t word = 0;
        std::memcpy(&word, at.data() + w * kWord, kWord);
        touched = word != output.poisoned(poison, w);
        if (touched)
          strays.push_back(fmt::format("wrote beyond the {}x{} pixels of '{}', at ({}, {})",
                                       output.width, height, output.name, x, y));
      }
    }
  return inside;
}

Bytes Resources::downloadImage(const Output& output) const {
  const ImageDescription& image = output.image.description();
  Bytes texels(imageBytes(image));
  gpu.downloadImage(output.image, texels);
  if (!conventions.empty())
    forEachLevel(image, std::span(texels), [&](auto rows, unsigned height) {
      convertRows(rows, image.format, height, output.meaning, conventions, Way::kOut);
    });
  return widen(std::move(texels), image.format);
}

}  // namespace gnomon
