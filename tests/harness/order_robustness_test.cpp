// The order twin over whatever module comes: every form of reading a built-in is redirected, twins
// of our kernels are valid, and what is malformed is refused with words. Not covered: dispatches
// with compute derivatives (lavapipe has none) and with LocalSizeId (validation for Vulkan 1.2
// refuses it), kernels that HLSL compilers make.
#include "tests/harness/order_twin.h"

#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <string_view>

#include <spirv-tools/libspirv.hpp>
#include <spirv_cross/spirv.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

SpirvWords assemble(const std::string& text, spv_target_env target) {
  SpirvWords words;
  EXPECT_TRUE(spvtools::SpirvTools(target).Assemble(text, &words));
  return words;
}

// ---- every form of module -------------------------------------------------------------------

// SPIR-V of other compilers: signed built-ins, copied pointers, OpCopyMemory, two entry points that
// see different built-ins and call one function that reads another.
std::string oldModule(const std::string& interface = "") {
  return fmt::format(R"(
               OpCapability Shader
               OpMemoryModel Logical GLSL450
               OpEntryPoint GLCompute %first "first" %global {0}
               OpEntryPoint GLCompute %main "main" %index %group %global {0}
               OpExecutionMode %first LocalSize 64 1 1
               OpExecutionMode %main LocalSize 24 2 1
               OpDecorate %global BuiltIn GlobalInvocationId
               OpDecorate %index BuiltIn LocalInvocationIndex
               OpDecorate %group BuiltIn WorkgroupId
               OpDecorate %out DescriptorSet 0
               OpDecorate %out Binding 0
               OpDecorate %array ArrayStride 4
               OpDecorate %struct Block
               OpMemberDecorate %struct 0 Offset 0
       %void = OpTypeVoid
        %int = OpTypeInt 32 1
       %uint = OpTypeInt 32 0
      %ivec3 = OpTypeVector %int 3
      %uvec3 = OpTypeVector %uint 3
       %zero = OpConstant %int 0
         %n48 = OpConstant %int 48
      %array = OpTypeRuntimeArray %int
     %struct = OpTypeStruct %array
     %inInt3 = OpTypePointer Input %ivec3
      %inInt = OpTypePointer Input %int
    %inUint3 = OpTypePointer Input %uvec3
     %inUint = OpTypePointer Input %uint
   %uniforms = OpTypePointer StorageBuffer %struct
    %uniform = OpTypePointer StorageBuffer %int
   %local    = OpTypePointer Function %int
     %global = OpVariable %inInt3 Input
      %index = OpVariable %inInt Input
      %group = OpVariable %inUint3 Input
        %out = OpVariable %uniforms StorageBuffer
     %action = OpTypeFunction %void
     %getter = OpTypeFunction %int
       %getX = OpFunction %int None %getter
          %a = OpLabel
          %b = OpAccessChain %inInt %global %zero
          %c = OpCopyObject %inInt %b
          %d = OpLoad %int %c
               OpReturnValue %d
               OpFunctionEnd
      %first = OpFunction %void None %action
          %e = OpLabel
          %f = OpFunctionCall %int %getX
          %g = OpAccessChain %uniform %out %zero %f
               OpStore %g %f
               OpReturn
               OpFunctionEnd
       %main = OpFunction %void None %action
          %h = OpLabel
       %copy = OpVariable %local Function
          %i = OpFunctionCall %int %getX
               OpCopyMemory %copy %index
          %k = OpLoad %int %copy
          %l = OpCopyObject %inUint3 %group
          %m = OpInBoundsAccessChain %inUint %l %zero
          %n = OpLoad %uint %m
          %o = OpIMul %int %n %n48
          %p = OpIAdd %int %o %k
          %q = OpAccessChain %uniform %out %zero %p
          %r = OpLoad %int %q
          %s = OpIAdd %int %r %p
               OpStore %q %s
               OpReturn
               OpFunctionEnd
)",
                     interface);
}

struct Form {
  spv_target_env target;
  const char* interface;
};

constexpr Form kForms[] = {{SPV_ENV_UNIVERSAL_1_3, ""}, {SPV_ENV_UNIVERSAL_1_5, "%out"}};

