// The logical device: creation, submission, waiting, and what is left when a wait fails.
#include "harness/vulkan/internal.h"

#include <algorithm>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon::vulkan {
namespace {

void barrier(VkCommandBuffer commands, VkPipelineStageFlags toStages, VkAccessFlags toAccess) {
  VkMemoryBarrier memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  memory.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  memory.dstAccessMask = toAccess;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, toStages, 0, 1, &memory, 0,
                       nullptr, 0, nullptr);
}

}  // namespace

void fullBarrier(VkCommandBuffer commands) {
  barrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
          VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
}

DeviceHandle::DeviceHandle(std::unique_ptr<Instance> from, const Adapter& adapter)
    : instance(std::move(from)) {
  constexpr float kPriority = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = adapter.queueFamily;
  queue.queueCount = 1;
  queue.pQueuePriorities = &kPriority;
  FeatureChain features = adapter.features;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.pNext = features.link(adapter.has13);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  const VkResult result = vkCreateDevice(adapter.handle, &info, nullptr, &handle);
  if (result != VK_SUCCESS)
    throw DeviceError(
        fmt::format("{}: {}", adapter.info.name, callFailed("vkCreateDevice", result)));
}

DeviceHandle::~DeviceHandle() {
  if (hung)
    static_cast<void>(instance.release());
  else
    vkDestroyDevice(handle, nullptr);
}

void DeviceHandle::check(VkResult result, const char* call) {
  if (result == VK_ERROR_DEVICE_LOST) lost = true;
  if (result != VK_SUCCESS) throw GpuError(callFailed(call, result));
}

Submission::Submission(DeviceHandle& device, std::uint32_t family) : owner(&device) {
  vkGetDeviceQueue(owner->handle, family, 0, &queue);

  VkCommandPoolCreateInfo poolInfo{};
  poolInfo.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  poolInfo.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  poolInfo.queueFamilyIndex = family;
  VkCommandPool madePool = VK_NULL_HANDLE;
  owner->check(vkCreateCommandPool(owner->handle, &poolInfo, nullptr, &madePool),
               "vkCreateCommandPool");
  pool = {*owner, madePool};

  VkCommandBufferAllocateInfo bufferInfo{};
  bufferInfo.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  bufferInfo.commandPool = pool.get();
  bufferInfo.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  bufferInfo.commandBufferCount = 1;
  owner->check(vkAllocateCommandBuffers(owner->handle, &bufferInfo, &recorded),
               "vkAllocateCommandBuffers");

  VkFenceCreateInfo fenceInfo{};
  fenceInfo.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  VkFence madeFence = VK_NULL_HANDLE;
  owner->check(vkCreateFence(owner->handle, &fenceInfo, nullptr, &madeFence), "vkCreateFence");
  fence = {*owner, madeFence};
}

VkCommandBuffer Submission::begin() {
  owner->check(vkResetCommandPool(owner->handle, pool.get(), 0), "vkResetCommandPool");
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  owner->check(vkBeginCommandBuffer(recorded, &info), "vkBeginCommandBuffer");
  fullBarrier(recorded);
  return recorded;
}

void Submission::submit() {
  barrier(recorded, VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT);
  owner->check(vkEndCommandBuffer(recorded), "vkEndCommandBuffer");
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &recorded;
  const VkFence signalled = fence.get();
  owner->check(vkResetFences(owner->handle, 1, &signalled), "vkResetFences");
  owner->check(vkQueueSubmit(queue, 1, &info, signalled), "vkQueueSubmit");
}

bool Submission::done() const {
  const VkResult result = vkGetFenceStatus(owner->handle, fence.get());
  if (result == VK_NOT_READY) return false;
  owner->check(result, "vkGetFenceStatus");
  return true;
}

void Submission::wait(std::chrono::milliseconds limit) {
  using std::chrono::milliseconds;
  const milliseconds bounded =
      std::clamp<milliseconds>(limit, milliseconds(0), std::chrono::hours(24));
  const auto nanoseconds = static_cast<std::uint64_t>(std::chrono::nanoseconds(bounded).count());
  const VkFence waited = fence.get();
  const VkResult result = vkWaitForFences(owner->handle, 1, &waited, VK_TRUE, nanoseconds);
  if (result == VK_TIMEOUT) {
    owner->hung = true;
    throw GpuError(fmt::format("the GPU did not finish within {} ms", bounded.count()));
  }
  owner->check(result, "vkWaitForFences");
}

Device::Device(std::unique_ptr<Instance> instance, const Adapter& chosen, bool alwaysStaged)
    : owner(std::move(instance), chosen),
      adapter(chosen),
      staged(alwaysStaged),
      work(owner, chosen.queueFamily) {
  vkGetPhysicalDeviceMemoryProperties(adapter.handle, &memory);
}

void Device::requireAlive() const {
  if (owner.hung)
    throw GpuError("this device is still busy with work that passed its time limit: open it anew");
  if (owner.lost) throw GpuError("this device was lost: open it anew");
}

VkCommandBuffer Device::begin() {
  requireAlive();
  return work.begin();
}

void Device::finish(std::chrono::milliseconds limit) {
  work.submit();
  work.wait(limit);
}

}  // namespace gnomon::vulkan
