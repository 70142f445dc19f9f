// Recording and running dispatches and draws: descriptors, barriers, timestamps.
#include "harness/vulkan/internal.h"

#include <algorithm>

namespace gnomon::vulkan {
namespace {

void drawDirect(VkCommandBuffer commands, std::span<const DrawIndexed> draws) {
  for (const DrawIndexed& draw : draws)
    vkCmdDrawIndexed(commands, draw.indexCount, draw.instanceCount, draw.firstIndex,
                     draw.vertexOffset, draw.firstInstance);
}

void drawIndirect(VkCommandBuffer commands, const DrawParts& draw) {
  if (draw.counter != VK_NULL_HANDLE)
    return vkCmdDrawIndexedIndirectCount(commands, draw.commands, draw.offset, draw.counter,
                                         draw.counterOffset, draw.count, draw.stride);
  if (!draw.oneByOne)
    return vkCmdDrawIndexedIndirect(commands, draw.commands, draw.offset, draw.count, draw.stride);
  for (std::uint32_t i = 0; i < draw.count; ++i)
    vkCmdDrawIndexedIndirect(commands, draw.commands, draw.offset + VkDeviceSize{i} * draw.stride,
                             1, draw.stride);
}

void render(VkCommandBuffer commands, const DrawParts& draw) {
  const VkRect2D area{{0, 0}, draw.size};
  const VkViewport viewport{
      0, 0, static_cast<float>(draw.size.width), static_cast<float>(draw.size.height), 0, 1};
  VkRenderingInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDERING_INFO;
  info.renderArea = area;
  info.layerCount = 1;
  info.colorAttachmentCount = static_cast<std::uint32_t>(draw.colours.size());
  info.pColorAttachments = draw.colours.data();
  info.pDepthAttachment = draw.depth ? &*draw.depth : nullptr;
  vkCmdBeginRendering(commands, &info);
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &area);
  vkCmdBindIndexBuffer(commands, draw.indices, 0, VK_INDEX_TYPE_UINT32);
  if (draw.commands == VK_NULL_HANDLE)
    drawDirect(commands, draw.direct);
  else
    drawIndirect(commands, draw);
  vkCmdEndRendering(commands);
}

}  // namespace

void DescriptorNeeds::add(const Program& program) {
  sets += static_cast<std::uint32_t>(program.sets.size());
  for (const BindingSlot& slot : program.slots) descriptors[descriptorType(slot)] += slot.count;
}

void DescriptorNeeds::widenTo(const DescriptorNeeds& other) {
  sets = std::max(sets, other.sets);
  for (const auto& [type, count] : other.descriptors)
    descriptors[type] = std::max(descriptors[type], count);
}

bool DescriptorNeeds::fitsIn(const DescriptorNeeds& capacity) const {
  return sets <= capacity.sets && std::ranges::all_of(descriptors, [&](const auto& need) {
           const auto found = capacity.descriptors.find(need.first);
           return found != capacity.descriptors.end() && need.second <= found->second;
         });
}

void Runner::reservePool(const DescriptorNeeds& needs) {
  if (needs.sets == 0) return;
  if (needs.fitsIn(poolCapacity))
    return device->check(vkResetDescriptorPool(device->owner.handle, pool.get(), 0),
                         "vkResetDescriptorPool");
  DescriptorNeeds wider = poolCapacity;
  wider.widenTo(needs);
  std::vector<VkDescriptorPoolSize> sizes;
  for (const auto& [type, count] : wider.descriptors) sizes.push_back({type, count});
  VkDescriptorPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  info.maxSets = wider.sets;
  info.poolSizeCount = static_cast<std::uint32_t>(sizes.size());
  info.pPoolSizes = sizes.data();
  VkDescriptorPool made = VK_NULL_HANDLE;
  device->check(vkCreateDescriptorPool(device->owner.handle, &info, nullptr, &made),
                "vkCreateDescriptorPool");
  pool = {device->owner, made};
  poolCapacity = wider;
}

void Runner::reserveQueries(std::uint32_t count) {
  if (device->adapter.timestampBits == 0 || count <= queryCapacity) return;
  VkQueryPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  info.queryType = VK_QUERY_TYPE_TIMESTAMP;
  info.queryCount = count;
  VkQueryPool made = VK_NULL_HANDLE;
  device->check(vkCreateQueryPool(device->owner.handle, &info, nullptr, &made),
                "vkCreateQueryPool");
  queries = {device->owner, made};
  queryCapacity = count;
}

