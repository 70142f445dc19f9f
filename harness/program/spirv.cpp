#include "harness/program/spirv.h"

#include <algorithm>
#include <bit>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <spirv-tools/libspirv.h>
#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>
#include <spirv_cross/spirv.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

std::uint32_t swapBytes(std::uint32_t word) {
  return word >> 24 | (word >> 8 & 0xff00u) | (word << 8 & 0xff0000u) | word << 24;
}

std::string readBytes(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw UsageError(fmt::format("{}: no such file", file.string()));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw UsageError(fmt::format("{}: cannot be read", file.string()));
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// SPIRV-Tools reports through a callback; the first message is the one that matters.
struct FirstMessage {
  std::string text;

  spvtools::MessageConsumer consumer() {
    return [this](spv_message_level_t, const char*, const spv_position_t& at, const char* message) {
      if (text.empty()) text = at.index == 0 ? message : fmt::format("{}: {}", at.index, message);
    };
  }
};

}  // namespace

SpirvWords readSpirv(const std::filesystem::path& file) {
  const std::string bytes = readBytes(file);
  if (bytes.size() % sizeof(std::uint32_t) != 0)
    throw UsageError(fmt::format("{}: {} bytes are no SPIR-V: not a multiple of four",
                                 file.string(), bytes.size()));
  SpirvWords words(bytes.size() / sizeof(std::uint32_t));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(words.data()));
  if (!words.empty() && words[0] == swapBytes(spv::MagicNumber))
    std::transform(words.begin(), words.end(), words.begin(), swapBytes);
  if (words.empty() || words[0] != spv::MagicNumber)
    throw UsageError(fmt::format("{}: no SPIR-V: it does not begin with the magic number 07230203",
                                 file.string()));
  return words;
}

void appendInstruction(SpirvWords& words, std::uint32_t opcode, const SpirvWords& operands) {
  const auto length = static_cast<std::uint32_t>(operands.size() + 1);
  words.push_back(length << spv::WordCountShift | opcode);
  words.insert(words.end(), operands.begin(), operands.end());
}

std::string validateSpirv(std::span<const std::uint32_t> module) {
  FirstMessage message;
  spvtools::SpirvTools tools(SPV_ENV_VULKAN_1_2);
  tools.SetMessageConsumer(message.consumer());
  spvtools::ValidatorOptions options;
  options.SetScalarBlockLayout(true);
  options.SetFriendlyNames(true);
  if (tools.Validate(module.data(), module.size(), options)) return {};
  return message.text.empty() ? "invalid SPIR-V" : message.text;
}

std::string disassemble(std::span<const std::uint32_t> module) {
  FirstMessage message;
  spvtools::SpirvTools tools(SPV_ENV_UNIVERSAL_1_6);
  tools.SetMessageConsumer(message.consumer());
  std::string text;
  if (!tools.Disassemble(module.data(), module.size(), &text))
    throw UsageError(fmt::format("malformed SPIR-V: {}", message.text));
  return text;
}

std::span<const std::uint32_t> SpirvModule::wordsOf(const SpirvInstruction& instruction) const {
  return std::span(words).subspan(instruction.offset, instruction.length);
}

namespace {

spv_result_t keepHeader(void* data, spv_endianness_t, std::uint32_t magic, std::uint32_t version,
                        std::uint32_t generator, std::uint32_t bound, std::uint32_t schema) {
  static_cast<SpirvModule*>(data)->words = {magic, version, generator, bound, schema};
  return SPV_SUCCESS;
}

spv_result_t keepInstruction(void* data, const spv_parsed_instruction_t* parsed) {
  auto& [words, instructions] = *static_cast<SpirvModule*>(data);
  instructions.push_back({.opcode = parsed->opcode,
                          .typeId = parsed->type_id,
                          .resultId = parsed->result_id,
                          .glsl = parsed->opcode == spv::OpExtInst &&
                                  parsed->ext_inst_type == SPV_EXT_INST_TYPE_GLSL_STD_450,
                          .offset = words.size(),
                          .length = parsed->num_words});
  words.insert(words.end(), parsed->words, parsed->words + parsed->num_words);
  return SPV_SUCCESS;
}

}  // namespace

