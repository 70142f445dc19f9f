// Reading, parsing, validating and rewriting SPIR-V: the strict twin decorates what it must and
// nothing else, stays valid, is its own twin, and stops a real device from contracting.
// Not covered: OpCooperativeMatrix types, kernels of the OpenCL flavour.
#include "harness/program/spirv.h"

#include <algorithm>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spirv-tools/libspirv.hpp>
#include <spirv_cross/spirv.hpp>
#include <unistd.h>

#include "harness/error.h"
#include "harness/vulkan/gpu.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

constexpr StrictOptions kAll{true, true};

testing::AssertionResult contains(const std::string& text, std::string_view part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no \"" << part << "\" in: " << text;
}

std::filesystem::path scratchFile() {
  return std::filesystem::temp_directory_path() / fmt::format("gnomon-spirv-{}.spv", getpid());
}

SpirvWords compile(const std::string& body) { return compileText("#version 450\n" + body); }

SpirvWords assemble(const std::string& text, spv_target_env target = SPV_ENV_UNIVERSAL_1_5) {
  SpirvWords words;
  EXPECT_TRUE(spvtools::SpirvTools(target).Assemble(
      text, &words, SPV_TEXT_TO_BINARY_OPTION_PRESERVE_NUMERIC_IDS));
  return words;
}

/// Opcodes of the results that carry NoContraction, in the module's order.
std::vector<std::uint16_t> decorated(const SpirvWords& words) {
  const SpirvModule module = parseSpirv(words);
  std::vector<std::uint32_t> ids;
  for (const SpirvInstruction& instruction : module.instructions) {
    const auto parts = module.wordsOf(instruction);
    if (instruction.opcode == spv::OpDecorate && parts[2] == spv::DecorationNoContraction)
      ids.push_back(parts[1]);
  }
  std::vector<std::uint16_t> opcodes;
  for (const SpirvInstruction& instruction : module.instructions)
    if (instruction.resultId != 0)
      opcodes.insert(opcodes.end(),
                     static_cast<std::size_t>(std::ranges::count(ids, instruction.resultId)),
                     instruction.opcode);
  return opcodes;
}

std::size_t countOf(const std::string& text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

const char* const kContracts = R"(
layout(local_size_x = 1) in;
layout(push_constant) uniform Push { float a, b; };
layout(set = 0, binding = 0) writeonly buffer Out { float to[]; };
void main() { to[0] = (a + b) - a; })";

const char* const kEveryKind = R"(
#extension GL_ARB_gpu_shader_fp64 : require
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) buffer Data { mat3 m; vec3 v; float f; double d; uint u; int i; };
void main() {
  v = m * v;
  v = v * m;
  m = m * m;
  m = m * f;
  m = outerProduct(v, v);
  m = transpose(m);
  v = v * f - v / f;
  f = -dot(v, v) + mod(f, 2.0);
  d = d * 3.0 + sqrt(d);
  f = float(u) + float(d);
  u = u * 2u + min(u, 3u);
  i = -i;
  f = i > 0 ? f : 1.0;
})";

// ---- the strict twin -----------------------------------------------------------------------

TEST(StrictTwin, EveryFloatResultOfArithmeticIsDecoratedAndNothingElse) {
  const std::vector<std::uint16_t> expected = {spv::OpMatrixTimesVector,
                                               spv::OpVectorTimesMatrix,
                                               spv::OpMatrixTimesMatrix,
                                               spv::OpMatrixTimesScalar,
                                               spv::OpOuterProduct,
                                               spv::OpVectorTimesScalar,
                                               spv::OpFDiv,
                                               spv::OpFSub,
                                               spv::OpDot,
                                               spv::OpFNegate,
                                               spv::OpFMod,
                                               spv::OpFAdd,
                                               spv::OpFMul,
                                               spv::OpExtInst,
                                               spv::OpFAdd,
                                               spv::OpFAdd};
  std::vector<std::uint16_t> got = decorated(strictTwin(compile(kEveryKind), {}));
  // v / f with a scalar f is a product with 1 / f in a vector: the same opcodes, perhaps more.
  EXPECT_EQ(got, expected);
}

TEST(StrictTwin, TwinsAreValid) {
  for (const char* const body : {kContracts, kEveryKind})
    EXPECT_EQ(validateSpirv(strictTwin(compile(body), kAll)), "");
}

TEST(StrictTwin, TheTwinOfATwinIsItself) {
  const SpirvWords twin = strictTwin(compile(kEveryKind), kAll);
  EXPECT_TRUE(strictTwin(twin, kAll) == twin);
}

