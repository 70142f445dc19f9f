// Somebody's kernel as a file becomes a module that can be judged: GLSL, HLSL, SPIR-V, or a JSON
// adapter that describes one of them.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "harness/program/adapter.h"
#include "harness/program/kernel.h"
#include "harness/program/spirv.h"

namespace gnomon {

/// A valid compute module and what is known of it.
struct KernelModule {
  SpirvWords words{};
  std::string origin{};  ///< for messages: "kernels/brdf/evaluate.comp" or a user's file
  std::string entryPoint = "main";
  std::optional<Adapter> adapter{};
};

/// Loads a file for this entry: .comp (GLSL), .hlsl, .spv, or .json. Includes are looked for beside
/// the file, in the adapter's folders, and in the stage's and all kernels' folders. Storage images
/// lose their format qualifiers, so that their arithmetic can be judged in floats. Throws
/// UsageError with file, cause and remedy. `defines` come on top of the adapter's.
KernelModule loadKernel(const std::filesystem::path& file, const KernelRecord& record,
                        const std::filesystem::path& kernels,
                        const std::map<std::string, std::string>& defines = {});

}  // namespace gnomon
