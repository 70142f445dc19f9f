// GLSL to SPIR-V at run time, through glslang, with the project's include folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gnomon {

struct CompileOptions {
  std::vector<std::filesystem::path> includeFolders{};
  std::map<std::string, std::string> defines{};
  std::string entryPoint = "main";
};

/// Compiles one GLSL file (the stage follows from its ending: .comp, .vert, .frag) to SPIR-V 1.5
/// for Vulkan 1.2 with names and lines kept, and validates the result. Throws UsageError with the
/// file and glslang's first errors (at most ten lines): file missing, not text, does not compile.
std::vector<std::uint32_t> compileGlsl(const std::filesystem::path& file,
                                       const CompileOptions& options);

}  // namespace gnomon
