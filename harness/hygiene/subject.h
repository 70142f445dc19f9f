// The kernel under test on one device: its module and its strict twin, ready to run.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "harness/program/foreign.h"
#include "harness/program/interface.h"
#include "harness/vulkan/gpu.h"

namespace gnomon {

/// Checked against the record before anything runs. Throws UsageError where the module's interface
/// contradicts the record, Unsupported where the device lacks what the kernel needs. The strict
/// twin is built at once, the rest at first use: of most mutants the twin alone is asked.
class Subject {
 public:
  Subject(Gpu& gpu, const KernelRecord& record, KernelModule module);

  const KernelRecord& record() const { return *contract; }
  const std::string& origin() const { return file; }
  Gpu& gpu() const { return *device; }
  const Interface& interface() const { return mapping; }
  const std::map<std::string, std::string>& conventions() const { return manners; }
  const GpuProgram& plain() const;
  const GpuProgram& twin() const { return twinProgram; }
  /// Threads may see each other's work: by shared memory, atomics, subgroup operations, or storage
  /// that is both read and written.
  bool threadsCommunicate() const { return communicates; }
  /// The strict twin with the order of groups and subgroups turned round, for a kernel whose
  /// threads communicate; programmer error for any other.
  const GpuProgram& orderTwin() const;
  /// The strict twin of such a kernel at each other subgroup size that the device can make.
  const std::map<unsigned, GpuProgram>& resizedTwins() const;

 private:
  ProgramDescription description(SpirvWords module) const;

  Gpu* device;
  const KernelRecord* contract;
  std::string file;
  Interface mapping;
  std::map<std::string, std::string> manners;
  SpirvWords plainModule, twinModule;
  bool communicates = false;
  GpuProgram twinProgram;
  mutable std::optional<GpuProgram> plainProgram{}, turned{};
  mutable std::optional<std::map<unsigned, GpuProgram>> resized{};
};

}  // namespace gnomon
