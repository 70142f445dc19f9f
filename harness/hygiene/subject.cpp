#include "harness/hygiene/subject.h"

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "harness/error.h"
#include "harness/program/order.h"
#include "harness/program/reflect.h"

namespace gnomon {
namespace {

bool readsWhatItWrites(const Reflection& reflection) {
  return std::ranges::any_of(reflection.bindings, [](const ReflectedBinding& b) {
    return b.kind.starts_with("storage") && !b.readOnly && !b.writeOnly;
  });
}

/// Features by the capabilities of SPIR-V that need them (Vulkan specification, "Capabilities"):
/// whoever wrote a foreign kernel did not have this device.
constexpr std::pair<std::string_view, const char*> kFeatures[] = {
    {"Float16", "shaderFloat16"},
    {"Float64", "shaderFloat64"},
    {"Int8", "shaderInt8"},
    {"Int16", "shaderInt16"},
    {"Int64", "shaderInt64"},
    {"ImageGatherExtended", "shaderImageGatherExtended"},
    {"StorageImageExtendedFormats", "shaderStorageImageExtendedFormats"},
    {"StorageImageReadWithoutFormat", "shaderStorageImageReadWithoutFormat"},
    {"StorageImageWriteWithoutFormat", "shaderStorageImageWriteWithoutFormat"},
    {"UniformBufferArrayDynamicIndexing", "shaderUniformBufferArrayDynamicIndexing"},
    {"SampledImageArrayDynamicIndexing", "shaderSampledImageArrayDynamicIndexing"},
    {"StorageBufferArrayDynamicIndexing", "shaderStorageBufferArrayDynamicIndexing"},
    {"StorageImageArrayDynamicIndexing", "shaderStorageImageArrayDynamicIndexing"},
};

std::vector<std::string> featuresOf(const Reflection& reflection) {
  std::vector<std::string> features;
  for (const auto& [capability, feature] : kFeatures)
    if (std::ranges::find(reflection.capabilities, capability) != reflection.capabilities.end())
      features.emplace_back(feature);
  return features;
}

}  // namespace

Subject::Subject(Gpu& gpu, const KernelRecord& record, KernelModule module)
    : device(&gpu), contract(&record), file(std::move(module.origin)) {
  if (const auto why = gpu.info().lacks(record.features)) throw Unsupported(*why);
  const Reflection reflection = reflect(module.words, module.entryPoint);
  const Adapter* adapter = module.adapter ? &*module.adapter : nullptr;
  mapping = interfaceOf(record, reflection, adapter, file);
  if (const auto why = gpu.info().lacks(featuresOf(reflection))) throw Unsupported(*why);
  if (adapter != nullptr) manners = adapter->conventions;
  const StrictOptions strict{.signedZeroInfNanPreserve = gpu.info().signedZeroInfNanFloat32,
                             .roundingModeRte = gpu.info().roundingRteFloat32};
  twinModule = strictTwin(module.words, strict);
  twinProgram = gpu.build(description(twinModule));
  communicates = readsWhatItWrites(reflection) || gnomon::threadsCommunicate(module.words);
  plainModule = std::move(module.words);
}

ProgramDescription Subject::description(SpirvWords module) const {
  ProgramDescription d{.spirv = std::move(module), .entryPoint = mapping.entryPoint};
  for (const ModuleBuffer& b : mapping.buffers) d.slots.push_back(b.slot);
  for (const ModuleImage& i : mapping.images) d.slots.push_back(i.slot);
  d.pushBytes = mapping.pushBytes;
  d.specialization = mapping.specialization;
  return d;
}

const GpuProgram& Subject::plain() const {
  if (!plainProgram) plainProgram = device->build(description(plainModule));
  return *plainProgram;
}

const GpuProgram& Subject::orderTwin() const {
  if (!communicates) throw std::logic_error(contract->name() + " has no order of threads to turn");
  if (!turned)
    turned = device->build(
        description(gnomon::orderTwin(twinModule, {.subgroupSize = device->info().subgroupSize})));
  return *turned;
}

const std::map<unsigned, GpuProgram>& Subject::resizedTwins() const {
  if (resized) return *resized;
  resized.emplace();
  const GpuInfo& info = device->info();
  const auto& group = mapping.groupSize;
  const std::size_t threads = std::size_t{group[0]} * group[1] * group[2];
  for (const unsigned size : info.subgroupSizes) {
    if (!communicates || size == info.subgroupSize ||
        threads > std::size_t{size} * info.maxGroupSubgroups)
      continue;
    ProgramDescription sized = description(twinModule);
    sized.subgroupSize = size;
    resized->emplace(size, device->build(sized));
  }
  return *resized;
}

}  // namespace gnomon
