// The public face: checks what callers may get wrong, and hands on.
#include "harness/vulkan/gpu.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/vulkan/internal.h"

namespace gnomon {

using vulkan::Device;

struct GpuBuffer::Impl {
  std::shared_ptr<Device> device;  // declared first: the buffer goes before its device
  vulkan::Buffer buffer;
  std::size_t size = 0;
};

GpuBuffer::GpuBuffer() = default;
GpuBuffer::~GpuBuffer() = default;
GpuBuffer::GpuBuffer(GpuBuffer&&) noexcept = default;
GpuBuffer& GpuBuffer::operator=(GpuBuffer&&) noexcept = default;
std::size_t GpuBuffer::size() const { return impl ? impl->size : 0; }

struct GpuProgram::Impl {
  vulkan::Program program;
};

GpuProgram::GpuProgram() = default;
GpuProgram::~GpuProgram() = default;
GpuProgram::GpuProgram(GpuProgram&&) noexcept = default;
GpuProgram& GpuProgram::operator=(GpuProgram&&) noexcept = default;

struct Gpu::Impl {
  std::shared_ptr<Device> device;
  vulkan::Runner runner;

  explicit Impl(std::shared_ptr<Device> opened) : device(opened), runner(opened) {}
};

namespace {

std::shared_ptr<Device> open(const Gpu::Options& options) {
  auto instance = std::make_unique<vulkan::Instance>(options.validation);
  const std::vector<vulkan::Adapter> adapters = vulkan::adaptersOf(*instance);
  std::vector<GpuInfo> gpus;
  for (const vulkan::Adapter& adapter : adapters) gpus.push_back(adapter.info);
  const std::size_t chosen = chooseGpu(gpus, options.device);
  try {
    return std::make_shared<Device>(std::move(instance), adapters[chosen], options.staged);
  } catch (const GpuError& error) {
    throw DeviceError(fmt::format("{}: {}", gpus[chosen].name, error.what()));
  }
}

void requireInside(const GpuBuffer& buffer, std::size_t offset, std::size_t bytes) {
  if (offset > buffer.size() || bytes > buffer.size() - offset)
    throw std::out_of_range(fmt::format("bytes {} to {} of a GPU buffer of {} bytes", offset,
                                        offset + bytes, buffer.size()));
}

std::string textOf(const BindingSlot& slot) {
  return fmt::format("{} buffer of set {}, binding {}", slot.uniform ? "uniform" : "storage",
                     slot.set, slot.binding);
}

/// What is left of a buffer where no range is given. Vulkan has no empty range: one byte stands
/// for it, which holds no element of any type, so length() in the kernel is 0.
VkDeviceSize rangeOf(const BoundBuffer& bound) {
  if (bound.range == kWholeBuffer)
    return std::max<std::size_t>(bound.buffer->size() - bound.offset, 1);
  return std::max<std::size_t>(bound.range, 1);
}

void requireLimits(const vulkan::Adapter& adapter, const BoundBuffer& bound) {
  const std::size_t most = bound.slot.uniform ? adapter.limits.maxUniformBufferRange
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

/// A slot without a buffer, or a push range without values, is undefined behaviour in the driver.
void requireComplete(const vulkan::Program& program, const Dispatch& dispatch) {
  if (dispatch.push.size() != program.pushBytes)
    throw std::logic_error(fmt::format("{} bytes of push constants for a program of {}",
                                       dispatch.push.size(), program.pushBytes));
  for (const BindingSlot& slot : program.slots)
    if (std::ranges::count(dispatch.buffers, slot, &BoundBuffer::slot) != 1)
      throw std::logic_error(fmt::format("the {} must be bound once", textOf(slot)));
  if (dispatch.buffers.size() != program.slots.size())
    throw std::logic_error("a buffer is bound where the program has no slot");
}

}  // namespace

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

GpuProgram Gpu::build(const ProgramDescription& description) {
  GpuProgram program;
  program.impl = std::make_unique<GpuProgram::Impl>();
  program.impl->program = vulkan::makeProgram(impl->device, description);
  return program;
}

std::vector<double> Gpu::run(std::span<const Dispatch> dispatches,
                             std::chrono::milliseconds limit) {
  std::vector<vulkan::Command> commands;
  for (const Dispatch& dispatch : dispatches) {
    vulkan::Command& command = commands.emplace_back();
    command.program = &dispatch.program->impl->program;
    command.dispatch = &dispatch;
    requireComplete(*command.program, dispatch);
    requireLimits(impl->device->adapter, dispatch.groups);
    for (const BoundBuffer& bound : dispatch.buffers) {
      requireLimits(impl->device->adapter, bound);
      command.buffers.push_back(
          {bound.slot, {bound.buffer->impl->buffer.buffer.get(), bound.offset, rangeOf(bound)}});
    }
  }
  if (commands.empty()) return {};
  return impl->runner.run(commands, limit);
}

bool Gpu::alive() const { return !impl->device->owner.hung && !impl->device->owner.lost; }

std::vector<std::string> Gpu::takeMessages() { return impl->device->owner.instance->log.take(); }

}  // namespace gnomon