TEST(StrictTwin, NothingButDeclarationsIsAdded) {
  const SpirvWords plain = compile(kEveryKind);
  const SpirvWords twin = strictTwin(plain, kAll);
  SpirvWords without(twin.begin(), twin.begin() + 5);
  const SpirvModule module = parseSpirv(twin);
  for (const SpirvInstruction& instruction : module.instructions) {
    const auto words = module.wordsOf(instruction);
    const bool added =
        (instruction.opcode == spv::OpDecorate && words[2] == spv::DecorationNoContraction) ||
        (instruction.opcode == spv::OpExecutionMode && words[2] != spv::ExecutionModeLocalSize) ||
        (instruction.opcode == spv::OpCapability && words[1] >= spv::CapabilityDenormPreserve);
    if (!added) without.insert(without.end(), words.begin(), words.end());
  }
  EXPECT_TRUE(without == plain);
}

TEST(StrictTwin, ModesAreDeclaredOnlyWhereAllowed) {
  const SpirvWords plain = compile(kContracts);
  const std::string none = disassemble(strictTwin(plain, {}));
  EXPECT_EQ(countOf(none, "RoundingModeRTE") + countOf(none, "SignedZeroInfNanPreserve"), 0u);
  const std::string both = disassemble(strictTwin(plain, kAll));
  EXPECT_TRUE(contains(both, "OpExecutionMode %main RoundingModeRTE 32"));
  EXPECT_TRUE(contains(both, "OpExecutionMode %main SignedZeroInfNanPreserve 32"));
  EXPECT_EQ(countOf(both, "SPV_KHR_float_controls"), 0u);  // in SPIR-V 1.5 it is core
}

// Two entry points, one of them with modes of its own; a decoration group; SPIR-V 1.0.
std::string oldModule(const std::string& moreModes = "", const std::string& declarations = "") {
  return R"(
               OpCapability Shader
)" + declarations +
         R"(
               OpMemoryModel Logical GLSL450
               OpEntryPoint GLCompute %1 "first"
               OpEntryPoint GLCompute %2 "second"
               OpExecutionMode %1 LocalSize 1 1 1
               OpExecutionMode %2 LocalSize 1 1 1
)" + moreModes +
         R"(
               OpDecorate %3 NoContraction
          %3 = OpDecorationGroup
               OpGroupDecorate %3 %20
       %void = OpTypeVoid
      %float = OpTypeFloat 32
        %int = OpTypeInt 32 1
          %9 = OpTypeFunction %void
      %two   = OpConstant %float 2
      %three = OpConstant %int 3
          %1 = OpFunction %void None %9
         %10 = OpLabel
         %20 = OpFMul %float %two %two
         %21 = OpFAdd %float %20 %two
         %22 = OpIAdd %int %three %three
               OpReturn
               OpFunctionEnd
          %2 = OpFunction %void None %9
         %11 = OpLabel
               OpReturn
               OpFunctionEnd
)";
}

TEST(StrictTwin, BeforeVersion14TheExtensionIsDeclared) {
  const SpirvWords twin = strictTwin(assemble(oldModule(), SPV_ENV_UNIVERSAL_1_0), kAll);
  EXPECT_EQ(validateSpirv(twin), "");
  const std::string text = disassemble(twin);
  EXPECT_EQ(countOf(text, "OpExtension \"SPV_KHR_float_controls\""), 1u);
  EXPECT_EQ(countOf(text, "RoundingModeRTE 32"), 2u);
  EXPECT_TRUE(strictTwin(twin, kAll) == twin);
}

TEST(StrictTwin, WhatADecorationGroupDecoratesIsNotDecoratedAgain) {
  const SpirvWords twin = strictTwin(assemble(oldModule()), {});
  EXPECT_EQ(countOf(disassemble(twin), "NoContraction"), 2u);  // the group and %21
  EXPECT_EQ(decorated(twin), (std::vector<std::uint16_t>{spv::OpDecorationGroup, spv::OpFAdd}));
}

TEST(StrictTwin, AnEntryPointKeepsItsOwnRounding) {
  const std::string own = "OpExecutionMode %1 RoundingModeRTZ 32";
  SpirvWords plain = assemble(oldModule(own));
  const std::string text = disassemble(strictTwin(plain, {.roundingModeRte = true}));
  EXPECT_EQ(countOf(text, "RoundingModeRTE 32"), 1u);  // on the second
  EXPECT_EQ(countOf(text, "RoundingModeRTZ 32"), 1u);
}

TEST(StrictTwin, WhatTheModuleDeclaresAlreadyIsNotDeclaredAgain) {
  const std::string text = disassemble(strictTwin(
      assemble(oldModule("OpExecutionMode %1 RoundingModeRTE 32",
                         "OpCapability RoundingModeRTE\nOpExtension \"SPV_KHR_float_controls\""),
               SPV_ENV_UNIVERSAL_1_0),
      {.roundingModeRte = true}));
  EXPECT_EQ(countOf(text, "OpCapability RoundingModeRTE"), 1u);
  EXPECT_EQ(countOf(text, "SPV_KHR_float_controls"), 1u);
  EXPECT_EQ(countOf(text, "RoundingModeRTE 32"), 2u);  // one on each entry point
}

