// The kernel under test on one device: its module and its strict twin, ready to run.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "harness/program/kernel.h"
#include "harness/program/spirv.h"
#include "harness/vulkan/gpu.h"

namespace gnomon {

/// Checked against the record before anything runs. Throws UsageError where the module's interface
/// contradicts the record, Unsupported where the device lacks what the kernel needs.
class Subject {
 public:
  /// `origin` names the module for messages: "kernels/brdf/evaluate.comp" or a user's file.
  Subject(Gpu& gpu, const KernelRecord& record, SpirvWords module, std::string origin);

  const KernelRecord& record() const { return *contract; }
  const std::string& origin() const { return file; }
  Gpu& gpu() const { return *device; }
  const GpuProgram& plain() const { return plainProgram; }
  const GpuProgram& twin() const { return twinProgram; }
  /// Threads may see each other's work: by shared memory, atomics, subgroup operations, or storage
  /// that is both read and written.
  bool threadsCommunicate() const { return turned.has_value(); }
  bool usesSubgroups() const { return subgroups; }
  /// The strict twin with the order of groups and subgroups turned round, for a kernel whose
  /// threads communicate; null for any other.
  const GpuProgram* orderTwin() const { return turned ? &*turned : nullptr; }
  /// The strict twin of such a kernel at each other subgroup size that the device can make.
  const std::map<unsigned, GpuProgram>& resizedTwins() const { return resized; }

 private:
  void buildCommunicationTwins(const SpirvWords& twinModule);

  Gpu* device;
  const KernelRecord* contract;
  std::string file;
  GpuProgram plainProgram;
  GpuProgram twinProgram;
  std::optional<GpuProgram> turned;
  std::map<unsigned, GpuProgram> resized;
  bool subgroups = false;
};

}  // namespace gnomon