SpirvModule parseSpirv(std::span<const std::uint32_t> module) {
  const spvtools::Context context(SPV_ENV_UNIVERSAL_1_6);
  SpirvModule parsed;
  spv_diagnostic diagnostic = nullptr;
  const spv_result_t result =
      spvBinaryParse(context.CContext(), &parsed, module.data(), module.size(), keepHeader,
                     keepInstruction, &diagnostic);
  const std::unique_ptr<spv_diagnostic_t, void (*)(spv_diagnostic)> owned(diagnostic,
                                                                          spvDiagnosticDestroy);
  if (result != SPV_SUCCESS)
    throw UsageError(fmt::format("malformed SPIR-V: {}", owned ? owned->error : "does not parse"));
  return parsed;
}

// ---- the strict twin -----------------------------------------------------------------------

namespace {

/// What an optimiser may fuse or rearrange: SPIR-V 3.42.13 "Arithmetic Instructions" on floats,
/// and the extended instructions, which the specification defines by such instructions.
/// Not conversions (one rounding each, and outside the section NoContraction is defined for), not
/// OpTranspose (moves), not derivatives, group or atomic sums (their order is open by definition).
bool isArithmetic(const SpirvInstruction& instruction) {
  switch (instruction.opcode) {
    case spv::OpFNegate:
    case spv::OpFAdd:
    case spv::OpFSub:
    case spv::OpFMul:
    case spv::OpFDiv:
    case spv::OpFRem:
    case spv::OpFMod:
    case spv::OpVectorTimesScalar:
    case spv::OpMatrixTimesScalar:
    case spv::OpVectorTimesMatrix:
    case spv::OpMatrixTimesVector:
    case spv::OpMatrixTimesMatrix:
    case spv::OpOuterProduct:
    case spv::OpDot:
      return true;
    default:
      return instruction.glsl;
  }
}

/// The sections of a module up to its annotations (SPIR-V 2.4, "Logical Layout of a Module").
bool standsBeforeTypes(std::uint16_t opcode) {
  switch (opcode) {
    case spv::OpNop:
    case spv::OpCapability:
    case spv::OpExtension:
    case spv::OpExtInstImport:
    case spv::OpMemoryModel:
    case spv::OpEntryPoint:
    case spv::OpExecutionMode:
    case spv::OpExecutionModeId:
    case spv::OpString:
    case spv::OpSourceExtension:
    case spv::OpSource:
    case spv::OpSourceContinued:
    case spv::OpName:
    case spv::OpMemberName:
    case spv::OpModuleProcessed:
    case spv::OpDecorate:
    case spv::OpMemberDecorate:
    case spv::OpDecorationGroup:
    case spv::OpGroupDecorate:
    case spv::OpGroupMemberDecorate:
    case spv::OpDecorateId:
    case spv::OpDecorateString:
    case spv::OpMemberDecorateString:
      return true;
    default:
      return false;
  }
}

/// What the twin has to know of a module, gathered in one pass.
struct Survey {
  std::set<std::uint32_t> floatTypes;     ///< scalars, vectors, matrices
  std::set<std::uint32_t> noContraction;  ///< ids that are decorated already
  std::set<std::uint32_t> capabilities;
  std::set<std::uint32_t> entryPoints;  ///< functions; two entry points may share one
  std::set<std::pair<std::uint32_t, std::uint32_t>> modes32;  ///< function, mode: for 32 bit
  bool floatControlsExtension = false;
  std::size_t afterCapabilities = 0;  ///< indices of instructions
  std::size_t afterEntryPoints = 0;
  std::size_t beforeTypes = 0;
};

constexpr const char* kFloatControls = "SPV_KHR_float_controls";

/// A literal string's words: four bytes each, little end first, closed by a zero byte.
SpirvWords stringWords(std::string_view text) {
  SpirvWords words(text.size() / 4 + 1, 0);
  for (std::size_t i = 0; i < text.size(); ++i)
    words[i / 4] |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])) << i % 4 * 8;
  return words;
}