TEST(StrictTwin, ItStopsTheDeviceFromContracting) {
  Gpu gpu(Gpu::Options{});
  const auto evaluate = [&](SpirvWords words) {
    ProgramDescription description;
    description.spirv = std::move(words);
    description.slots = {BindingSlot{0, 0}};
    description.pushBytes = 8;
    const GpuProgram program = gpu.build(description);
    const GpuBuffer to = gpu.allocate(4);
    const float push[2] = {1e8f, 1.0f};
    Dispatch dispatch;
    dispatch.program = &program;
    dispatch.buffers = {{description.slots[0], &to}};
    const auto bytes = std::as_bytes(std::span(push));
    dispatch.push = {bytes.begin(), bytes.end()};
    gpu.run(std::span(&dispatch, 1), std::chrono::seconds(20));
    float result = -1;
    gpu.download(to, 0, std::as_writable_bytes(std::span(&result, 1)));
    return result;
  };
  const SpirvWords plain = compile(kContracts);
  const StrictOptions allowed{gpu.info().signedZeroInfNanFloat32, gpu.info().roundingRteFloat32};
  // In float, 1e8 + 1 is 1e8. A device may still answer 1 for the plain module; llvmpipe does.
  EXPECT_EQ(evaluate(strictTwin(plain, allowed)), 0.0f);
  const float contracted = evaluate(plain);
  EXPECT_EQ(contracted, gpu.info().name.starts_with("llvmpipe") ? 1.0f : contracted);
  EXPECT_EQ(gpu.takeMessages(), std::vector<std::string>());
}

// ---- malformed input -----------------------------------------------------------------------

TEST(Spirv, TruncatedModulesAreRefused) {
  const SpirvWords whole = compile(kContracts);
  std::size_t refused = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    try {
      strictTwin(std::span(whole).first(size), kAll);
    } catch (const UsageError&) {
      ++refused;
    }
    EXPECT_NE(validateSpirv(std::span(whole).first(size)), "") << size;
  }
  // A cut between two instructions leaves a module that still parses.
  EXPECT_GT(refused, whole.size() / 2);
}

TEST(Spirv, FlippedBitsAreRefusedOrParsedAndNeverCrash) {
  const SpirvWords whole = compile(kEveryKind);
  std::uint32_t state = 1;
  const auto next = [&state] { return state = state * 1664525u + 1013904223u; };
  std::size_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    SpirvWords broken = whole;
    for (int k = 0; k < 3; ++k) broken[(next() >> 8) % broken.size()] ^= 1u << (next() >> 27);
    try {
      strictTwin(broken, kAll);
    } catch (const UsageError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100u);
}

TEST(Spirv, ValidationNamesTheFirstRuleThatIsBroken) {
  SpirvWords words = compile(kContracts);
  const SpirvModule module = parseSpirv(words);
  const auto add = std::ranges::find(module.instructions, spv::OpFAdd, &SpirvInstruction::opcode);
  ASSERT_NE(add, module.instructions.end());
  words[add->offset] = (words[add->offset] & ~spv::OpCodeMask) | spv::OpIAdd;
  EXPECT_TRUE(contains(validateSpirv(words), "IAdd"));
  EXPECT_THROW(disassemble({}), UsageError);
}

// ---- files ---------------------------------------------------------------------------------

/// Writes bytes to a scratch file and says what reading it as SPIR-V answers.
std::string refusal(std::string_view bytes) {
  const std::filesystem::path file = scratchFile();
  std::ofstream(file, std::ios::binary) << bytes;
  std::string text;
  try {
    readSpirv(file);
  } catch (const UsageError& error) {
    text = error.what();
  }
  std::filesystem::remove(file);
  return text;
}

TEST(Spirv, FilesOfEitherEndiannessAreTheSameModule) {
  const SpirvWords words = compile(kContracts);
  for (const bool swapped : {false, true}) {
    std::string bytes(reinterpret_cast<const char*>(words.data()), words.size() * 4);
    for (std::size_t i = 0; swapped && i < bytes.size(); i += 4)
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                   bytes.begin() + static_cast<std::ptrdiff_t>(i + 4));
    const std::filesystem::path file = scratchFile();
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_TRUE(readSpirv(file) == words) << "swapped: " << swapped;
    std::filesystem::remove(file);
  }
}

TEST(Spirv, FilesThatAreNoSpirvAreRefusedByName) {
  EXPECT_TRUE(contains(refusal("abc"), "not a multiple of four"));
  EXPECT_TRUE(contains(refusal("abcd"), "magic number"));
  EXPECT_TRUE(contains(refusal(""), "magic number"));
  EXPECT_TRUE(contains(refusal("abc"), scratchFile().string()));
  EXPECT_THROW(readSpirv("/nowhere.spv"), UsageError);
  EXPECT_THROW(readSpirv(std::filesystem::temp_directory_path()), UsageError);
}

}  // namespace
}  // namespace gnomon
