// Which devices there are, what they can do, and which one the user means.
#include "harness/vulkan/internal.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace vulkan {
namespace {

struct Properties {
  VkPhysicalDeviceProperties2 core{};
  VkPhysicalDeviceVulkan11Properties v11{};
  VkPhysicalDeviceVulkan12Properties v12{};
  VkPhysicalDeviceVulkan13Properties v13{};
};

Properties propertiesOf(VkPhysicalDevice device, bool has13) {
  Properties properties;
  properties.core.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  properties.core.pNext = &properties.v11;
  properties.v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES;
  properties.v11.pNext = &properties.v12;
  properties.v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES;
  properties.v12.pNext = has13 ? &properties.v13 : nullptr;
  properties.v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES;
  vkGetPhysicalDeviceProperties2(device, &properties.core);
  properties.core.pNext = nullptr;  // the chain points into this function's variable
  properties.v11.pNext = nullptr;
  properties.v12.pNext = nullptr;
  return properties;
}

std::uint32_t apiVersion(VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(device, &properties);
  return properties.apiVersion;
}

const char* typeName(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "software";
    default:
      return "other";
  }
}

/// RTE for 32 bit alone. Where the device wants the same rounding for all widths, that would be
/// wrong in a kernel that also computes in 16 or 64 bit
/// (VUID-RuntimeSpirv-roundingModeIndependence-06292).
bool canDeclareRte(const VkPhysicalDeviceVulkan12Properties& properties) {
  return properties.shaderRoundingModeRTEFloat32 == VK_TRUE &&
         properties.roundingModeIndependence != VK_SHADER_FLOAT_CONTROLS_INDEPENDENCE_NONE;
}

void nameSubgroupFeatures(const VkPhysicalDeviceVulkan11Properties& properties,
                          std::map<std::string, bool>& names) {
  constexpr std::pair<const char*, VkSubgroupFeatureFlagBits> kOperations[] = {
      {"subgroupBasic", VK_SUBGROUP_FEATURE_BASIC_BIT},
      {"subgroupVote", VK_SUBGROUP_FEATURE_VOTE_BIT},
      {"subgroupArithmetic", VK_SUBGROUP_FEATURE_ARITHMETIC_BIT},
      {"subgroupBallot", VK_SUBGROUP_FEATURE_BALLOT_BIT},
      {"subgroupShuffle", VK_SUBGROUP_FEATURE_SHUFFLE_BIT},
      {"subgroupShuffleRelative", VK_SUBGROUP_FEATURE_SHUFFLE_RELATIVE_BIT},
      {"subgroupClustered", VK_SUBGROUP_FEATURE_CLUSTERED_BIT},
      {"subgroupQuad", VK_SUBGROUP_FEATURE_QUAD_BIT},
  };
  const bool inCompute = (properties.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
  for (const auto& [name, bit] : kOperations)
    names[name] = inCompute && (properties.subgroupSupportedOperations & bit) != 0;
}

void fillLimits(const VkPhysicalDeviceLimits& limits, GpuInfo& info) {
  info.maxGroupInvocations = limits.maxComputeWorkGroupInvocations;
  std::ranges::copy(limits.maxComputeWorkGroupSize, info.maxGroupSize.begin());
  std::ranges::copy(limits.maxComputeWorkGroupCount, info.maxGroupCount.begin());
  info.maxSharedBytes = limits.maxComputeSharedMemorySize;
  info.maxPushBytes = limits.maxPushConstantsSize;
  info.maxStorageRange = limits.maxStorageBufferRange;
  info.maxImageSide = limits.maxImageDimension2D;
  info.maxImageLayers = limits.maxImageArrayLayers;
  info.subTexelBits = limits.subTexelPrecisionBits;
  info.mipmapBits = limits.mipmapPrecisionBits;
}

/// Powers of two that a compute shader may ask for; none without subgroupSizeControl.
std::vector<unsigned> subgroupSizes(const VkPhysicalDeviceVulkan13Properties& properties,
                                    const FeatureChain& features) {
  std::vector<unsigned> sizes;
  if (features.v13.subgroupSizeControl != VK_TRUE ||
      (properties.requiredSubgroupSizeStages & VK_SHADER_STAGE_COMPUTE_BIT) == 0)
    return sizes;
  for (unsigned s = properties.minSubgroupSize; s != 0 && s <= properties.maxSubgroupSize; s *= 2)
    sizes.push_back(s);
  return sizes;
}

struct Queue {
  std::uint32_t family = 0;
  unsigned timestampBits = 0;
  bool graphics = false;
};

GpuInfo describe(const Properties& properties, const FeatureChain& features, const Queue& queue) {
  const VkPhysicalDeviceProperties& core = properties.core.properties;
  GpuInfo info;
  info.name = core.deviceName;
  info.driver = fmt::format("{} {}", properties.v12.driverName, properties.v12.driverInfo);
  info.api =
      fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(core.apiVersion),
                  VK_API_VERSION_MINOR(core.apiVersion), VK_API_VERSION_PATCH(core.apiVersion));
  info.type = typeName(core.deviceType);
  info.software = core.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  info.subgroupSize = properties.v11.subgroupSize;
  info.subgroupSizes = subgroupSizes(properties.v13, features);
  info.maxGroupSubgroups = properties.v13.maxComputeWorkgroupSubgroups;
  info.roundingRteFloat32 = canDeclareRte(properties.v12);
  info.signedZeroInfNanFloat32 = properties.v12.shaderSignedZeroInfNanPreserveFloat32 == VK_TRUE;
  info.timestampPeriodNs = queue.timestampBits == 0 ? 0 : core.limits.timestampPeriod;
  fillLimits(core.limits, info);
  info.features = namesOf(features);
  nameSubgroupFeatures(properties.v11, info.features);
  info.features["timestamps"] = queue.timestampBits != 0;
  info.features["graphicsQueue"] = queue.graphics;
  return info;
}

