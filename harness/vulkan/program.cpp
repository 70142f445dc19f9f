// Compute pipelines: layouts from slots, specialisation, and no unchecked SPIR-V.
#include "harness/vulkan/internal.h"

#include <algorithm>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/program/spirv.h"

namespace gnomon::vulkan {
namespace {

void requireLimits(const Adapter& adapter, const ProgramDescription& description) {
  if (description.pushBytes > adapter.limits.maxPushConstantsSize)
    throw Unsupported(fmt::format("{} bytes of push constants; {} has {}", description.pushBytes,
                                  adapter.info.name, adapter.limits.maxPushConstantsSize));
  const auto& sizes = adapter.info.subgroupSizes;
  if (description.subgroupSize != 0 &&
      std::ranges::find(sizes, description.subgroupSize) == sizes.end())
    throw Unsupported(fmt::format("subgroups of {}; {} cannot make them", description.subgroupSize,
                                  adapter.info.name));
  unsigned storageImages = 0;
  for (const BindingSlot& slot : description.slots) {
    if (slot.set >= adapter.limits.maxBoundDescriptorSets)
      throw Unsupported(fmt::format("descriptor set {}; {} has {} sets", slot.set,
                                    adapter.info.name, adapter.limits.maxBoundDescriptorSets));
    if (slot.kind == BindingSlot::Kind::kStorageImage) storageImages += slot.count;
  }
  if (storageImages > adapter.limits.maxPerStageDescriptorStorageImages)
    throw Unsupported(fmt::format("{} storage images; {} allows {}", storageImages,
                                  adapter.info.name,
                                  adapter.limits.maxPerStageDescriptorStorageImages));
}

OwnedSetLayout makeSetLayout(Device& device, std::span<const BindingSlot> slots, unsigned set) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const BindingSlot& slot : slots)
    if (slot.set == set)
      bindings.push_back(
          {slot.binding, descriptorType(slot), slot.count, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  VkDescriptorSetLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  info.pBindings = bindings.data();
  VkDescriptorSetLayout made = VK_NULL_HANDLE;
  device.check(vkCreateDescriptorSetLayout(device.owner.handle, &info, nullptr, &made),
               "vkCreateDescriptorSetLayout");
  return {device.owner, made};
}

std::vector<OwnedSetLayout> makeSetLayouts(Device& device, std::span<const BindingSlot> slots) {
  unsigned count = 0;
  for (const BindingSlot& slot : slots) count = std::max(count, slot.set + 1);
  std::vector<OwnedSetLayout> layouts;
  for (unsigned set = 0; set < count; ++set) layouts.push_back(makeSetLayout(device, slots, set));
  return layouts;
}

OwnedPipelineLayout makeLayout(Device& device, std::span<const OwnedSetLayout> sets,
                               unsigned pushBytes) {
  std::vector<VkDescriptorSetLayout> handles;
  for (const OwnedSetLayout& set : sets) handles.push_back(set.get());
  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, pushBytes};
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = static_cast<std::uint32_t>(handles.size());
  info.pSetLayouts = handles.data();
  info.pushConstantRangeCount = pushBytes > 0 ? 1 : 0;
  info.pPushConstantRanges = &push;
  VkPipelineLayout made = VK_NULL_HANDLE;
  device.check(vkCreatePipelineLayout(device.owner.handle, &info, nullptr, &made),
               "vkCreatePipelineLayout");
  return {device.owner, made};
}

/// The only way to a shader module: a driver may do anything with words that are not valid.
OwnedShaderModule makeModule(Device& device, const std::vector<std::uint32_t>& spirv) {
  if (const std::string complaint = validateSpirv(spirv); !complaint.empty())
    throw UsageError(fmt::format("invalid SPIR-V: {}", complaint));
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = spirv.size() * sizeof(std::uint32_t);
  info.pCode = spirv.data();
  VkShaderModule made = VK_NULL_HANDLE;
  device.check(vkCreateShaderModule(device.owner.handle, &info, nullptr, &made),
               "vkCreateShaderModule");
  return {device.owner, made};
}

/// Specialisation constants in the form that Vulkan takes: entries that point into values.
struct Specialization {
  std::vector<VkSpecializationMapEntry> entries;
  std::vector<std::uint32_t> values;

  explicit Specialization(const std::map<std::uint32_t, std::uint32_t>& constants) {
    for (const auto& [id, value] : constants) {
      const auto offset = static_cast<std::uint32_t>(values.size() * sizeof value);
      entries.push_back({id, offset, sizeof value});
      values.push_back(value);
    }
  }

  VkSpecializationInfo info() const {
    return {static_cast<std::uint32_t>(entries.size()), entries.data(),
            values.size() * sizeof(std::uint32_t), values.data()};
  }
};

OwnedPipeline makePipeline(Device& device, const ProgramDescription& description,
                           VkPipelineLayout layout) {
  const OwnedShaderModule module = makeModule(device, description.spirv);
  const Specialization specialization(description.specialization);
  const VkSpecializationInfo constants = specialization.info();
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module.get();
  info.stage.pName = description.entryPoint.c_str();
  info.stage.pSpecializationInfo = &constants;
  VkPipelineShaderStageRequiredSubgroupSizeCreateInfo size{};
  size.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_REQUIRED_SUBGROUP_SIZE_CREATE_INFO;
  size.requiredSubgroupSize = description.subgroupSize;
  if (description.subgroupSize != 0) info.stage.pNext = &size;
  info.layout = layout;
  VkPipeline made = VK_NULL_HANDLE;
  device.check(
      vkCreateComputePipelines(device.owner.handle, VK_NULL_HANDLE, 1, &info, nullptr, &made),
      "vkCreateComputePipelines");
  return {device.owner, made};
}

}  // namespace

VkDescriptorType descriptorType(const BindingSlot& slot) {
  switch (slot.kind) {
    case BindingSlot::Kind::kStorageBuffer:
      return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    case BindingSlot::Kind::kUniformBuffer:
      return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    case BindingSlot::Kind::kSampledImage:
      return VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
    case BindingSlot::Kind::kStorageImage:
      return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    case BindingSlot::Kind::kSampler:
      return VK_DESCRIPTOR_TYPE_SAMPLER;
    case BindingSlot::Kind::kCombined:
      return VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
  }
  return VK_DESCRIPTOR_TYPE_MAX_ENUM;  // no such kind
}

Program makeProgram(std::shared_ptr<Device> device, const ProgramDescription& description) {
  device->requireAlive();
  requireLimits(device->adapter, description);
  Program program;
  program.device = device;
  program.slots = description.slots;
  program.pushBytes = description.pushBytes;
  program.sets = makeSetLayouts(*device, description.slots);
  program.layout = makeLayout(*device, program.sets, description.pushBytes);
  program.pipeline = makePipeline(*device, description, program.layout.get());
  return program;
}

}  // namespace gnomon::vulkan
