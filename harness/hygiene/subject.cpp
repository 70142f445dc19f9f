#include "harness/hygiene/subject.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/error.h"
#include "harness/program/order.h"
#include "harness/program/reflect.h"

namespace gnomon {
namespace {

void refuseWhatContradicts(const KernelRecord& record, const Reflection& reflection,
                           const std::string& origin) {
  const std::vector<std::string> lines = contradictions(record, reflection);
  if (!lines.empty())
    throw UsageError(fmt::format("{} does not fit the contract of {}:\n  {}", origin, record.name(),
                                 fmt::join(lines, "\n  ")));
}

bool readsWhatItWrites(const Reflection& reflection) {
  return std::ranges::any_of(reflection.bindings, [](const ReflectedBinding& b) {
    return b.kind.starts_with("storage") && !b.readOnly && !b.writeOnly;
  });
}

ProgramDescription description(const KernelRecord& record, SpirvWords module) {
  ProgramDescription d{.spirv = std::move(module)};
  for (const BufferSpec& b : record.buffers) d.slots.push_back({.set = 0, .binding = b.binding});
  for (const ImageSpec& i : record.images)
    d.slots.push_back({.set = 0, .binding = i.binding, .kind = i.kind()});
  d.pushBytes = record.push.size;
  d.specialization = record.specialization;
  return d;
}

}  // namespace

Subject::Subject(Gpu& gpu, const KernelRecord& record, SpirvWords module, std::string origin)
    : device(&gpu), contract(&record), file(std::move(origin)) {
  if (const auto why = gpu.info().lacks(record.features)) throw Unsupported(*why);
  const Reflection reflection = reflect(module);
  refuseWhatContradicts(record, reflection, file);
  const StrictOptions strict{.signedZeroInfNanPreserve = gpu.info().signedZeroInfNanFloat32,
                             .roundingModeRte = gpu.info().roundingRteFloat32};
  const SpirvWords twinModule = strictTwin(module, strict);
  twinProgram = gpu.build(description(record, twinModule));
  subgroups = std::ranges::any_of(reflection.capabilities, [](const std::string& capability) {
    return capability.starts_with("GroupNonUniform") || capability.starts_with("Subgroup");
  });
  if (readsWhatItWrites(reflection) || gnomon::threadsCommunicate(module))
    buildCommunicationTwins(twinModule);
  plainProgram = gpu.build(description(record, std::move(module)));
}

void Subject::buildCommunicationTwins(const SpirvWords& twinModule) {
  const GpuInfo& info = device->info();
  turned = device->build(
      description(*contract, gnomon::orderTwin(twinModule, {.subgroupSize = info.subgroupSize})));
  for (const unsigned size : info.subgroupSizes) {
    const std::size_t threads =
        std::size_t{contract->groupSize[0]} * contract->groupSize[1] * contract->groupSize[2];
    if (size == info.subgroupSize || threads > std::size_t{size} * info.maxGroupSubgroups) continue;
    ProgramDescription sized = description(*contract, twinModule);
    sized.subgroupSize = size;
    resized.emplace(size, device->build(sized));
  }
}

}  // namespace gnomon
