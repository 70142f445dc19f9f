#include "harness/program/foreign.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spirv_cross/spirv.hpp>

#include "harness/error.h"
#include "harness/program/compile.h"
#include "harness/program/reflect.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

CompileOptions compileOptions(const Adapter& adapter, const KernelRecord& record,
                              const fs::path& kernels) {
  CompileOptions options{
      .includeFolders = adapter.include, .defines = adapter.defines, .entryPoint = adapter.entry};
  options.includeFolders.push_back(kernels / record.stage);
  options.includeFolders.push_back(kernels);
  return options;
}

SpirvWords validSpirv(const fs::path& file) {
  SpirvWords words = readSpirv(file);
  if (const std::string why = validateSpirv(words); !why.empty())
    throw UsageError(file.string() + ": " + why);
  return words;
}

std::string languageOf(const Adapter& adapter) {
  if (!adapter.language.empty()) return adapter.language;
  const std::string ending = adapter.compute.extension().string();
  if (ending == ".spv") return "spirv";
  return ending == ".hlsl" ? "hlsl" : "glsl";
}

void refuseUnknownSlots(const Adapter& adapter, const KernelRecord& record) {
  std::vector<std::string> names;
  for (const FunctionSlot& slot : record.functions.slots) names.push_back(slot.name);
  if (names.empty())
    throw UsageError(
        fmt::format("{}: {} takes no 'functions'", adapter.file.string(), record.name()));
  for (const auto& [name, expression] : adapter.functions)
    if (std::ranges::find(names, name) == names.end())
      throw UsageError(fmt::format("{}: 'functions' gives '{}'; {} takes {}", adapter.file.string(),
                                   name, record.name(), fmt::join(names, ", ")));
  for (const FunctionSlot& slot : record.functions.slots)
    if (!slot.push.empty() && adapter.functions.contains(slot.name) &&
        !adapter.constants.contains(slot.push))
      throw UsageError(
          fmt::format("{}: 'functions' gives '{}': say in 'constants' which {} of {} it is",
                      adapter.file.string(), slot.name, slot.push, record.name()));
}

/// The record's entry with the expressions in place of its macros and the file in place of its
/// marked include.
std::string entryAround(const Adapter& adapter, const KernelRecord& record,
                        const fs::path& kernels) {
  std::ifstream stream(kernels / record.functions.file);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  std::string theirs;
  for (const auto& [name, expression] : adapter.functions)
    theirs += fmt::format("#define GNOMON_{} ({})\n", name, expression);
  theirs += fmt::format("#include \"{}\"\n", fs::absolute(adapter.compute).string());
  const std::string marker = "#include \"FUNCTIONS\"\n";
  const std::size_t at = text.find(marker);
  if (at == std::string::npos)
    throw std::logic_error(record.functions.file + " does not include FUNCTIONS");
  return text.replace(at, marker.size(), theirs);
}

/// A slot that is not given leaves an output out, or its push constant at 0.
void leaveOut(Adapter& adapter, const KernelRecord& record) {
  for (const FunctionSlot& slot : record.functions.slots) {
    if (slot.push.empty() || adapter.functions.contains(slot.name)) continue;
    const auto [given, isNew] = adapter.constants.try_emplace(slot.push, 0);
    if (given->second != 0)
      throw UsageError(fmt::format("{}: 'constants' gives {} {}, but 'functions' gives no {}",
                                   adapter.file.string(), slot.push, given->second, slot.name));
  }
}

SpirvWords compileFunctions(Adapter& adapter, const KernelRecord& record, const fs::path& kernels) {
  refuseUnknownSlots(adapter, record);
  std::error_code ignored;
  if (!fs::is_regular_file(adapter.compute, ignored))
    throw UsageError(fmt::format("{}: no such file", adapter.compute.string()));
  leaveOut(adapter, record);
  CompileOptions options = compileOptions(adapter, record, kernels);
  options.entryPoint = adapter.entry = "main";
  options.stage = ".comp";
  const std::string text = entryAround(adapter, record, kernels);
  try {
    return compileText(kernels / record.functions.file, text, options);
  } catch (const UsageError& error) {  // it may name our entry alone
    throw UsageError(
        fmt::format("{}: with its 'functions':\n{}", adapter.file.string(), error.what()));
  }
}

SpirvWords compileAdapted(Adapter& adapter, const KernelRecord& record, const fs::path& kernels) {
  if (!adapter.functions.empty()) return compileFunctions(adapter, record, kernels);
  CompileOptions options = compileOptions(adapter, record, kernels);
  const std::string language = languageOf(adapter);
  if (language == "spirv") return validSpirv(adapter.compute);
  options.hlsl = language == "hlsl";
  options.stage = ".comp";  // whatever its ending: "files" said so
  return compileShader(adapter.compute, options);
}

/// glslang makes an empty entry point where an HLSL file has none of that name.
bool doesNothing(const SpirvWords& words) {
  bool inFunction = false;
  for (const SpirvInstruction& i : parseSpirv(words).instructions) {
    inFunction = inFunction || i.opcode == spv::OpFunction;
    if (inFunction && i.opcode != spv::OpFunction && i.opcode != spv::OpLabel &&
        i.opcode != spv::OpLine && i.opcode != spv::OpNoLine && i.opcode != spv::OpReturn &&
        i.opcode != spv::OpFunctionEnd)
      return false;
  }
  return true;
}

/// Here, where the file is known.
void refuseOtherEntries(const KernelModule& module, bool hlsl) {
  try {
    const Reflection reflection = reflect(module.words, module.entryPoint);
    if (reflection.stage != "compute")
      throw UsageError(fmt::format("'{}' is a {} shader, not a compute shader", module.entryPoint,
                                   reflection.stage));
    if (hlsl && doesNothing(module.words))
      throw UsageError(
          fmt::format("entry point '{}' is empty or not there; an adapter's 'entry' names another",
                      module.entryPoint));
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("{}: {}", module.origin, error.what()));
  }
}

}  // namespace

KernelModule loadKernel(const fs::path& file, const KernelRecord& record, const fs::path& kernels,
                        const std::map<std::string, std::string>& defines) {
  KernelModule module{.origin = file.string()};
  const std::string ending = file.extension().string();
  bool isHlsl = ending == ".hlsl";
  if (ending == ".json") {
    module.adapter = readAdapter(file);
    for (const auto& [name, value] : defines) module.adapter->defines[name] = value;
    isHlsl = module.adapter->functions.empty() && languageOf(*module.adapter) == "hlsl";
    module.words = compileAdapted(*module.adapter, record, kernels);
    module.entryPoint = module.adapter->entry;
  } else if (ending == ".spv") {
    module.words = validSpirv(file);
  } else {
    CompileOptions options = compileOptions({}, record, kernels);
    options.defines = defines;
    options.hlsl = isHlsl;
    if (isHlsl) options.stage = ".comp";
    module.words = compileShader(file, options);
  }
  module.words = withoutImageFormats(module.words);
  refuseOtherEntries(module, isHlsl);
  return module;
}

}  // namespace gnomon
