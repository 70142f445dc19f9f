// The instance: loader, validation layer, messages.
#include "harness/vulkan/internal.h"

#include <cstdlib>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "harness/cache.h"
#include "harness/error.h"

namespace gnomon::vulkan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

const char* resultName(VkResult result) {
#define GNOMON_NAME(name) \
  case name:              \
    return #name;
  switch (result) {
    GNOMON_NAME(VK_SUCCESS)
    GNOMON_NAME(VK_NOT_READY)
    GNOMON_NAME(VK_TIMEOUT)
    GNOMON_NAME(VK_INCOMPLETE)
    GNOMON_NAME(VK_ERROR_OUT_OF_HOST_MEMORY)
    GNOMON_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY)
    GNOMON_NAME(VK_ERROR_INITIALIZATION_FAILED)
    GNOMON_NAME(VK_ERROR_DEVICE_LOST)
    GNOMON_NAME(VK_ERROR_MEMORY_MAP_FAILED)
    GNOMON_NAME(VK_ERROR_LAYER_NOT_PRESENT)
    GNOMON_NAME(VK_ERROR_EXTENSION_NOT_PRESENT)
    GNOMON_NAME(VK_ERROR_FEATURE_NOT_PRESENT)
    GNOMON_NAME(VK_ERROR_INCOMPATIBLE_DRIVER)
    GNOMON_NAME(VK_ERROR_TOO_MANY_OBJECTS)
    GNOMON_NAME(VK_ERROR_FORMAT_NOT_SUPPORTED)
    GNOMON_NAME(VK_ERROR_FRAGMENTED_POOL)
    GNOMON_NAME(VK_ERROR_UNKNOWN)
    GNOMON_NAME(VK_ERROR_OUT_OF_POOL_MEMORY)
    GNOMON_NAME(VK_ERROR_FRAGMENTATION)
    GNOMON_NAME(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS)
    GNOMON_NAME(VK_ERROR_INVALID_SHADER_NV)
    GNOMON_NAME(VK_ERROR_VALIDATION_FAILED_EXT)
    default:
      return nullptr;
  }
#undef GNOMON_NAME
}

// Processors of one kind say the same here; empty where the system does not say.
std::string processorFeatures() {
  std::ifstream file("/proc/cpuinfo");
  std::string line;
  while (std::getline(file, line))
    if (line.starts_with("flags") || line.starts_with("Features")) break;
  return line;
}

// Mesa's software driver keeps machine code on disk by shader and driver, but for any processor and
// vector width: a driver under test must not answer with what it made for another. So each has a
// folder, also where the user has named one for all.
void separateShaderCaches() {
  const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
  const fs::path folder = cacheFolder() / "shaders" /
                          fmt::format("{:016x}-{}", std::hash<std::string>{}(processorFeatures()),
                                      width == nullptr ? "own" : width);
  std::error_code error;
  if (!cacheFolder().empty()) fs::create_directories(folder, error);  // Mesa makes the last alone
  if (cacheFolder().empty() || error)
    setenv("MESA_SHADER_CACHE_DISABLE", "true", /*overwrite=*/0);
  else
    setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), /*overwrite=*/1);
}

bool hasValidationLayer() {
  std::uint32_t count = 0;
  if (vkEnumerateInstanceLayerProperties(&count, nullptr) != VK_SUCCESS) return false;
  std::vector<VkLayerProperties> layers(count);
  if (vkEnumerateInstanceLayerProperties(&count, layers.data()) != VK_SUCCESS) return false;
  return std::ranges::any_of(layers, [](const VkLayerProperties& layer) {
    return std::string_view(layer.layerName) == kValidationLayer;
  });
}

/// "VUID-...: what is wrong". The layer's own text repeats the name and lists object handles, set
/// apart by bars; the last part is what a reader needs.
std::string readable(const VkDebugUtilsMessengerCallbackDataEXT& data) {
  std::string_view text = data.pMessage;
  if (const std::size_t bar = text.rfind(" | "); bar != text.npos) text.remove_prefix(bar + 3);
  const char* name = data.pMessageIdName != nullptr ? data.pMessageIdName : "validation";
  return fmt::format("{}: {}", name, text);
}

VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                       VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data,
                                       void* log) {
  static_cast<MessageLog*>(log)->add(readable(*data));
  return VK_FALSE;  // the specification reserves VK_TRUE for the layers' own tests
}

/// Warnings and errors of validation alone: GENERAL is the loader's talk about its manifests, and
/// what is slow is not wrong.
VkDebugUtilsMessengerCreateInfoEXT messengerInfo(MessageLog& log) {
  VkDebugUtilsMessengerCreateInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  info.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                         VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  info.pfnUserCallback = collect;
  info.pUserData = &log;
  return info;
}

VkApplicationInfo applicationInfo() {
  VkApplicationInfo info{};
  info.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  info.pApplicationName = "gnomon";
  info.apiVersion = VK_API_VERSION_1_3;  // an upper bound; a device may have less
  return info;
}

}  // namespace

std::string callFailed(const char* call, VkResult result) {
  if (const char* name = resultName(result)) return fmt::format("{}: {}", call, name);
  return fmt::format("{}: VkResult {}", call, static_cast<int>(result));
}

void MessageLog::add(std::string message) {
  const std::lock_guard lock(mutex);
  messages.push_back(std::move(message));
}

std::vector<std::string> MessageLog::take() {
  const std::lock_guard lock(mutex);
  return std::exchange(messages, {});
}

Instance::Instance(bool validation) {
  if (validation && !hasValidationLayer())
    throw DeviceError(
        fmt::format("the Vulkan validation layer ({}) is not installed: install the package "
                    "vulkan-validationlayers, or run without validation",
                    kValidationLayer));
  create(validation);
  if (!validation || handle == VK_NULL_HANDLE) return;
  const auto make = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(handle, "vkCreateDebugUtilsMessengerEXT"));
  const VkDebugUtilsMessengerCreateInfoEXT info = messengerInfo(log);
  if (make != nullptr) make(handle, &info, nullptr, &messenger);
}

void Instance::create(bool validation) {
  constexpr std::array kExtensions{VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                   VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
  constexpr VkValidationFeatureEnableEXT kSynchronization =
      VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  // Chained to the instance, the messenger also hears vkCreateInstance and vkDestroyInstance.
  const VkDebugUtilsMessengerCreateInfoEXT messages = messengerInfo(log);
  VkValidationFeaturesEXT checks{};
  checks.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  checks.pNext = &messages;
  checks.enabledValidationFeatureCount = 1;
  checks.pEnabledValidationFeatures = &kSynchronization;

  const VkApplicationInfo application = applicationInfo();
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  if (validation) {
    info.pNext = &checks;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    info.enabledExtensionCount = static_cast<std::uint32_t>(kExtensions.size());
    info.ppEnabledExtensionNames = kExtensions.data();
  }
  separateShaderCaches();
  const VkResult result = vkCreateInstance(&info, nullptr, &handle);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) return;  // the loader found no driver
  if (result != VK_SUCCESS) throw DeviceError(callFailed("vkCreateInstance", result));
}

Instance::~Instance() {
  if (messenger != VK_NULL_HANDLE) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(handle, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(handle, messenger, nullptr);
  }
  if (handle != VK_NULL_HANDLE) vkDestroyInstance(handle, nullptr);
}

}  // namespace gnomon::vulkan