void noteType(Survey& survey, std::span<const std::uint32_t> words) {
  switch (words[0] & spv::OpCodeMask) {
    case spv::OpTypeFloat:
      survey.floatTypes.insert(words[1]);
      break;
    case spv::OpTypeVector:
    case spv::OpTypeMatrix:
      if (survey.floatTypes.contains(words[2])) survey.floatTypes.insert(words[1]);
      break;
    default:
      break;
  }
}

void noteDecoration(Survey& survey, std::span<const std::uint32_t> words) {
  const std::uint32_t opcode = words[0] & spv::OpCodeMask;
  if (opcode == spv::OpDecorate && words[2] == spv::DecorationNoContraction)
    survey.noContraction.insert(words[1]);
  if (opcode == spv::OpGroupDecorate && survey.noContraction.contains(words[1]))
    survey.noContraction.insert(words.begin() + 2, words.end());
}

void noteInterface(Survey& survey, std::span<const std::uint32_t> words) {
  switch (words[0] & spv::OpCodeMask) {
    case spv::OpCapability:
      survey.capabilities.insert(words[1]);
      break;
    case spv::OpExtension:
      survey.floatControlsExtension |=
          std::ranges::equal(words.subspan(1), stringWords(kFloatControls));
      break;
    case spv::OpEntryPoint:
      survey.entryPoints.insert(words[2]);
      break;
    case spv::OpExecutionMode:
      if (words.size() == 4 && words[3] == 32) survey.modes32.emplace(words[1], words[2]);
      break;
    default:
      break;
  }
}

Survey surveyOf(const SpirvModule& module) {
  Survey survey;
  survey.beforeTypes = module.instructions.size();
  for (std::size_t i = 0; i < module.instructions.size(); ++i) {
    const SpirvInstruction& instruction = module.instructions[i];
    const std::span words = module.wordsOf(instruction);
    noteType(survey, words);
    noteDecoration(survey, words);
    noteInterface(survey, words);
    if (instruction.opcode == spv::OpCapability) survey.afterCapabilities = i + 1;
    if (instruction.opcode == spv::OpEntryPoint) survey.afterEntryPoints = i + 1;
    if (!standsBeforeTypes(instruction.opcode))
      survey.beforeTypes = std::min(survey.beforeTypes, i);
  }
  return survey;
}

SpirvWords noContractions(const SpirvModule& module, const Survey& survey) {
  SpirvWords words;
  for (const SpirvInstruction& instruction : module.instructions) {
    const bool wanted = isArithmetic(instruction) &&
                        survey.floatTypes.contains(instruction.typeId) &&
                        !survey.noContraction.contains(instruction.resultId);
    if (wanted)
      appendInstruction(words, spv::OpDecorate,
                        {instruction.resultId, spv::DecorationNoContraction});
  }
  return words;
}

/// The execution modes for 32 bit that entry points lack, and what declaring them takes.
struct FloatControls {
  SpirvWords declarations;  ///< capabilities and, before SPIR-V 1.4, the extension
  SpirvWords modes;

  void add(const Survey& survey, spv::ExecutionMode mode, spv::Capability capability) {
    const std::size_t before = modes.size();
    for (const std::uint32_t function : survey.entryPoints) {
      const bool contradicted =
          mode == spv::ExecutionModeRoundingModeRTE &&
          survey.modes32.contains({function, spv::ExecutionModeRoundingModeRTZ});
      if (!contradicted && !survey.modes32.contains({function, mode}))
        appendInstruction(modes, spv::OpExecutionMode,
                          {function, static_cast<std::uint32_t>(mode), 32});
    }
    if (modes.size() > before && !survey.capabilities.contains(capability))
      appendInstruction(declarations, spv::OpCapability, {static_cast<std::uint32_t>(capability)});
  }
};

