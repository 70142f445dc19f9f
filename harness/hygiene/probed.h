// A kernel compiled again with its probes on (kernels/lib/probe.glsl): the same computation, which
// keeps the intermediates that it names in one more buffer.
#pragma once

#include <filesystem>
#include <optional>

#include "harness/hygiene/subject.h"

namespace gnomon {

/// What the record of a probed kernel calls the output of its probes.
inline constexpr const char* kProbesOutput = "gnomonProbes";

class ProbedKernel {
 public:
  /// Compiles the file as --kernel does. The buffer is bound in set 0, behind everything that the
  /// usual kernel binds there. Throws what loadKernel and Subject throw.
  ProbedKernel(const Subject& usual, const std::filesystem::path& file,
               const std::filesystem::path& kernels);
  ProbedKernel(const ProbedKernel&) = delete;
  ProbedKernel& operator=(const ProbedKernel&) = delete;

  /// Null where the kernel names no intermediates: it has no probes, is HLSL or SPIR-V.
  const Subject* subject() const { return built ? &*built : nullptr; }

 private:
  KernelRecord record;  ///< the usual one's, and the buffer
  std::optional<Subject> built;
};

}  // namespace gnomon