TEST_F(OrderTwin, TwinsOfModulesFromOtherCompilersAreValidAndRun) {
  for (const auto& [target, interface] : kForms) {
    const SpirvWords plain = assemble(oldModule(interface), target);
    ASSERT_EQ(validateSpirv(plain), "");
    const SpirvWords twin = twinOf(plain);
    ASSERT_EQ(validateSpirv(twin), "");
    ASSERT_EQ(validateSpirv(twinOf(twin)), "");
    Words expected(48 * 4);
    std::iota(expected.begin(), expected.end(), 0u);
    EXPECT_EQ(run(twin, {4, 1, 1}, Words(48 * 4, 0)), expected);
  }
}

TEST_F(OrderTwin, NothingButThePrologueReadsTheDevicesOwnBuiltIns) {
  const SpirvWords module = assemble(oldModule(), SPV_ENV_UNIVERSAL_1_3);
  const auto count = [](const std::string& text, std::string_view part) {
    std::size_t found = 0;
    for (std::size_t at = 0; (at = text.find(part, at)) != text.npos; ++at) ++found;
    return found;
  };
  const std::string plain = disassemble(module), twin = disassemble(twinOf(module));
  for (const char* const read :
       {"AccessChain %_ptr_Input_int ", "AccessChain %_ptr_Input_uint ",
        "OpCopyObject %_ptr_Input_int ", "OpCopyObject %_ptr_Input_v3uint "}) {
    EXPECT_EQ(count(plain, read), 1u) << read << "in\n" << plain;
    EXPECT_EQ(count(twin, read), 0u) << read << "in\n" << twin;
  }
  EXPECT_EQ(count(plain, "%gl_LocalInvocationIndex\n"), 1u) << plain;  // OpCopyMemory
  EXPECT_EQ(count(twin, "OpLoad %int %gl_LocalInvocationIndex\n"), 2u) << twin;
  EXPECT_EQ(count(twin, "%gl_LocalInvocationIndex\n"), 3u) << twin;  // these, and an interface
}

TEST_F(OrderTwin, GroupSizesByIdAreFollowed) {
  const SpirvWords twin = twinOf(assemble(R"(
               OpCapability Shader
               OpMemoryModel Logical GLSL450
               OpEntryPoint GLCompute %main "main" %index
               OpExecutionModeId %main LocalSizeId %x %y %y
               OpDecorate %index BuiltIn LocalInvocationIndex
               OpDecorate %x SpecId 3
       %void = OpTypeVoid
        %int = OpTypeInt 32 1
       %uint = OpTypeInt 32 0
          %x = OpSpecConstant %uint 32
          %y = OpConstant %int 2
      %input = OpTypePointer Input %uint
      %index = OpVariable %input Input
     %action = OpTypeFunction %void
       %main = OpFunction %void None %action
          %a = OpLabel
          %b = OpLoad %uint %index
               OpReturn
               OpFunctionEnd)",
                                          SPV_ENV_UNIVERSAL_1_5));
  spvtools::ValidatorOptions options;
  spvValidatorOptionsSetAllowLocalSizeId(options, true);
  spvtools::SpirvTools tools(SPV_ENV_VULKAN_1_2);
  std::string complaint;
  tools.SetMessageConsumer([&](auto, auto, auto&, const char* message) { complaint = message; });
  EXPECT_TRUE(tools.Validate(twin.data(), twin.size(), options)) << complaint;
}

TEST_F(OrderTwin, TwinsWithComputeDerivativesAreValid) {
  const SpirvWords plain = compile(R"(
#extension GL_NV_compute_shader_derivatives : require
layout(local_size_x = 64, derivative_group_linearNV) in;
layout(set = 0, binding = 0) buffer Out { float to[]; };
void main() { to[gl_LocalInvocationIndex] = dFdx(float(gl_LocalInvocationID.x)); })");
  EXPECT_EQ(validateSpirv(twinOf(plain)), "");
}

