// Which optional features a Gpu enables: every one of these that the device has.
#include "harness/vulkan/internal.h"

#include <algorithm>

namespace gnomon::vulkan {
namespace {

template <typename Structure>
struct Feature {
  const char* name;
  VkBool32 Structure::*member;
};

#define GNOMON_FEATURE(name) \
  { #name, &Structure::name }

template <typename Structure>
struct Features;

// Not robustBufferAccess: with it a write past the end of a binding vanishes, without it the
// write hits the guard band behind the binding and is found.
template <>
struct Features<VkPhysicalDeviceFeatures> {
  using Structure = VkPhysicalDeviceFeatures;
  static constexpr Feature<Structure> kAll[] = {
      GNOMON_FEATURE(fullDrawIndexUint32),
      GNOMON_FEATURE(imageCubeArray),
      GNOMON_FEATURE(independentBlend),
      GNOMON_FEATURE(multiDrawIndirect),
      GNOMON_FEATURE(drawIndirectFirstInstance),
      GNOMON_FEATURE(depthClamp),
      GNOMON_FEATURE(samplerAnisotropy),
      GNOMON_FEATURE(vertexPipelineStoresAndAtomics),
      GNOMON_FEATURE(fragmentStoresAndAtomics),
      GNOMON_FEATURE(shaderImageGatherExtended),
      GNOMON_FEATURE(shaderStorageImageExtendedFormats),
      GNOMON_FEATURE(shaderStorageImageMultisample),
      GNOMON_FEATURE(shaderStorageImageReadWithoutFormat),
      GNOMON_FEATURE(shaderStorageImageWriteWithoutFormat),
      GNOMON_FEATURE(shaderUniformBufferArrayDynamicIndexing),
      GNOMON_FEATURE(shaderSampledImageArrayDynamicIndexing),
      GNOMON_FEATURE(shaderStorageBufferArrayDynamicIndexing),
      GNOMON_FEATURE(shaderStorageImageArrayDynamicIndexing),
      GNOMON_FEATURE(shaderFloat64),
      GNOMON_FEATURE(shaderInt64),
      GNOMON_FEATURE(shaderInt16),
  };
};

template <>
struct Features<VkPhysicalDeviceVulkan11Features> {
  using Structure = VkPhysicalDeviceVulkan11Features;
  static constexpr Feature<Structure> kAll[] = {
      GNOMON_FEATURE(storageBuffer16BitAccess), GNOMON_FEATURE(uniformAndStorageBuffer16BitAccess),
      GNOMON_FEATURE(storagePushConstant16),    GNOMON_FEATURE(variablePointersStorageBuffer),
      GNOMON_FEATURE(variablePointers),         GNOMON_FEATURE(shaderDrawParameters),
  };
};

template <>
struct Features<VkPhysicalDeviceVulkan12Features> {
  using Structure = VkPhysicalDeviceVulkan12Features;
  static constexpr Feature<Structure> kAll[] = {
      GNOMON_FEATURE(drawIndirectCount),
      GNOMON_FEATURE(storageBuffer8BitAccess),
      GNOMON_FEATURE(uniformAndStorageBuffer8BitAccess),
      GNOMON_FEATURE(storagePushConstant8),
      GNOMON_FEATURE(shaderBufferInt64Atomics),
      GNOMON_FEATURE(shaderSharedInt64Atomics),
      GNOMON_FEATURE(shaderFloat16),
      GNOMON_FEATURE(shaderInt8),
      GNOMON_FEATURE(descriptorIndexing),
      GNOMON_FEATURE(shaderSampledImageArrayNonUniformIndexing),
      GNOMON_FEATURE(shaderStorageBufferArrayNonUniformIndexing),
      GNOMON_FEATURE(shaderStorageImageArrayNonUniformIndexing),
      GNOMON_FEATURE(descriptorBindingPartiallyBound),
      GNOMON_FEATURE(runtimeDescriptorArray),
      GNOMON_FEATURE(samplerFilterMinmax),
      GNOMON_FEATURE(scalarBlockLayout),
      GNOMON_FEATURE(uniformBufferStandardLayout),
      GNOMON_FEATURE(shaderSubgroupExtendedTypes),
      GNOMON_FEATURE(bufferDeviceAddress),
      GNOMON_FEATURE(vulkanMemoryModel),
      GNOMON_FEATURE(vulkanMemoryModelDeviceScope),
      GNOMON_FEATURE(shaderOutputViewportIndex),
      GNOMON_FEATURE(shaderOutputLayer),
      GNOMON_FEATURE(subgroupBroadcastDynamicId),
  };
};

template <>
struct Features<VkPhysicalDeviceVulkan13Features> {
  using Structure = VkPhysicalDeviceVulkan13Features;
  static constexpr Feature<Structure> kAll[] = {
      GNOMON_FEATURE(shaderDemoteToHelperInvocation),
      GNOMON_FEATURE(shaderTerminateInvocation),
      GNOMON_FEATURE(subgroupSizeControl),
      GNOMON_FEATURE(computeFullSubgroups),
      GNOMON_FEATURE(synchronization2),
      GNOMON_FEATURE(shaderZeroInitializeWorkgroupMemory),
      GNOMON_FEATURE(dynamicRendering),
      GNOMON_FEATURE(shaderIntegerDotProduct),
      GNOMON_FEATURE(maintenance4),
  };
};

#undef GNOMON_FEATURE

template <typename Structure>
void copyListed(const Structure& from, Structure& to) {
  for (const auto& [name, member] : Features<Structure>::kAll) to.*member = from.*member;
}

template <typename Structure>
void dropListed(const std::vector<std::string>& names, Structure& from) {
  for (const auto& [name, member] : Features<Structure>::kAll)
    if (std::ranges::find(names, name) != names.end()) from.*member = VK_FALSE;
}

template <typename Structure>
void nameListed(const Structure& from, std::map<std::string, bool>& names) {
  for (const auto& [name, member] : Features<Structure>::kAll)
    names[name] = from.*member == VK_TRUE;
}

}  // namespace

VkPhysicalDeviceFeatures2* FeatureChain::link(bool has13) {
  core.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  core.pNext = &v11;
  v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
  v11.pNext = &v12;
  v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
  v12.pNext = has13 ? &v13 : nullptr;
  v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
  v13.pNext = nullptr;
  return &core;
}

FeatureChain featuresOf(VkPhysicalDevice device, bool has13) {
  FeatureChain all;
  vkGetPhysicalDeviceFeatures2(device, all.link(has13));
  FeatureChain listed;
  copyListed(all.core.features, listed.core.features);
  copyListed(all.v11, listed.v11);
  copyListed(all.v12, listed.v12);
  copyListed(all.v13, listed.v13);
  return listed;
}

void drop(const std::vector<std::string>& names, FeatureChain& features) {
  dropListed(names, features.core.features);
  dropListed(names, features.v11);
  dropListed(names, features.v12);
  dropListed(names, features.v13);
}

std::map<std::string, bool> namesOf(const FeatureChain& features) {
  std::map<std::string, bool> names;
  nameListed(features.core.features, names);
  nameListed(features.v11, names);
  nameListed(features.v12, names);
  nameListed(features.v13, names);
  return names;
}

}  // namespace gnomon::vulkan