/// A family that can draw too where there is one: stages with draws need both.
std::optional<Queue> computeQueue(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  constexpr VkQueueFlags kCompute = VK_QUEUE_COMPUTE_BIT;
  for (const VkQueueFlags wanted : {kCompute | VK_QUEUE_GRAPHICS_BIT, kCompute})
    for (std::uint32_t i = 0; i < count; ++i)
      if ((families[i].queueFlags & wanted) == wanted)
        return Queue{i, families[i].timestampValidBits, (wanted & VK_QUEUE_GRAPHICS_BIT) != 0};
  return std::nullopt;
}

std::vector<VkPhysicalDevice> physicalDevices(VkInstance instance) {
  std::uint32_t count = 0;
  VkResult result = vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  if (result == VK_SUCCESS) result = vkEnumeratePhysicalDevices(instance, &count, devices.data());
  if (result != VK_SUCCESS && result != VK_INCOMPLETE)
    throw DeviceError(callFailed("vkEnumeratePhysicalDevices", result));
  devices.resize(count);
  return devices;
}

}  // namespace

std::vector<Adapter> adaptersOf(const Instance& instance) {
  std::vector<Adapter> adapters;
  if (instance.get() == VK_NULL_HANDLE) return adapters;
  for (const VkPhysicalDevice device : physicalDevices(instance.get())) {
    const std::optional<Queue> queue = computeQueue(device);
    if (!queue || apiVersion(device) < VK_API_VERSION_1_2) continue;
    Adapter adapter;
    adapter.handle = device;
    adapter.has13 = apiVersion(device) >= VK_API_VERSION_1_3;
    adapter.queueFamily = queue->family;
    adapter.timestampBits = queue->timestampBits;
    const Properties properties = propertiesOf(device, adapter.has13);
    adapter.limits = properties.core.properties.limits;
    adapter.features = featuresOf(device, adapter.has13);
    adapter.info = describe(properties, adapter.features, *queue);
    adapter.info.index = static_cast<int>(adapters.size());
    adapters.push_back(std::move(adapter));
  }
  return adapters;
}

}  // namespace vulkan

namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return std::tolower(c); });
  return result;
}

DeviceError cannotChoose(const std::string& why, std::span<const GpuInfo> gpus) {
  std::string text = why + "; the devices are:";
  for (const GpuInfo& gpu : gpus)
    text += fmt::format("\n  {}  {} ({}, {})", gpu.index, gpu.name, gpu.type, gpu.driver);
  return DeviceError(text);
}

/// The best kind first; "other" last, since nobody knows what it is.
std::size_t preferred(std::span<const GpuInfo> gpus) {
  for (const std::string_view type : {"discrete", "integrated", "virtual", "software"})
    for (std::size_t i = 0; i < gpus.size(); ++i)
      if (gpus[i].type == type) return i;
  return 0;
}

std::size_t byName(std::span<const GpuInfo> gpus, const std::string& wanted) {
  std::vector<std::size_t> matches;
  for (std::size_t i = 0; i < gpus.size(); ++i)
    if (lower(gpus[i].name).find(lower(wanted)) != std::string::npos) matches.push_back(i);
  if (matches.empty()) throw cannotChoose(fmt::format("no device is named '{}'", wanted), gpus);
  if (matches.size() > 1)
    throw cannotChoose(
        fmt::format("{} devices are named '{}': give an index", matches.size(), wanted), gpus);
  return matches[0];
}

}  // namespace

std::size_t chooseGpu(std::span<const GpuInfo> gpus, const std::string& wanted) {
  if (gpus.empty())
    throw DeviceError(
        "no Vulkan 1.2 device with a compute queue: install a driver (the package "
        "mesa-vulkan-drivers has a software one)");
  if (wanted.empty()) return preferred(gpus);
  std::size_t index = 0;
  const char* const end = wanted.data() + wanted.size();
  const auto [rest, error] = std::from_chars(wanted.data(), end, index);
  if (rest != end) return byName(gpus, wanted);
  if (error != std::errc() || index >= gpus.size())
    throw cannotChoose(fmt::format("there is no device {}", wanted), gpus);
  return index;
}

std::vector<GpuInfo> listGpus() {
  const vulkan::Instance instance(false);
  std::vector<GpuInfo> gpus;
  for (vulkan::Adapter& adapter : vulkan::adaptersOf(instance))
    gpus.push_back(std::move(adapter.info));
  return gpus;
}

std::optional<std::string> GpuInfo::lacks(std::span<const std::string> wanted) const {
  std::vector<std::string_view> missing;
  for (const std::string& feature : wanted) {
    const auto found = features.find(feature);
    if (found == features.end() || !found->second) missing.push_back(feature);
  }
  if (missing.empty()) return std::nullopt;
  return fmt::format("{} lacks {}", name, fmt::join(missing, ", "));
}

}  // namespace gnomon
