#include "harness/vulkan/readback.h"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/vulkan/impl.h"

namespace gnomon {

struct GpuReadback::Impl {
  struct Slot {
    vulkan::Submission submission;
    vulkan::Runner runner;
    vulkan::Buffer copied;
    std::size_t bytes = 0;  ///< of the frame's copies
    std::size_t steps = 0;
  };

  std::shared_ptr<vulkan::Device> device;  // declared first: slots go before their device
  std::size_t capacity = 0;                ///< bytes of a slot
  std::vector<Slot> slots;                 ///< frame n is in slot n modulo their number
  std::uint64_t submitted = 0;             ///< frames
  std::uint64_t found = 0;                 ///< frames that poll() has seen done

  Impl(std::shared_ptr<vulkan::Device> opened, unsigned count, std::size_t bytes);
  ~Impl();

  Slot& slotOf(std::uint64_t frame) { return slots[frame % slots.size()]; }
  Frame read(std::uint64_t frame);
};

GpuReadback::Impl::Impl(std::shared_ptr<vulkan::Device> opened, unsigned count, std::size_t bytes)
    : device(std::move(opened)), capacity(bytes) {
  if (count == 0) throw std::logic_error("a readback without slots");
  for (unsigned i = 0; i < count; ++i)
    slots.push_back({vulkan::Submission(device->owner, device->adapter.queueFamily),
                     vulkan::Runner(device),
                     device->makeBuffer(bytes, vulkan::Device::Memory::staging)});
}

/// Objects of a device that is hung are leaked, so nobody waits for it.
GpuReadback::Impl::~Impl() {
  for (; found < submitted; ++found) {
    --device->inFlight;
    if (device->owner.hung || device->owner.lost) continue;
    try {
      slotOf(found).submission.wait(vulkan::kTransferLimit);
    } catch (const GpuError&) {  // noted in the device, which refuses the next call
    }
  }
}

GpuReadback::Frame GpuReadback::Impl::read(std::uint64_t frame) {
  Slot& slot = slotOf(frame);
  return {frame,
          {slot.copied.mapped, slot.copied.mapped + slot.bytes},
          slot.runner.readTimes(slot.steps)};
}

GpuReadback::GpuReadback(Gpu& gpu, unsigned slots, std::size_t bytes)
    : impl(std::make_unique<Impl>(gpu.impl->device, slots, bytes)) {}
GpuReadback::~GpuReadback() = default;
GpuReadback::GpuReadback(GpuReadback&&) noexcept = default;
GpuReadback& GpuReadback::operator=(GpuReadback&&) noexcept = default;

bool GpuReadback::submit(std::span<const Work> work, std::span<const GpuCopy> copies) {
  std::size_t bytes = 0;
  for (const GpuCopy& copy : copies) {
    requireInside(*copy.from, copy.offset, copy.bytes);
    bytes += copy.bytes;
  }
  if (bytes > impl->capacity)
    throw std::logic_error(
        fmt::format("copies of {} bytes for a readback of {}", bytes, impl->capacity));
  impl->device->requireAlive();
  const std::vector<vulkan::Command> commands = Gpu::Impl::resolve(*impl->device, work);
  if (impl->submitted - impl->found == impl->slots.size()) return false;

  Impl::Slot& slot = impl->slotOf(impl->submitted);
  slot.bytes = bytes;
  slot.steps = commands.size();
  const VkCommandBuffer recorded = slot.submission.begin();
  slot.runner.record(recorded, commands);
  VkBufferCopy region{};
  for (const GpuCopy& copy : copies) {
    region = {copy.offset, region.dstOffset + region.size, copy.bytes};
    if (copy.bytes > 0)
      vkCmdCopyBuffer(recorded, Gpu::Impl::handleOf(*copy.from), slot.copied.buffer.get(), 1,
                      &region);
  }
  slot.submission.submit();
  ++impl->submitted;
  ++impl->device->inFlight;
  return true;
}

std::optional<GpuReadback::Frame> GpuReadback::poll() {
  std::optional<std::uint64_t> newest;
  for (; impl->found < impl->submitted; ++impl->found) {
    if (!impl->slotOf(impl->found).submission.done()) break;
    --impl->device->inFlight;
    newest = impl->found;
  }
  if (!newest) return std::nullopt;
  return impl->read(*newest);
}

}  // namespace gnomon
