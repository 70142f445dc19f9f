// Recording and running dispatches: descriptors, barriers, timestamps.
#include "harness/vulkan/internal.h"

#include <algorithm>

namespace gnomon::vulkan {

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

void Runner::record(VkCommandBuffer commands, const Command& command, std::uint32_t firstQuery) {
  const Program& program = *command.program;
  const Dispatch& dispatch = *command.dispatch;
  const std::vector<VkDescriptorSet> sets = describe(command);
  // Both stamps at the bottom of the pipe: the first waits until all work before it is done, so
  // that the difference is this dispatch's time alone.
  const auto stamp = [&](std::uint32_t query) {
    if (queryCapacity > 0)
      vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries.get(), query);
  };
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.pipeline.get());
  if (!sets.empty())
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.layout.get(), 0,
                            static_cast<std::uint32_t>(sets.size()), sets.data(), 0, nullptr);
  if (!dispatch.push.empty())
    vkCmdPushConstants(commands, program.layout.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                       static_cast<std::uint32_t>(dispatch.push.size()), dispatch.push.data());
  stamp(firstQuery);
  vkCmdDispatch(commands, dispatch.groups[0], dispatch.groups[1], dispatch.groups[2]);
  stamp(firstQuery + 1);
  fullBarrier(commands);
}

std::vector<double> Runner::readTimes(std::size_t count) {
  std::vector<double> times(count, 0);
  if (queryCapacity == 0) return times;
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

std::vector<double> Runner::run(std::span<const Command> list, std::chrono::milliseconds limit) {
  const auto queryCount = static_cast<std::uint32_t>(list.size() * 2);
  const VkCommandBuffer commands = device->begin();
  DescriptorNeeds needs;
  for (const Command& command : list) needs.add(*command.program);
  reservePool(needs);
  reserveQueries(queryCount);
  if (queryCapacity > 0) vkCmdResetQueryPool(commands, queries.get(), 0, queryCount);
  for (std::uint32_t i = 0; i < list.size(); ++i) record(commands, list[i], 2 * i);
  device->finish(limit);
  return readTimes(list.size());
}

}  // namespace gnomon::vulkan