FloatControls floatControls(const SpirvModule& module, const Survey& survey,
                            const StrictOptions& options) {
  FloatControls controls;
  if (options.signedZeroInfNanPreserve)
    controls.add(survey, spv::ExecutionModeSignedZeroInfNanPreserve,
                 spv::CapabilitySignedZeroInfNanPreserve);
  if (options.roundingModeRte)
    controls.add(survey, spv::ExecutionModeRoundingModeRTE, spv::CapabilityRoundingModeRTE);
  const bool inCore = module.words[1] >= 0x00010400;  // SPIR-V 1.4
  if (!controls.modes.empty() && !inCore && !survey.floatControlsExtension)
    appendInstruction(controls.declarations, spv::OpExtension, stringWords(kFloatControls));
  return controls;
}

}  // namespace

SpirvWords strictTwin(std::span<const std::uint32_t> module, const StrictOptions& options) {
  const SpirvModule parsed = parseSpirv(module);
  const Survey survey = surveyOf(parsed);
  const FloatControls controls = floatControls(parsed, survey, options);

  std::map<std::size_t, SpirvWords> insertions;  // before the instruction of that index
  const auto insert = [&](std::size_t at, const SpirvWords& words) {
    insertions[at].insert(insertions[at].end(), words.begin(), words.end());
  };
  insert(survey.afterCapabilities, controls.declarations);
  insert(survey.afterEntryPoints, controls.modes);
  insert(survey.beforeTypes, noContractions(parsed, survey));

  SpirvWords twin(parsed.words.begin(), parsed.words.begin() + kSpirvHeaderWords);
  for (std::size_t i = 0; i <= parsed.instructions.size(); ++i) {
    if (const auto found = insertions.find(i); found != insertions.end())
      twin.insert(twin.end(), found->second.begin(), found->second.end());
    if (i == parsed.instructions.size()) break;
    const std::span words = parsed.wordsOf(parsed.instructions[i]);
    twin.insert(twin.end(), words.begin(), words.end());
  }
  return twin;
}

namespace {

template <class Register>
SpirvWords optimized(std::span<const std::uint32_t> module, const Register& passes) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  FirstMessage message;
  optimizer.SetMessageConsumer(message.consumer());
  passes(optimizer);
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);  // the caller validates, with scalar block layout
  SpirvWords words;
  if (!optimizer.Run(module.data(), module.size(), &words, options))
    throw UsageError("SPIRV-Tools: " + message.text);
  return words;
}

}  // namespace

SpirvWords legalized(std::span<const std::uint32_t> module) {
  return optimized(module, [](spvtools::Optimizer& o) { o.RegisterLegalizationPasses(); });
}

SpirvWords optimizedForSpeed(std::span<const std::uint32_t> module) {
  return optimized(module, [](spvtools::Optimizer& o) {
    o.RegisterPass(spvtools::CreateStripDebugInfoPass());
    o.RegisterPerformancePasses();
  });
}

SpirvWords withoutImageFormats(std::span<const std::uint32_t> module) {
  constexpr std::size_t kSampled = 7, kFormat = 8;
  constexpr std::uint32_t kStorage = 2;
  SpirvModule parsed = parseSpirv(module);
  bool changed = false, reads = false;
  for (const SpirvInstruction& i : parsed.instructions) {
    reads |= i.opcode == spv::OpImageRead;
    if (i.opcode != spv::OpTypeImage || parsed.words[i.offset + kSampled] != kStorage) continue;
    std::uint32_t& format = parsed.words[i.offset + kFormat];
    // Atomics on an image need its format.
    if (format == spv::ImageFormatUnknown || format == spv::ImageFormatR32ui ||
        format == spv::ImageFormatR32i)
      continue;
    format = spv::ImageFormatUnknown;
    changed = true;
  }
  if (!changed) return std::move(parsed.words);
  SpirvWords capabilities;
  appendInstruction(capabilities, spv::OpCapability,
                    {spv::CapabilityStorageImageWriteWithoutFormat});
  if (reads)
    appendInstruction(capabilities, spv::OpCapability,
                      {spv::CapabilityStorageImageReadWithoutFormat});
  parsed.words.insert(parsed.words.begin() + kSpirvHeaderWords, capabilities.begin(),
                      capabilities.end());
  // Types that differed in their formats are the same now, and may stand only once.
  return optimized(parsed.words, [](spvtools::Optimizer& o) {
    o.RegisterPass(spvtools::CreateRemoveDuplicatesPass());
  });
}

}  // namespace gnomon
