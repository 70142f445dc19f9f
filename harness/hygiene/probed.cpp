#include "harness/hygiene/probed.h"

#include <algorithm>
#include <string>

#include "harness/program/reflect.h"

namespace gnomon {
namespace {

unsigned freeBinding(const Interface& interface) {
  unsigned next = 0;
  const auto pass = [&](const BindingSlot& slot) {
    if (slot.set == 0) next = std::max(next, slot.binding + 1);
  };
  for (const ModuleBuffer& b : interface.buffers) pass(b.slot);
  for (const ModuleImage& i : interface.images) pass(i.slot);
  return next;
}

}  // namespace

ProbedKernel::ProbedKernel(const Subject& usual, const std::filesystem::path& file,
                           const std::filesystem::path& kernels)
    : record(usual.record()) {
  if (record.probes.fields.empty()) return;
  const unsigned binding = freeBinding(usual.interface());
  KernelModule module =
      loadKernel(file, usual.record(), kernels, {{"GNOMON_PROBES", std::to_string(binding)}});
  const Reflection reflection = reflect(module.words, module.entryPoint);
  if (std::ranges::find(reflection.bindings, kProbesOutput, &ReflectedBinding::name) ==
      reflection.bindings.end())
    return;
  record.buffers.push_back({.name = kProbesOutput,
                            .binding = binding,
                            .access = Access::kWrite,
                            .element = record.probes});
  built.emplace(usual.gpu(), record, std::move(module));
}

}  // namespace gnomon