std::vector<VkDescriptorSet> Runner::describe(const Command& command) {
  const Program& program = *command.program;
  std::vector<VkDescriptorSetLayout> layouts;
  for (const OwnedSetLayout& layout : program.sets) layouts.push_back(layout.get());
  std::vector<VkDescriptorSet> sets(layouts.size());
  if (sets.empty()) return sets;
  VkDescriptorSetAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  info.descriptorPool = pool.get();
  info.descriptorSetCount = static_cast<std::uint32_t>(layouts.size());
  info.pSetLayouts = layouts.data();
  device->check(vkAllocateDescriptorSets(device->owner.handle, &info, sets.data()),
                "vkAllocateDescriptorSets");

  std::vector<VkWriteDescriptorSet> writes;
  const auto writeTo = [&](const BindingSlot& slot) -> VkWriteDescriptorSet& {
    VkWriteDescriptorSet& write = writes.emplace_back();
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = sets[slot.set];
    write.dstBinding = slot.binding;
    write.descriptorCount = slot.count;
    write.descriptorType = descriptorType(slot);
    return write;
  };
  for (const BoundRange& bound : command.buffers) writeTo(bound.slot).pBufferInfo = &bound.buffer;
  for (const BoundView& bound : command.images)
    writeTo(bound.slot).pImageInfo = bound.images.data();
  vkUpdateDescriptorSets(device->owner.handle, static_cast<std::uint32_t>(writes.size()),
                         writes.data(), 0, nullptr);
  return sets;
}

void Runner::bind(VkCommandBuffer commands, const Command& command) {
  const Program& program = *command.program;
  const VkPipelineBindPoint point =
      command.draw ? VK_PIPELINE_BIND_POINT_GRAPHICS : VK_PIPELINE_BIND_POINT_COMPUTE;
  const std::vector<VkDescriptorSet> sets = describe(command);
  vkCmdBindPipeline(commands, point, program.pipeline.get());
  if (!sets.empty())
    vkCmdBindDescriptorSets(commands, point, program.layout.get(), 0,
                            static_cast<std::uint32_t>(sets.size()), sets.data(), 0, nullptr);
  if (!command.push.empty())
    vkCmdPushConstants(commands, program.layout.get(), program.stages, 0,
                       static_cast<std::uint32_t>(command.push.size()), command.push.data());
}

void Runner::record(VkCommandBuffer commands, const Command& command, std::uint32_t firstQuery) {
  // Both stamps at the bottom of the pipe: the first waits until all work before it is done, so
  // that the difference is this command's time alone.
  const auto stamp = [&](std::uint32_t query) {
    if (queryCapacity > 0)
      vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries.get(), query);
  };
  bind(commands, command);
  stamp(firstQuery);
  if (command.draw)
    render(commands, *command.draw);
  else
    vkCmdDispatch(commands, command.groups[0], command.groups[1], command.groups[2]);
  stamp(firstQuery + 1);
  fullBarrier(commands);
}

std::vector<double> Runner::readTimes(std::size_t count) {
  std::vector<double> times(count, 0);
  if (queryCapacity == 0 || count == 0) return times;
  std::vector<std::uint64_t> stamps(count * 2);
  device->check(vkGetQueryPoolResults(device->owner.handle, queries.get(), 0,
                                      static_cast<std::uint32_t>(stamps.size()),
                                      stamps.size() * sizeof stamps[0], stamps.data(),
                                      sizeof stamps[0], VK_QUERY_RESULT_64_BIT),
                "vkGetQueryPoolResults");
  // A counter of fewer than 64 bits wraps; the difference modulo its width does not mind.
  const std::uint64_t valid = ~std::uint64_t{0} >> (64 - device->adapter.timestampBits);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t ticks = (stamps[2 * i + 1] - stamps[2 * i]) & valid;
    times[i] = static_cast<double>(ticks) * device->adapter.info.timestampPeriodNs;
  }
  return times;
}

void Runner::record(VkCommandBuffer commands, std::span<const Command> list) {
  const auto queryCount = static_cast<std::uint32_t>(list.size() * 2);
  DescriptorNeeds needs;
  for (const Command& command : list) needs.add(*command.program);
  reservePool(needs);
  reserveQueries(queryCount);
  if (queryCapacity > 0 && queryCount > 0)
    vkCmdResetQueryPool(commands, queries.get(), 0, queryCount);
  for (std::uint32_t i = 0; i < list.size(); ++i) record(commands, list[i], 2 * i);
}

std::vector<double> Runner::run(std::span<const Command> list, std::chrono::milliseconds limit) {
  record(device->begin(), list);
  device->finish(limit);
  return readTimes(list.size());
}

}  // namespace gnomon::vulkan
