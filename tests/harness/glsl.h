// GLSL that stands in the text of a test, as SPIR-V.
#pragma once

#include <string>

#include "harness/program/compile.h"
#include "harness/program/spirv.h"

namespace gnomon {

/// Compiles a whole shader. `ending` tells its stage, as the name of a file would: ".comp".
inline SpirvWords compileText(const std::string& glsl, const std::string& ending = ".comp",
                              const CompileOptions& options = {}) {
  return compileText(std::filesystem::path("text" + ending), glsl, options);
}

}  // namespace gnomon
