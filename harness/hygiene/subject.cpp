#include "harness/hygiene/subject.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/error.h"
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

ProgramDescription description(const KernelRecord& record, SpirvWords module) {
  ProgramDescription d{.spirv = std::move(module)};
  for (const BufferSpec& b : record.buffers) d.slots.push_back({.set = 0, .binding = b.binding});
  d.pushBytes = record.push.size;
  d.specialization = record.specialization;
  return d;
}

}  // namespace

Subject::Subject(Gpu& gpu, const KernelRecord& record, SpirvWords module, std::string origin)
    : device(&gpu), contract(&record), file(std::move(origin)) {
  if (const auto why = gpu.info().lacks(record.features)) throw Unsupported(*why);
  refuseWhatContradicts(record, reflect(module), file);
  const StrictOptions strict{.signedZeroInfNanPreserve = gpu.info().signedZeroInfNanFloat32,
                             .roundingModeRte = gpu.info().roundingRteFloat32};
  twinProgram = gpu.build(description(record, strictTwin(module, strict)));
  plainProgram = gpu.build(description(record, std::move(module)));
}

}  // namespace gnomon
