// Programs: layouts from slots, specialisation, and no unchecked SPIR-V.
#include "harness/vulkan/internal.h"

#include <algorithm>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/program/spirv.h"

namespace gnomon::vulkan {
namespace {

void requireSubgroups(const Adapter& adapter, unsigned size) {
  const auto& sizes = adapter.info.subgroupSizes;
  if (size != 0 && std::ranges::find(sizes, size) == sizes.end())
    throw Unsupported(fmt::format("subgroups of {}; {} cannot make them", size, adapter.info.name));
}

void requireLimits(const Adapter& adapter, std::span<const BindingSlot> slots, unsigned pushBytes) {
  if (pushBytes > adapter.limits.maxPushConstantsSize)
    throw Unsupported(fmt::format("{} bytes of push constants; {} has {}", pushBytes,
                                  adapter.info.name, adapter.limits.maxPushConstantsSize));
  unsigned storageImages = 0;
  for (const BindingSlot& slot : slots) {
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

OwnedSetLayout makeSetLayout(Device& device, const Program& program, unsigned set) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const BindingSlot& slot : program.slots)
    if (slot.set == set)
      bindings.push_back({slot.binding, descriptorType(slot), slot.count, program.stages, nullptr});
  VkDescriptorSetLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  info.pBindings = bindings.data();
  VkDescriptorSetLayout made = VK_NULL_HANDLE;
  device.check(vkCreateDescriptorSetLayout(device.owner.handle, &info, nullptr, &made),
               "vkCreateDescriptorSetLayout");
  return {device.owner, made};
}

std::vector<OwnedSetLayout> makeSetLayouts(Device& device, const Program& program) {
  unsigned count = 0;
  for (const BindingSlot& slot : program.slots) count = std::max(count, slot.set + 1);
  std::vector<OwnedSetLayout> layouts;
  for (unsigned set = 0; set < count; ++set) layouts.push_back(makeSetLayout(device, program, set));
  return layouts;
}

OwnedPipelineLayout makeLayout(Device& device, const Program& program) {
  std::vector<VkDescriptorSetLayout> handles;
  for (const OwnedSetLayout& set : program.sets) handles.push_back(set.get());
  const VkPushConstantRange push{program.stages, 0, program.pushBytes};
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = static_cast<std::uint32_t>(handles.size());
  info.pSetLayouts = handles.data();
  info.pushConstantRangeCount = program.pushBytes > 0 ? 1 : 0;
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

OwnedPipeline makePipeline(Device& device, const ProgramDescription& description,
                           VkPipelineLayout layout) {
  const ShaderStage stage(device, VK_SHADER_STAGE_COMPUTE_BIT, description.spirv,
                          description.entryPoint, description.specialization);
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage = stage.info();
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

ShaderStage::ShaderStage(Device& device, VkShaderStageFlagBits which,
                         const std::vector<std::uint32_t>& spirv, std::string entryPoint,
                         const std::map<std::uint32_t, std::uint32_t>& constants)
    : stage(which), entry(std::move(entryPoint)), module(makeModule(device, spirv)) {
  for (const auto& [id, value] : constants) {
    const auto offset = static_cast<std::uint32_t>(values.size() * sizeof value);
    entries.push_back({id, offset, sizeof value});
    values.push_back(value);
  }
  specialization = {static_cast<std::uint32_t>(entries.size()), entries.data(),
                    values.size() * sizeof values[0], values.data()};
}

VkPipelineShaderStageCreateInfo ShaderStage::info() const {
  VkPipelineShaderStageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage = stage;
  info.module = module.get();
  info.pName = entry.c_str();
  info.pSpecializationInfo = &specialization;
  return info;
}

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

Program withoutPipeline(std::shared_ptr<Device> device, std::span<const BindingSlot> slots,
                        unsigned pushBytes, VkShaderStageFlags stages) {
  device->requireAlive();
  requireLimits(device->adapter, slots, pushBytes);
  Program program;
  program.device = device;
  program.stages = stages;
  program.slots.assign(slots.begin(), slots.end());
  program.pushBytes = pushBytes;
  program.sets = makeSetLayouts(*device, program);
  program.layout = makeLayout(*device, program);
  return program;
}

Program makeProgram(std::shared_ptr<Device> device, const ProgramDescription& description) {
  requireSubgroups(device->adapter, description.subgroupSize);
  Program program = withoutPipeline(device, description.slots, description.pushBytes,
                                    VK_SHADER_STAGE_COMPUTE_BIT);
  program.pipeline = makePipeline(*device, description, program.layout.get());
  return program;
}

}  // namespace gnomon::vulkan
