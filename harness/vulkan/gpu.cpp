// The public face: checks what callers may get wrong, and hands on.
#include "harness/vulkan/gpu.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/vulkan/impl.h"

namespace gnomon {

using vulkan::Device;

GpuBuffer::GpuBuffer() = default;
GpuBuffer::~GpuBuffer() = default;
GpuBuffer::GpuBuffer(GpuBuffer&&) noexcept = default;
GpuBuffer& GpuBuffer::operator=(GpuBuffer&&) noexcept = default;
std::size_t GpuBuffer::size() const { return impl ? impl->size : 0; }

GpuImage::GpuImage() = default;
GpuImage::~GpuImage() = default;
GpuImage::GpuImage(GpuImage&&) noexcept = default;
GpuImage& GpuImage::operator=(GpuImage&&) noexcept = default;
const ImageDescription& GpuImage::description() const {
  static const ImageDescription none{.width = 0, .height = 0, .layers = 0, .mips = 0};
  return impl ? impl->image.description : none;
}

GpuSampler::GpuSampler() = default;
GpuSampler::~GpuSampler() = default;
GpuSampler::GpuSampler(GpuSampler&&) noexcept = default;
GpuSampler& GpuSampler::operator=(GpuSampler&&) noexcept = default;

GpuProgram::GpuProgram() = default;
GpuProgram::~GpuProgram() = default;
GpuProgram::GpuProgram(GpuProgram&&) noexcept = default;
GpuProgram& GpuProgram::operator=(GpuProgram&&) noexcept = default;

GpuDrawProgram::GpuDrawProgram() = default;
GpuDrawProgram::~GpuDrawProgram() = default;
GpuDrawProgram::GpuDrawProgram(GpuDrawProgram&&) noexcept = default;
GpuDrawProgram& GpuDrawProgram::operator=(GpuDrawProgram&&) noexcept = default;

namespace {

std::shared_ptr<Device> open(const Gpu::Options& options) {
  auto instance = std::make_unique<vulkan::Instance>(options.validation);
  const std::vector<vulkan::Adapter> adapters = vulkan::adaptersOf(*instance);
  std::vector<GpuInfo> gpus;
  for (const vulkan::Adapter& adapter : adapters) gpus.push_back(adapter.info);
  vulkan::Adapter adapter = adapters[chooseGpu(gpus, options.device)];
  vulkan::drop(options.without, adapter.features);
  for (const std::string& feature : options.without) adapter.info.features.at(feature) = false;
  try {
    return std::make_shared<Device>(std::move(instance), adapter, options.staged);
  } catch (const GpuError& error) {
    throw DeviceError(fmt::format("{}: {}", adapter.info.name, error.what()));
  }
}

void requireBytes(const ImageDescription& image, unsigned layer, unsigned mip, std::size_t bytes) {
  requireInside(image, layer, mip);
  if (bytes != mipBytes(image, mip))
    throw std::logic_error(fmt::format("{} bytes for mip {} of a GPU image, which has {}", bytes,
                                       mip, mipBytes(image, mip)));
}

void requireAllBytes(const ImageDescription& image, std::size_t bytes) {
  if (bytes != imageBytes(image))
    throw std::logic_error(
        fmt::format("{} bytes for a GPU image, which has {}", bytes, imageBytes(image)));
}

/// What no device could make, and no driver need refuse.
void requireSound(const ImageDescription& image) {
  if (image.width == 0 || image.height == 0 || image.layers == 0 || image.mips == 0)
    throw std::logic_error(fmt::format("an image of {} x {} pixels, {} layers, {} mips",
                                       image.width, image.height, image.layers, image.mips));
  if (image.mips > fullMipCount(image.width, image.height))
    throw std::logic_error(fmt::format("{} mips of {} x {} pixels, which have {}", image.mips,
                                       image.width, image.height,
                                       fullMipCount(image.width, image.height)));
  if (image.cube && (image.width != image.height || image.layers % 6 != 0))
    throw std::logic_error(fmt::format("a cube of {} faces of {} x {} pixels", image.layers,
                                       image.width, image.height));
}

std::string textOf(const BindingSlot& slot) {
  constexpr const char* kKinds[] = {"storage buffer", "uniform buffer", "sampled image",
                                    "storage image",  "sampler",        "combined image sampler"};
  return fmt::format("{} of set {}, binding {}", kKinds[static_cast<std::size_t>(slot.kind)],
                     slot.set, slot.binding);
}

bool takesBuffer(const BindingSlot& slot) {
  return slot.kind == BindingSlot::Kind::kStorageBuffer ||
         slot.kind == BindingSlot::Kind::kUniformBuffer;
}

bool takesImage(const BindingSlot& slot) {
  return !takesBuffer(slot) && slot.kind != BindingSlot::Kind::kSampler;
}

bool takesSampler(const BindingSlot& slot) {
  return slot.kind == BindingSlot::Kind::kSampler || slot.kind == BindingSlot::Kind::kCombined;
}

/// What is left of a buffer where no range is given. Vulkan has no empty range: one byte stands
/// for it, which holds no element of any type, so length() in the kernel is 0.
VkDeviceSize rangeOf(const BoundBuffer& bound) {
  if (bound.range == kWholeBuffer)
    return std::max<std::size_t>(bound.buffer->size() - bound.offset, 1);
  return std::max<std::size_t>(bound.range, 1);
}

void requireLimits(const vulkan::Adapter& adapter, const BoundBuffer& bound) {
  const std::size_t most = bound.slot.kind == BindingSlot::Kind::kUniformBuffer
                               ? adapter.limits.maxUniformBufferRange
                               : adapter.limits.maxStorageBufferRange;
  if (rangeOf(bound) > most)
    throw Unsupported(fmt::format("{} bytes in the {}; {} allows {}", rangeOf(bound),
                                  textOf(bound.slot), adapter.info.name, most));
}

void requireLimits(const vulkan::Adapter& adapter, const std::array<std::uint32_t, 3>& groups) {
  for (std::size_t i = 0; i < groups.size(); ++i)
    if (groups[i] > adapter.info.maxGroupCount[i])
      throw Unsupported(fmt::format("{} groups in {}; {} allows {}", groups[i], "xyz"[i],
                                    adapter.info.name, adapter.info.maxGroupCount[i]));
}

/// An image and a sampler that a shader joins by itself (kSampledImage and kSampler) are the
/// validation layer's business: nothing here tells which goes with which.
void requireUse(const vulkan::Adapter& adapter, const vulkan::Image& image, BindingSlot::Kind kind,
                const SamplerDescription& sampler) {
  const auto require = [&](VkFormatFeatureFlags feature, const char* use) {
    if ((image.features & feature) == 0)
      throw Unsupported(fmt::format("{} of {} is not supported by {}", use,
                                    nameOf(image.description.format), adapter.info.name));
  };
  if (kind == BindingSlot::Kind::kStorageImage)
    require(VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT, "storage image");
  if (kind != BindingSlot::Kind::kCombined) return;
  if (sampler.linear || sampler.linearMips)
    require(VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT, "linear filtering");
  if (sampler.reduction != SamplerDescription::Reduction::kAverage)
    require(VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_MINMAX_BIT, "min/max filtering");
}

/// A slot without a buffer or image, or a push range without values, is undefined behaviour in the
/// driver.
void requireComplete(const vulkan::Program& program, std::span<const BoundBuffer> buffers,
                     std::span<const BoundImage> images, std::size_t pushBytes) {
  if (pushBytes != program.pushBytes)
    throw std::logic_error(fmt::format("{} bytes of push constants for a program of {}", pushBytes,
                                       program.pushBytes));
  for (const BindingSlot& slot : program.slots)
    if ((takesBuffer(slot) ? std::ranges::count(buffers, slot, &BoundBuffer::slot)
                           : std::ranges::count(images, slot, &BoundImage::slot)) != 1)
      throw std::logic_error(fmt::format("the {} must be bound once", textOf(slot)));
  if (buffers.size() + images.size() != program.slots.size())
    throw std::logic_error("a buffer or image is bound where the program has no slot");
  for (const BoundImage& bound : images)
    if (takesImage(bound.slot) != (bound.image != nullptr) ||
        takesSampler(bound.slot) != (bound.sampler != nullptr))
      throw std::logic_error(fmt::format("the {} takes {} and {}", textOf(bound.slot),
                                         takesImage(bound.slot) ? "an image" : "no image",
                                         takesSampler(bound.slot) ? "a sampler" : "no sampler"));
}

/// The mip levels that a kernel sees in the k-th descriptor; -1: all. A storage image has only one.
int mipOf(const BoundImage& bound, unsigned k) {
  if (bound.slot.count > 1)
    return static_cast<int>(std::min(k, bound.image->description().mips - 1));
  if (bound.mip >= 0)
    requireInside(bound.image->description(), 0, static_cast<unsigned>(bound.mip));
  return bound.mip < 0 && bound.slot.kind == BindingSlot::Kind::kStorageImage ? 0 : bound.mip;
}

}  // namespace

void requireInside(const GpuBuffer& buffer, std::size_t offset, std::size_t bytes) {
  if (offset > buffer.size() || bytes > buffer.size() - offset)
    throw std::out_of_range(fmt::format("bytes {} to {} of a GPU buffer of {} bytes", offset,
                                        offset + bytes, buffer.size()));
}

void requireInside(const ImageDescription& image, unsigned layer, unsigned mip) {
  if (layer >= image.layers || mip >= image.mips)
    throw std::out_of_range(fmt::format("layer {}, mip {} of a GPU image of {} and {}", layer, mip,
                                        image.layers, image.mips));
}

vulkan::Command Gpu::Impl::bound(Device& device, const vulkan::Program& program,
                                 std::span<const BoundBuffer> buffers,
                                 std::span<const BoundImage> images,
                                 std::span<const std::byte> push) {
  requireComplete(program, buffers, images, push.size());
  vulkan::Command command{.program = &program, .buffers = {}, .images = {}, .push = push};
  for (const BoundBuffer& bound : buffers) {
    requireLimits(device.adapter, bound);
    command.buffers.push_back(
        {bound.slot, {handleOf(*bound.buffer), bound.offset, rangeOf(bound)}});
  }
  for (const BoundImage& bound : images) {
    VkDescriptorImageInfo view{};
    view.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
    if (bound.sampler != nullptr) view.sampler = bound.sampler->impl->sampler.get();
    vulkan::BoundView& views =
        command.images.emplace_back(vulkan::BoundView{bound.slot, {bound.slot.count, view}});
    if (bound.image == nullptr) continue;
    vulkan::Image& image = bound.image->impl->image;
    requireUse(device.adapter, image, bound.slot.kind,
               bound.sampler == nullptr ? SamplerDescription{} : bound.sampler->impl->description);
    for (unsigned k = 0; k < bound.slot.count; ++k)
      views.images[k].imageView = device.viewOf(image, {mipOf(bound, k), bound.asArray});
  }
  return command;
}

vulkan::Command Gpu::Impl::resolve(Device& device, const Dispatch& dispatch) {
  requireLimits(device.adapter, dispatch.groups);
  vulkan::Command command = bound(device, dispatch.program->impl->program, dispatch.buffers,
                                  dispatch.images, dispatch.push);
  command.groups = dispatch.groups;
  return command;
}

std::vector<vulkan::Command> Gpu::Impl::resolve(Device& device, std::span<const Work> work) {
  std::vector<vulkan::Command> commands;
  for (const Work& step : work)
    commands.push_back(std::visit([&](const auto* one) { return resolve(device, *one); }, step));
  return commands;
}

Gpu::Gpu(const Options& options) : impl(std::make_unique<Impl>(open(options))) {}
Gpu::~Gpu() = default;

const GpuInfo& Gpu::info() const { return impl->device->adapter.info; }

std::size_t Gpu::offsetAlignment() const {
  const VkPhysicalDeviceLimits& limits = impl->device->adapter.limits;
  return std::max(limits.minStorageBufferOffsetAlignment, limits.minUniformBufferOffsetAlignment);
}

GpuBuffer Gpu::allocate(std::size_t bytes) {
  GpuBuffer buffer;
  buffer.impl = std::make_unique<GpuBuffer::Impl>();
  buffer.impl->device = impl->device;
  buffer.impl->buffer = impl->device->makeBuffer(bytes, Device::Memory::device);
  buffer.impl->size = bytes;
  return buffer;
}

void Gpu::upload(const GpuBuffer& to, std::size_t offset, std::span<const std::byte> data) {
  requireInside(to, offset, data.size());
  if (!data.empty()) impl->device->upload(to.impl->buffer, offset, data);
}

void Gpu::download(const GpuBuffer& from, std::size_t offset, std::span<std::byte> data) {
  requireInside(from, offset, data.size());
  if (!data.empty()) impl->device->download(from.impl->buffer, offset, data);
}

void Gpu::fill(const GpuBuffer& buffer, std::uint32_t pattern) {
  if (buffer.size() > 0) impl->device->fill(buffer.impl->buffer, pattern);
}

GpuImage Gpu::Impl::makeImage(const ImageDescription& description,
                              std::span<const std::byte> texels) const {
  GpuImage image;
  image.impl = std::make_unique<GpuImage::Impl>();
  image.impl->device = device;
  image.impl->image = device->makeImage(description, texels);
  return image;
}

GpuImage Gpu::allocateImage(const ImageDescription& description) {
  requireSound(description);
  return impl->makeImage(description);
}

GpuImage Gpu::allocateImage(const ImageDescription& description,
                            std::span<const std::byte> texels) {
  requireSound(description);
  requireAllBytes(description, texels.size());
  return impl->makeImage(description, texels);
}

void Gpu::uploadImage(const GpuImage& to, unsigned layer, unsigned mip,
                      std::span<const std::byte> tightRows) {
  requireBytes(to.description(), layer, mip, tightRows.size());
  impl->device->upload(to.impl->image, layer, mip, tightRows);
}

void Gpu::downloadImage(const GpuImage& from, unsigned layer, unsigned mip,
                        std::span<std::byte> tightRows) {
  requireBytes(from.description(), layer, mip, tightRows.size());
  impl->device->download(from.impl->image, layer, mip, tightRows);
}

void Gpu::downloadImage(const GpuImage& from, std::span<std::byte> texels) {
  requireAllBytes(from.description(), texels.size());
  impl->device->download(from.impl->image, texels);
}

void Gpu::fillImage(const GpuImage& image, const std::array<std::byte, 16>& pixelPattern) {
  impl->device->fill(image.impl->image, pixelPattern);
}

GpuSampler Gpu::makeSampler(const SamplerDescription& description) {
  if (description.compare && description.reduction != SamplerDescription::Reduction::kAverage)
    throw std::logic_error("a sampler compares or takes the smallest or largest, not both");
  GpuSampler sampler;
  sampler.impl = std::make_unique<GpuSampler::Impl>();
  sampler.impl->device = impl->device;
  sampler.impl->sampler = impl->device->makeSampler(description);
  sampler.impl->description = description;
  return sampler;
}

GpuProgram Gpu::build(const ProgramDescription& description) {
  GpuProgram program;
  program.impl = std::make_unique<GpuProgram::Impl>();
  program.impl->program = vulkan::makeProgram(impl->device, description);
  return program;
}

GpuDrawProgram Gpu::build(const DrawProgramDescription& description) {
  GpuDrawProgram program;
  program.impl = std::make_unique<GpuDrawProgram::Impl>();
  program.impl->drawn = vulkan::makeDrawProgram(impl->device, description);
  return program;
}

std::vector<double> Gpu::run(std::span<const Dispatch> dispatches,
                             std::chrono::milliseconds limit) {
  std::vector<Work> work;
  for (const Dispatch& dispatch : dispatches) work.push_back(&dispatch);
  return run(work, limit);
}

std::vector<double> Gpu::run(std::span<const Work> work, std::chrono::milliseconds limit) {
  if (work.empty()) return {};
  return impl->runner.run(Impl::resolve(*impl->device, work), limit);
}

bool Gpu::alive() const { return !impl->device->owner.hung && !impl->device->owner.lost; }

std::vector<std::string> Gpu::takeMessages() { return impl->device->owner.instance->log.take(); }

}  // namespace gnomon
