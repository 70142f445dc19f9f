#include "harness/hygiene/resources.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <fmt/format.h>

namespace gnomon {
namespace {

// Wide enough for a whole group of 1,024 threads to overrun by one 64-byte element each.
constexpr std::size_t kGuardBytes = 64 * 1024;

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

std::size_t bytesOf(const ImageDescription& image) {
  std::size_t bytes = 0;
  for (unsigned mip = 0; mip < image.mips; ++mip) bytes += image.layers * mipBytes(image, mip);
  return bytes;
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
  return fmt::format("{}({}, {})", name, element % width, element / width);
}

Resources::Resources(const Subject& subject, const Stimulus& s, Target target)
    : gpu(subject.gpu()), record(subject.record()), stimulus(s) {
  for (const ImageSpec& i : record.images)
    if (i.kind() == BindingSlot::Kind::kSampler || i.kind() == BindingSlot::Kind::kCombined)
      samplers.emplace(i.name, gpu.makeSampler(i.sampler));
  for (const InputBytes& i : s.inputs) addInput(i);
  for (const OutputCount& o : s.outputs) addOutput(o);
  for (const InputImage& i : s.inputImages) addInputImage(i);
  for (const OutputImage& o : s.outputImages) addOutputImage(o, target);
  bind();
  dispatch.push.assign(s.push.begin(), s.push.end());
  dispatch.groups = record.grid(s.extent);
}

void Resources::addInput(const InputBytes& input) {
  in.push_back(
      {&record.buffer(input.buffer), input.bytes, gpu.allocate(input.bytes.size() + kGuardBytes)});
  traffic += input.bytes.size();
}

void Resources::addOutput(const OutputCount& output) {
  const std::size_t align = std::max<std::size_t>(gpu.offsetAlignment(), kWord);
  Output o{.name = output.buffer,
           .layout = record.buffer(output.buffer).element,
           .elements = output.elements,
           .before = (kGuardBytes + align - 1) / align * align};
  o.buffer = gpu.allocate(o.before + o.dataBytes() + kGuardBytes);
  traffic += o.dataBytes();
  out.push_back(std::move(o));
}

void Resources::addInputImage(const InputImage& input) {
  const std::size_t wanted = bytesOf(input.description);
  if (input.texels.size() != wanted)
    throw std::logic_error(fmt::format("'{}' has {} bytes of texels, its description {}",
                                       input.image, input.texels.size(), wanted));
  inImages.push_back(gpu.allocateImage(input.description));
  traffic += wanted;
}

void Resources::addOutputImage(const OutputImage& output, Target target) {
  const ImageSpec& spec = record.image(output.image);
  const bool narrow = target == Target::kContract && isNarrow(spec.format);
  const ImageDescription description{
      .format = target == Target::kContract ? spec.format : widened(spec.format),
      .width = output.width,
      .height = output.height,
      .layers = output.layers};
  Output o{.name = narrow ? narrowName(spec) : spec.name,
           .layout = pixelLayout(spec.format),
           .elements = std::size_t{output.width} * output.height * output.layers,
           .width = output.width};
  o.image = gpu.allocateImage(description);
  traffic += bytesOf(description);
  out.push_back(std::move(o));
}

// Buffers and images move while the lists grow, so the dispatch learns their addresses last.
void Resources::bind() {
  for (const Input& i : in)
    dispatch.buffers.push_back({.slot = {.set = 0, .binding = i.spec->binding},
                                .buffer = &i.buffer,
                                .range = i.bytes.size() + kGuardBytes});
  for (const Output& o : out) {
    if (o.isImage()) continue;
    dispatch.buffers.push_back({.slot = {.set = 0, .binding = record.buffer(o.name).binding},
                                .buffer = &o.buffer,
                                .offset = o.before,
                                .range = o.dataBytes() + kGuardBytes});
  }
  const auto bindImage = [&](const ImageSpec& spec, const GpuImage* image) {
    const auto sampler = samplers.find(spec.name);
    dispatch.images.push_back({.slot = {.set = 0, .binding = spec.binding, .kind = spec.kind()},
                               .image = image,
                               .sampler = sampler == samplers.end() ? nullptr : &sampler->second,
                               .asArray = spec.type.ends_with("2DArray")});
  };
  for (std::size_t i = 0; i < inImages.size(); ++i)
    bindImage(record.image(stimulus.inputImages[i].image), &inImages[i]);
  std::size_t next = 0;
  for (const Output& o : out)
    if (o.isImage()) bindImage(record.image(stimulus.outputImages[next++].image), &o.image);
  for (const ImageSpec& spec : record.images)
    if (spec.kind() == BindingSlot::Kind::kSampler) bindImage(spec, nullptr);
}

void Resources::upload(std::uint32_t guard) {
  for (const Input& i : in) {
    gpu.fill(i.buffer, guard);
    gpu.upload(i.buffer, 0, i.bytes);
  }
  for (std::size_t i = 0; i < inImages.size(); ++i) {
    const InputImage& given = stimulus.inputImages[i];
    std::size_t at = 0;
    for (unsigned layer = 0; layer < given.description.layers; ++layer)
      for (unsigned mip = 0; mip < given.description.mips; ++mip) {
        const std::size_t bytes = mipBytes(given.description, mip);
        gpu.uploadImage(inImages[i], layer, mip, given.texels.subspan(at, bytes));
        at += bytes;
      }
  }
}

std::vector<Bytes> Resources::run(const GpuProgram& program, std::uint32_t poison) {
  for (const Output& o : out)
    if (o.isImage())
      gpu.fillImage(o.image, repeated(poison));
    else
      gpu.fill(o.buffer, poison);
  time(program);
  std::vector<Bytes> all;
  for (const Output& o : out) all.push_back(download(o));
  return all;
}

double Resources::time(const GpuProgram& program) {
  dispatch.program = &program;
  return gpu.run({&dispatch, 1}, stimulus.limit).front() * 1e-9;
}

Bytes Resources::download(const Input& input) const {
  Bytes now(input.buffer.size());
  gpu.download(input.buffer, 0, now);
  return now;
}

Bytes Resources::download(const Output& output) const {
  if (!output.isImage()) {
    Bytes whole(output.buffer.size());
    gpu.download(output.buffer, 0, whole);
    return whole;
  }
  const ImageDescription& image = output.image.description();
  const std::size_t layerBytes = mipBytes(image, 0);
  Bytes texels(layerBytes * image.layers);
  for (unsigned layer = 0; layer < image.layers; ++layer)
    gpu.downloadImage(output.image, layer, 0,
                      std::span(texels).subspan(layer * layerBytes, layerBytes));
  return widen(std::move(texels), image.format);
}

}  // namespace gnomon
