#include "harness/program/compile.h"

#include <fstream>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include "harness/error.h"
#include "harness/program/spirv.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

// Limits on hostile includes: a file that includes itself, once (depth) or twice (count). Real
// shader trees stay far below (the largest engine shaders open a few hundred files).
constexpr std::size_t kMaxIncludeDepth = 64;
constexpr std::size_t kMaxIncludes = 1000;
constexpr std::size_t kMaxBytes = 16u << 20;
constexpr std::size_t kMaxErrorLines = 10;
constexpr std::size_t kMaxErrorColumns = 500;

/// The file's text; nothing where it cannot be read.
std::optional<std::string> readText(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

/// Finds #include "name" beside the including file, then in the include folders, and #include
/// <name> in these folders only.
class Includer final : public glslang::TShader::Includer {
 public:
  explicit Includer(const std::vector<fs::path>& includeFolders) : folders(includeFolders) {}

  IncludeResult* includeLocal(const char* name, const char* includer, std::size_t depth) override {
    return open(fs::path(includer).parent_path() / name, depth);
  }

  IncludeResult* includeSystem(const char* name, const char*, std::size_t depth) override {
    for (const fs::path& folder : folders)
      if (IncludeResult* found = open(folder / name, depth)) return found;
    return refused.empty() ? nullptr : failure();
  }

  void releaseInclude(IncludeResult* result) override {
    if (result == nullptr) return;
    delete static_cast<std::string*>(result->userData);
    delete result;
  }

 private:
  IncludeResult* open(const fs::path& file, std::size_t depth) {
    if (depth > kMaxIncludeDepth)
      refused = fmt::format("includes nest deeper than {}", kMaxIncludeDepth);
    if (count >= kMaxIncludes) refused = fmt::format("more than {} includes", kMaxIncludes);
    if (bytes > kMaxBytes) refused = fmt::format("includes of more than {} bytes", kMaxBytes);
    if (!refused.empty()) return nullptr;
    std::optional<std::string> text = readText(file);
    if (!text) return nullptr;
    ++count;
    bytes += text->size();
    auto owned = std::make_unique<std::string>(std::move(*text));
    auto* result = new IncludeResult(file.string(), owned->data(), owned->size(), owned.get());
    owned.release();  // releaseInclude() deletes it
    return result;
  }

  /// An empty name tells glslang that the text is an error message.
  IncludeResult* failure() const {
    return new IncludeResult("", refused.data(), refused.size(), nullptr);
  }

  const std::vector<fs::path>& folders;
  std::string refused;  ///< once a limit is passed, every further include fails with this
  std::size_t count = 0;
  std::size_t bytes = 0;
};

EShLanguage stageOf(const fs::path& file, const std::string& stage) {
  const std::string ending = stage.empty() ? file.extension().string() : stage;
  if (ending == ".comp") return EShLangCompute;
  if (ending == ".vert") return EShLangVertex;
  if (ending == ".frag") return EShLangFragment;
  throw UsageError(fmt::format(
      "{}: the ending must say what it is: .comp, .vert or .frag (GLSL), .hlsl, .spv or .json",
      file.string()));
}

std::string readShader(const fs::path& file) {
  std::optional<std::string> text = readText(file);
  if (!text) throw UsageError(fmt::format("{}: no such file, or not readable", file.string()));
  if (text->find('\0') != std::string::npos)
    throw UsageError(fmt::format("{}: not a text file (it holds a zero byte)", file.string()));
  if (text->size() > kMaxBytes)
    throw UsageError(fmt::format("{}: larger than {} bytes", file.string(), kMaxBytes));
  return std::move(*text);
}

/// Whether glslang put "file:line: " first; it knows no place for link errors and #version.
bool hasPlace(std::string_view message) {
  const std::size_t colon = message.find(": ");
  return colon != std::string_view::npos && colon > 0 && message[colon - 1] >= '0' &&
         message[colon - 1] <= '9';
}

/// Lines that count or end errors instead of telling one.
bool isSummary(std::string_view line) {
  return line.find("No code generated") != line.npos ||
         line.find("compilation terminated") != line.npos;
}

/// glslang's log without prefixes and summaries: "a.comp:3: 'x' : undeclared identifier".
std::string firstErrors(const char* log, const fs::path& file) {
  constexpr std::string_view kError = "ERROR: ";
  std::istringstream lines{std::string(log)};
  std::vector<std::string> errors;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(kError) || isSummary(line)) continue;
    const std::string message = line.substr(kError.size(), kMaxErrorColumns);
    errors.push_back(hasPlace(message) ? message : fmt::format("{}: {}", file.string(), message));
  }
  if (errors.empty()) return fmt::format("{}: does not compile", file.string());
  if (const std::size_t all = errors.size(); all > kMaxErrorLines) {
    errors.resize(kMaxErrorLines - 1);
    errors.push_back(fmt::format("... and {} more", all - kMaxErrorLines + 1));
  }
  return fmt::format("{}", fmt::join(errors, "\n"));
}