TEST_F(OrderTwin, AKernelThatReadsNoBuiltInIsItsOwnTwin) {
  const SpirvWords plain = compile(
      "layout(local_size_x = 1) in; layout(set = 0, binding = 0) buffer B { uint b; };"
      "void main() { b = gl_NumWorkGroups.x; }");
  EXPECT_TRUE(twinOf(plain) == plain);
}

TEST_F(OrderTwin, TwinsOfEveryKernelAreValid) {
  const std::filesystem::path kernels = std::filesystem::path(GNOMON_SOURCE_DIR) / "kernels";
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kernels)) {
    if (entry.path().extension() != ".comp") continue;
    const SpirvWords plain = compileShader(entry.path(), {.includeFolders = {kernels}});
    EXPECT_EQ(validateSpirv(twinOf(plain)), "") << entry.path();
    EXPECT_EQ(validateSpirv(strictTwin(twinOf(plain), {true, true})), "") << entry.path();
    ++count;
  }
  EXPECT_GT(count, 0u);
}

// ---- malformed input ------------------------------------------------------------------------

std::string refusal(std::span<const std::uint32_t> module) {
  try {
    orderTwin(module, {8});
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

TEST_F(OrderTwin, EveryTruncatedModuleIsRefused) {
  const SpirvWords glsl = compile(localSize({64, 1, 1}) + kIdentity);
  const SpirvWords assembled = assemble(oldModule(), SPV_ENV_UNIVERSAL_1_3);
  for (const SpirvWords& whole : {glsl, assembled})
    for (std::size_t size = 0; size < whole.size(); ++size)
      ASSERT_NE(refusal(std::span(whole).first(size)), "") << size;
}

TEST_F(OrderTwin, FlippedBitsAreRefusedOrRewrittenAndNeverCrash) {
  const SpirvWords whole = compile(localSize({64, 1, 1}) + kIdentity);
  std::uint32_t state = 1;
  const auto next = [&state] { return state = state * 1664525u + 1013904223u; };
  std::size_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    SpirvWords broken = whole;
    for (int k = 0; k < 3; ++k) broken[(next() >> 8) % broken.size()] ^= 1u << (next() >> 27);
    refused += !refusal(broken).empty();
  }
  EXPECT_GT(refused, 100u);
}

TEST_F(OrderTwin, WhatIsNoComputeShaderIsRefusedByName) {
  EXPECT_NE(refusal(assemble(R"(
               OpCapability Shader
               OpMemoryModel Logical GLSL450
               OpEntryPoint Vertex %main "transform"
       %void = OpTypeVoid
     %action = OpTypeFunction %void
       %main = OpFunction %void None %action
          %a = OpLabel
               OpReturn
               OpFunctionEnd)",
                             SPV_ENV_UNIVERSAL_1_3))
                .find("\"transform\" is no compute shader"),
            std::string::npos);
  EXPECT_NE(refusal(assemble("OpCapability Shader\nOpCapability Linkage\n"
                             "OpMemoryModel Logical GLSL450",
                             SPV_ENV_UNIVERSAL_1_3))
                .find("no entry point"),
            std::string::npos);
}

TEST_F(OrderTwin, ABuiltInInAStructIsRefused) {
  EXPECT_NE(refusal(assemble("OpCapability Shader\nOpMemoryModel Logical GLSL450\n"
                             "OpMemberDecorate %s 0 BuiltIn WorkgroupId\n"
                             "%u = OpTypeInt 32 0\n%v = OpTypeVector %u 3\n%s = OpTypeStruct %v",
                             SPV_ENV_UNIVERSAL_1_3))
                .find("member of a struct"),
            std::string::npos);
}

TEST_F(OrderTwin, AModuleWithoutRoomForIdsIsRefused) {
  SpirvWords module = compile(localSize({64, 1, 1}) + kIdentity);
  module[3] = ~0u;
  EXPECT_NE(refusal(module).find("no ids are left"), std::string::npos);
}

TEST_F(OrderTwin, ASubgroupSizeOfZeroIsAProgrammersError) {
  EXPECT_THROW(orderTwin({}, {0}), std::logic_error);
}

}  // namespace
}  // namespace gnomon
