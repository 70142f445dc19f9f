// GLSL and HLSL to SPIR-V at run time, through glslang, with the project's include folder.
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
  bool hlsl = false;
  std::string stage{};  ///< ".comp", ".vert" or ".frag"; else the file's ending says it
};

/// Compiles one file to SPIR-V 1.5 for Vulkan 1.2 with names and lines kept, and validates the
/// result. Throws UsageError with the file and glslang's first errors (at most ten lines): file
/// missing, not text, does not compile.
std::vector<std::uint32_t> compileShader(const std::filesystem::path& file,
                                         const CompileOptions& options);

/// The same of a text that stands for that file: its includes are looked for beside it.
std::vector<std::uint32_t> compileText(const std::filesystem::path& file, const std::string& text,
                                       const CompileOptions& options);

}  // namespace gnomon