void prepare(glslang::TShader& shader, EShLanguage stage, const std::string& preamble,
             const CompileOptions& options) {
  shader.setPreamble(preamble.c_str());
  for (const auto& [name, value] : options.defines)
    shader.addProcesses({fmt::format("define-macro {}={}", name, value)});
  if (options.hlsl || options.entryPoint != "main") {
    shader.setEntryPoint(options.entryPoint.c_str());
    shader.setSourceEntryPoint(options.hlsl ? options.entryPoint.c_str() : "main");
  }
  shader.setEnvInput(options.hlsl ? glslang::EShSourceHlsl : glslang::EShSourceGlsl, stage,
                     glslang::EShClientVulkan, 100);
  shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_2);
  // glslang's HLSL declares buffers as SPIR-V 1.3 still allowed.
  shader.setEnvTarget(glslang::EShTargetSpv,
                      options.hlsl ? glslang::EShTargetSpv_1_3 : glslang::EShTargetSpv_1_5);
  // Not setDebugInfo(): that is for NonSemantic.Shader.DebugInfo, and without its instruction set
  // glslang 12 writes lexical scopes that refer to id 0.
}

std::string preambleOf(const CompileOptions& options) {
  std::string text;
  for (const auto& [name, value] : options.defines)
    text += fmt::format("#define {} {}\n", name, value);
  return text;
}

SpirvWords generate(const glslang::TIntermediate& program) {
  glslang::SpvOptions options;
  options.generateDebugInfo = true;
  SpirvWords words;
  glslang::GlslangToSpv(program, words, &options);
  return words;
}

SpirvWords compile(const fs::path& file, EShLanguage stage, const std::string& text,
                   const CompileOptions& options) {
  const auto messages =
      static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules | EShMsgDebugInfo |
                               (options.hlsl ? EShMsgReadHlsl | EShMsgHlslOffsets : 0));
  constexpr int kVersionWithoutDirective = 100;  // glslangValidator's
  const std::string name = file.string();
  const std::string preamble = preambleOf(options);
  const char* texts[] = {text.data()};
  const int lengths[] = {static_cast<int>(text.size())};
  const char* names[] = {name.c_str()};
  Includer includer(options.includeFolders);

  glslang::TShader shader(stage);
  shader.setStringsWithLengthsAndNames(texts, lengths, names, 1);
  prepare(shader, stage, preamble, options);
  if (!shader.parse(GetDefaultResources(), kVersionWithoutDirective, false, messages, includer))
    throw UsageError(firstErrors(shader.getInfoLog(), file));
  glslang::TProgram program;
  program.addShader(&shader);
  if (!program.link(messages) || !program.mapIO())
    throw UsageError(firstErrors(program.getInfoLog(), file));
  return generate(*program.getIntermediate(stage));
}

}  // namespace

std::vector<std::uint32_t> compileText(const fs::path& file, const std::string& text,
                                       const CompileOptions& options) {
  static std::once_flag initialized;
  std::call_once(initialized, glslang::InitializeProcess);
  SpirvWords words = compile(file, stageOf(file, options.stage), text, options);
  if (options.hlsl) words = legalized(words);
  if (const std::string complaint = validateSpirv(words); !complaint.empty())
    throw UsageError(fmt::format("{}: compiles to invalid SPIR-V: {}", file.string(), complaint));
  return words;
}

std::vector<std::uint32_t> compileShader(const fs::path& file, const CompileOptions& options) {
  stageOf(file, options.stage);  // before a file that may not be text is read
  return compileText(file, readShader(file), options);
}

}  // namespace gnomon
