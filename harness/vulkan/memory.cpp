// Buffers, and the way of data to and from them.
//
// A device whose own memory the host can map, cached and coherent (software and integrated ones),
// is written and read in place, unless a submission that nobody waited for may still use it. Any
// other gets device-local buffers and copies through one staging buffer. All mapped memory is
// HOST_COHERENT, which some memory type must be (Vulkan specification, "Device Memory",
// VkMemoryPropertyFlagBits), so nothing is flushed or invalidated, and nonCoherentAtomSize does not
// matter.
#include "harness/vulkan/internal.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "harness/error.h"

namespace gnomon::vulkan {
namespace {

constexpr VkBufferUsageFlags kUsage =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT |
    VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
    VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;

constexpr VkMemoryPropertyFlags kMapped =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = kMapped | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;

OwnedBuffer bareBuffer(Device& device, VkDeviceSize bytes) {
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes;
  info.usage = kUsage;
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  VkBuffer made = VK_NULL_HANDLE;
  device.check(vkCreateBuffer(device.owner.handle, &info, nullptr, &made), "vkCreateBuffer");
  return {device.owner, made};
}

void copy(Device& device, VkBuffer from, VkBuffer to, const VkBufferCopy& region) {
  const VkCommandBuffer commands = device.begin();
  vkCmdCopyBuffer(commands, from, to, 1, &region);
  device.finish(kTransferLimit);
}

}  // namespace

std::uint32_t Device::memoryType(std::uint32_t allowed, Memory where) const {
  constexpr std::array kDevicePreferences{kLocal | kCached, kLocal};
  constexpr std::array kHostPreferences{kCached, kMapped};
  for (VkMemoryPropertyFlags wanted :
       where == Memory::device ? kDevicePreferences : kHostPreferences)
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
      const VkMemoryPropertyFlags has = memory.memoryTypes[i].propertyFlags;
      if ((allowed >> i & 1) != 0 && (has & wanted) == wanted) return i;
    }
  throw GpuError("the device has no memory type for a buffer or image");
}

OwnedMemory Device::allocate(VkDeviceSize bytes, std::uint32_t type) {
  VkMemoryAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  info.allocationSize = bytes;
  info.memoryTypeIndex = type;
  VkDeviceMemory made = VK_NULL_HANDLE;
  check(vkAllocateMemory(owner.handle, &info, nullptr, &made), "vkAllocateMemory");
  return {owner, made};
}

Buffer Device::makeBuffer(std::size_t bytes, Memory where) {
  requireAlive();
  Buffer buffer;
  buffer.bytes = std::max<VkDeviceSize>(4, (bytes + 3) / 4 * 4);
  buffer.buffer = bareBuffer(*this, buffer.bytes);
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(owner.handle, buffer.buffer.get(), &needs);
  const std::uint32_t type = memoryType(needs.memoryTypeBits, where);
  buffer.memory = allocate(needs.size, type);
  check(vkBindBufferMemory(owner.handle, buffer.buffer.get(), buffer.memory.get(), 0),
        "vkBindBufferMemory");
  const bool mappable =
      (memory.memoryTypes[type].propertyFlags & kCached) == kCached || where == Memory::staging;
  if (!mappable || (staged && where == Memory::device)) return buffer;
  void* address = nullptr;
  check(vkMapMemory(owner.handle, buffer.memory.get(), 0, VK_WHOLE_SIZE, 0, &address),
        "vkMapMemory");
  buffer.mapped = static_cast<std::byte*>(address);
  return buffer;
}

std::byte* Device::inPlace(const Buffer& buffer) const {
  return inFlight == 0 ? buffer.mapped : nullptr;
}

const Buffer& Device::staging() {
  if (stagingBuffer.mapped == nullptr) stagingBuffer = makeBuffer(kStagingBytes, Memory::staging);
  return stagingBuffer;
}

void Device::upload(const Buffer& to, std::size_t offset, std::span<const std::byte> data) {
  requireAlive();
  if (std::byte* const mapped = inPlace(to)) {
    std::ranges::copy(data, mapped + offset);
    return;
  }
  for (; !data.empty(); data = data.subspan(std::min(data.size(), kStagingBytes))) {
    const std::span chunk = data.first(std::min(data.size(), kStagingBytes));
    std::ranges::copy(chunk, staging().mapped);
    copy(*this, staging().buffer.get(), to.buffer.get(), {0, offset, chunk.size()});
    offset += chunk.size();
  }
}

void Device::download(const Buffer& from, std::size_t offset, std::span<std::byte> data) {
  requireAlive();
  if (const std::byte* const mapped = inPlace(from)) {
    std::copy_n(mapped + offset, data.size(), data.data());
    return;
  }
  for (; !data.empty(); data = data.subspan(std::min(data.size(), kStagingBytes))) {
    const std::span chunk = data.first(std::min(data.size(), kStagingBytes));
    copy(*this, from.buffer.get(), staging().buffer.get(), {offset, 0, chunk.size()});
    std::copy_n(staging().mapped, chunk.size(), chunk.data());
    offset += chunk.size();
  }
}

void Device::fill(const Buffer& buffer, std::uint32_t pattern) {
  requireAlive();
  if (std::byte* const mapped = inPlace(buffer)) {
    for (VkDeviceSize i = 0; i < buffer.bytes; i += sizeof pattern)
      std::memcpy(mapped + i, &pattern, sizeof pattern);
    return;
  }
  const VkCommandBuffer commands = begin();
  vkCmdFillBuffer(commands, buffer.buffer.get(), 0, VK_WHOLE_SIZE, pattern);
  finish(kTransferLimit);
}

}  // namespace gnomon::vulkan
