#include "tests/harness/glsl.h"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

namespace gnomon {
namespace {

/// Of this process and this call alone; gone even where the text does not compile.
class ShaderFile {
 public:
  ShaderFile(const std::string& text, const std::string& ending) {
    static int count = 0;
    file = std::filesystem::temp_directory_path() /
           fmt::format("gnomon-test-{}-{}{}", getpid(), count++, ending);
    std::ofstream(file, std::ios::binary) << text;
  }
  ~ShaderFile() {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }
  ShaderFile(const ShaderFile&) = delete;
  ShaderFile& operator=(const ShaderFile&) = delete;
  const std::filesystem::path& path() const { return file; }

 private:
  std::filesystem::path file;
};

}  // namespace

SpirvWords compileText(const std::string& glsl, const std::string& ending,
                       const CompileOptions& options) {
  const ShaderFile file(glsl, ending);
  return compileGlsl(file.path(), options);
}

}  // namespace gnomon
