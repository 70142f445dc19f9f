// What a module says of itself: names, offsets, strides, kinds, group sizes, constants.
// Not covered: layouts that only HLSL writes (an inner array padded apart from its outer one),
// ray tracing.
#include "harness/program/reflect.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>

#include "harness/error.h"
#include "harness/program/spirv.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

SpirvWords compile(const std::string& body, const std::string& ending = ".comp",
                   const std::string& entryPoint = "main") {
  return compileText("#version 460\n#extension GL_EXT_scalar_block_layout : require\n" + body,
                     ending, {.includeFolders = {}, .defines = {}, .entryPoint = entryPoint});
}

/// A member in one line: "lights[4].color vec3 @16 +12 [4 x 32]".
std::string lineOf(const ReflectedMember& member) {
  std::string line =
      fmt::format("{} {} @{} +{}", member.path, member.type, member.offset, member.size);
  for (const ReflectedArray& array : member.arrays)
    line += fmt::format(" [{} x {}]", array.count, array.stride);
  if (member.matrixStride > 0)
    line += fmt::format(" {} {}", member.rowMajor ? "rows" : "columns", member.matrixStride);
  return line;
}

std::vector<std::string> linesOf(const std::vector<ReflectedMember>& members) {
  std::vector<std::string> lines;
  for (const ReflectedMember& member : members) lines.push_back(lineOf(member));
  return lines;
}

using Lines = std::vector<std::string>;

const std::string kOneThread = "layout(local_size_x = 1) in;\n";

/// The only binding of a compute shader that declares it and does nothing.
ReflectedBinding bindingOf(const std::string& declaration) {
  const Reflection reflection = reflect(compile(kOneThread + declaration + "\nvoid main() {}\n"));
  EXPECT_EQ(reflection.bindings.size(), 1u) << declaration;
  return reflection.bindings.at(0);
}

TEST(Reflect, ABlockOfOneRuntimeArrayOfStructsIsDescribedByItsElement) {
  const ReflectedBinding binding = bindingOf(R"(
    struct Sample { vec3 normal; float roughness; uint id; };
    layout(set = 1, binding = 2, scalar) readonly buffer Samples { Sample samples[]; };)");
  EXPECT_EQ(binding.name, "samples");
  EXPECT_EQ(binding.kind, "storage buffer");
  EXPECT_EQ(binding.set, 1u);
  EXPECT_EQ(binding.binding, 2u);
  EXPECT_EQ(binding.stride, 20u);
  EXPECT_TRUE(binding.readOnly);
  EXPECT_FALSE(binding.writeOnly);
  EXPECT_EQ(linesOf(binding.members),
            (Lines{"normal vec3 @0 +12", "roughness float @12 +4", "id uint @16 +4"}));
}

TEST(Reflect, ABlockOfOneRuntimeArrayOfScalarsHasOneNamelessMember) {
  const ReflectedBinding binding =
      bindingOf("layout(set = 0, binding = 0, scalar) writeonly buffer Out { vec3 to[]; };");
  EXPECT_EQ(binding.name, "to");
  EXPECT_EQ(binding.stride, 12u);
  EXPECT_EQ(binding.bytes, 0u);
  EXPECT_TRUE(binding.writeOnly);
  EXPECT_EQ(linesOf(binding.members), (Lines{" vec3 @0 +12"}));
}

TEST(Reflect, AHeaderBeforeARuntimeArrayKeepsBothInTheBlock) {
  const ReflectedBinding binding = bindingOf(R"(
    struct Hit { uint id; vec2 at; };
    layout(set = 0, binding = 0, scalar) buffer List { uint count; Hit hits[]; };)");
  EXPECT_EQ(binding.name, "List");
  EXPECT_EQ(binding.stride, 0u);
  EXPECT_EQ(binding.bytes, 4u);
  EXPECT_EQ(linesOf(binding.members), (Lines{"count uint @0 +4", "hits[].id uint @4 +4 [0 x 12]",
                                             "hits[].at vec2 @8 +8 [0 x 12]"}));
}

TEST(Reflect, AnInstanceNameNamesTheBinding) {
  EXPECT_EQ(bindingOf("layout(set = 0, binding = 0) buffer Block { uint a; } state;").name,
            "state");
  EXPECT_EQ(bindingOf("layout(set = 0, binding = 0) buffer Block { uint a; uint b; };").name,
            "Block");
  EXPECT_EQ(bindingOf("layout(set = 0, binding = 0) buffer Block { uint a; };").name, "a");
}

TEST(Reflect, NestedStructsArraysAndMatricesAreFlattenedWithTheirLayout) {
  const ReflectedBinding binding = bindingOf(R"(
    struct Light { vec3 color; float weights[3]; };
    struct Scene { mat4 view; Light lights[2][4]; };
    layout(set = 0, binding = 0, std140) uniform Frame {
      layout(row_major) mat3x2 uv; Scene scene; bool on; } frame;)");
  EXPECT_EQ(binding.kind, "uniform buffer");
  EXPECT_EQ(linesOf(binding.members),
            (Lines{"uv mat3x2 @0 +32 rows 16", "scene.view mat4 @32 +64 columns 16",
                   "scene.lights[2][4].color vec3 @96 +12 [2 x 256] [4 x 64]",
                   "scene.lights[2][4].weights[3] float @112 +4 [2 x 256] [4 x 64] [3 x 16]",
                   "on uint @608 +4"}));
}

TEST(Reflect, ArraysOfRuntimeArraysOfArraysKeepTheInnerDimension) {
  const ReflectedBinding binding =
      bindingOf("layout(set = 0, binding = 0, scalar) buffer Out { float to[][4]; };");
  EXPECT_EQ(binding.stride, 16u);
  EXPECT_EQ(linesOf(binding.members), (Lines{"[4] float @0 +4 [4 x 4]"}));
}

TEST(Reflect, ASpecializedArraySizeIsItsDefault) {
  const ReflectedBinding binding = bindingOf(R"(
    layout(constant_id = 1) const uint kCount = 6;
    layout(set = 0, binding = 0, scalar) buffer Out { float to[kCount]; uint end; };)");
  EXPECT_EQ(linesOf(binding.members)[0], "to[6] float @0 +4 [6 x 4]");
}

TEST(Reflect, WideAndNarrowScalarsAreSpelledAsInGlsl) {
  const ReflectedBinding binding = bindingOf(R"(
    #extension GL_EXT_shader_explicit_arithmetic_types : require
    layout(set = 0, binding = 0, scalar) buffer All {
      double d; dvec2 dv; float16_t h; f16vec4 hv; int8_t c; uint16_t s; int64_t l; ivec3 iv; };)");
  EXPECT_EQ(
      linesOf(binding.members),
      (Lines{"d double @0 +8", "dv dvec2 @8 +16", "h float16_t @24 +2", "hv f16vec4 @26 +8",
             "c int8_t @34 +1", "s uint16_t @36 +2", "l int64_t @40 +8", "iv ivec3 @48 +12"}));
}

TEST(Reflect, APointerInABlockIsAnAddressAndEndsTheWalk) {
  const ReflectedBinding binding = bindingOf(R"(
    #extension GL_EXT_buffer_reference : require
    layout(buffer_reference) buffer Node;
    layout(buffer_reference, scalar) buffer Node { uint value; Node next; };
    layout(set = 0, binding = 0, scalar) buffer List { uint count; Node first; };)");
  EXPECT_EQ(linesOf(binding.members), (Lines{"count uint @0 +4", "first uint64_t @8 +8"}));
}

struct Opaque {
  const char* declaration;
  const char* kind;
  const char* type;
};

TEST(Reflect, ImagesAndSamplersHaveTheirKindAndType) {
  const Opaque opaques[] = {
      {"writeonly uniform image2D x;", "storage image", "image2D"},
      {"layout(set = 0, binding = 0, r32ui) uniform uimage2DArray x;", "storage image",
       "uimage2DArray"},
      {"uniform sampler2D x;", "combined image sampler", "sampler2D"},
      {"uniform samplerCube x;", "combined image sampler", "samplerCube"},
      {"uniform sampler2DArrayShadow x;", "combined image sampler", "sampler2DArrayShadow"},
      {"uniform sampler2DMS x;", "combined image sampler", "sampler2DMS"},
      {"uniform itexture3D x;", "sampled image", "itexture3D"},
      {"uniform sampler x;", "sampler", "sampler"},
      {"uniform usamplerBuffer x;", "uniform texel buffer", "usamplerBuffer"},
      {"layout(set = 0, binding = 0, r32f) uniform imageBuffer x;", "storage texel buffer",
       "imageBuffer"}};
  for (const auto& [declaration, kind, type] : opaques) {
    const std::string text = declaration;
    const ReflectedBinding binding =
        bindingOf(text.starts_with("layout") ? text : "layout(set = 0, binding = 0) " + text);
    EXPECT_EQ(binding.name, "x") << declaration;
    EXPECT_EQ(binding.kind, kind) << declaration;
    EXPECT_EQ(binding.type, type) << declaration;
  }
}

TEST(Reflect, AccessOfImagesAndArraysOfBindingsAreSeen) {
  const ReflectedBinding binding =
      bindingOf("layout(set = 0, binding = 0, r32f) readonly uniform image2D x[3];");
  EXPECT_TRUE(binding.readOnly);
  EXPECT_FALSE(binding.writeOnly);
  EXPECT_EQ(binding.count, 3u);
}

TEST(Reflect, BindingsAreSortedBySetThenBinding) {
  const Reflection reflection = reflect(compile(kOneThread + R"(
    layout(set = 1, binding = 0) buffer C { uint c; };
    layout(set = 0, binding = 7) uniform sampler2D b;
    layout(set = 0, binding = 2) buffer A { uint a; };
    void main() {})"));
  ASSERT_EQ(reflection.bindings.size(), 3u);
  EXPECT_EQ(reflection.bindings[0].name, "a");
  EXPECT_EQ(reflection.bindings[1].name, "b");
  EXPECT_EQ(reflection.bindings[2].name, "c");
}

TEST(Reflect, PushConstantsHaveMembersAndAnEnd) {
  const Reflection reflection = reflect(compile(kOneThread + R"(
    struct Camera { mat4 view; vec2 size; };
    layout(push_constant, scalar) uniform Push { layout(offset = 8) uint count; Camera camera; };
    void main() {})"));
  EXPECT_EQ(linesOf(reflection.push),
            (Lines{"count uint @8 +4", "camera.view mat4 @12 +64 columns 16",
                   "camera.size vec2 @76 +8"}));
  EXPECT_EQ(reflection.pushBytes, 84u);
  EXPECT_TRUE(reflection.bindings.empty());
}

TEST(Reflect, SpecializationConstantsHaveIdNameTypeAndDefault) {
  const Reflection reflection = reflect(compile(kOneThread + R"(
    layout(constant_id = 9) const float scale = 0.5;
    layout(constant_id = 2) const bool fast = true;
    layout(constant_id = 4) const int shift = -1;
    layout(set = 0, binding = 0) buffer Out { float to; };
    void main() { to = fast ? scale : float(shift); })"));
  ASSERT_EQ(reflection.constants.size(), 3u);
  const auto is = [&](std::size_t i, const std::string& name, std::uint32_t id,
                      const std::string& type, std::uint32_t value) {
    const ReflectedConstant& constant = reflection.constants[i];
    return constant.name == name && constant.id == id && constant.type == type &&
           constant.value == value;
  };
  EXPECT_TRUE(is(0, "fast", 2, "bool", 1));
  EXPECT_TRUE(is(1, "shift", 4, "int", 0xffffffff));
  EXPECT_TRUE(is(2, "scale", 9, "float", 0x3f000000));
}

// ---- entry points --------------------------------------------------------------------------

TEST(Reflect, FixedGroupSizesAreRead) {
  const Reflection reflection =
      reflect(compile("layout(local_size_x = 8, local_size_y = 4) in;\nvoid main() {}\n"));
  EXPECT_EQ(reflection.stage, "compute");
  EXPECT_EQ(reflection.groupSize, (std::array<unsigned, 3>{8, 4, 1}));
  EXPECT_FALSE(reflection.groupSizeIds[0].has_value());
  EXPECT_EQ(reflection.capabilities, (Lines{"Shader"}));
}

TEST(Reflect, SpecializedGroupSizesHaveTheirDefaultsAndIds) {
  const Reflection reflection =
      reflect(compile("layout(local_size_x_id = 3, local_size_y = 2, local_size_z_id = 5) in;\n"
                      "layout(local_size_x = 16) in;\nvoid main() {}\n"));
  EXPECT_EQ(reflection.groupSize, (std::array<unsigned, 3>{16, 2, 1}));
  EXPECT_EQ(reflection.groupSizeIds[0], 3u);
  EXPECT_FALSE(reflection.groupSizeIds[1].has_value());
  EXPECT_EQ(reflection.groupSizeIds[2], 5u);
}

SpirvWords assemble(const std::string& text) {
  SpirvWords words;
  EXPECT_TRUE(spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_5).Assemble(text, &words));
  return words;
}

TEST(Reflect, LocalSizeIdIsRead) {
  const Reflection reflection = reflect(assemble(R"(
    OpCapability Shader
    OpMemoryModel Logical GLSL450
    OpEntryPoint GLCompute %main "main"
    OpExecutionModeId %main LocalSizeId %x %two %two
    OpDecorate %x SpecId 7
    %void = OpTypeVoid
    %uint = OpTypeInt 32 0
    %x = OpSpecConstant %uint 32
    %two = OpConstant %uint 2
    %type = OpTypeFunction %void
    %main = OpFunction %void None %type
    %label = OpLabel
    OpReturn
    OpFunctionEnd)"));
  EXPECT_EQ(reflection.groupSize, (std::array<unsigned, 3>{32, 2, 2}));
  EXPECT_EQ(reflection.groupSizeIds[0], 7u);
}

TEST(Reflect, TheWorkgroupSizeBuiltInOverridesTheMode) {
  const Reflection reflection = reflect(assemble(R"(
    OpCapability Shader
    OpMemoryModel Logical GLSL450
    OpEntryPoint GLCompute %main "main"
    OpExecutionMode %main LocalSize 1 1 1
    OpDecorate %size BuiltIn WorkgroupSize
    %void = OpTypeVoid
    %uint = OpTypeInt 32 0
    %vector = OpTypeVector %uint 3
    %four = OpConstant %uint 4
    %two = OpConstant %uint 2
    %size = OpConstantComposite %vector %four %two %two
    %type = OpTypeFunction %void
    %main = OpFunction %void None %type
    %label = OpLabel
    OpReturn
    OpFunctionEnd)"));
  EXPECT_EQ(reflection.groupSize, (std::array<unsigned, 3>{4, 2, 2}));
}

TEST(Reflect, GraphicsStagesAreNamed) {
  EXPECT_EQ(reflect(compile("void main() { gl_Position = vec4(0); }\n", ".vert")).stage, "vertex");
  const std::string fragment = "layout(location = 0) out vec4 c;\nvoid main() { c = vec4(1); }\n";
  EXPECT_EQ(reflect(compile(fragment, ".frag")).stage, "fragment");
}

TEST(Reflect, AMissingEntryPointIsAnsweredWithThoseThereAre) {
  const SpirvWords words = compile(kOneThread + "void main() {}\n", ".comp", "resolve");
  EXPECT_EQ(reflect(words, "resolve").entryPoint, "resolve");
  try {
    reflect(words, "main");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "no entry point 'main' in the module; it has: resolve");
  }
}

TEST(Reflect, StrippedModulesKeepLayoutsWithoutNames) {
  SpirvWords stripped;
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  optimizer.RegisterPass(spvtools::CreateStripDebugInfoPass());
  const SpirvWords words = compile(kOneThread + R"(
    struct Sample { vec3 normal; float roughness; };
    layout(set = 0, binding = 0, scalar) buffer Samples { Sample samples[]; };
    layout(set = 0, binding = 1, scalar) buffer Other { uint a; Sample more[2]; };
    void main() { samples[0] = more[a]; })");
  spvtools::OptimizerOptions unchecked;
  unchecked.set_run_validator(false);  // it knows no scalar layout here
  ASSERT_TRUE(optimizer.Run(words.data(), words.size(), &stripped, unchecked));
  const Reflection reflection = reflect(stripped);
  ASSERT_EQ(reflection.bindings.size(), 2u);
  EXPECT_EQ(reflection.bindings[0].name, "");
  EXPECT_EQ(linesOf(reflection.bindings[0].members), (Lines{" vec3 @0 +12", " float @12 +4"}));
  EXPECT_EQ(linesOf(reflection.bindings[1].members),
            (Lines{" uint @0 +4", "[2] vec3 @4 +12 [2 x 16]", "[2] float @16 +4 [2 x 16]"}));
}

TEST(Reflect, WordsThatAreNoModuleAreRefused) {
  EXPECT_THROW(reflect({}), UsageError);
  const std::uint32_t noise[] = {1, 2, 3, 4, 5, 6, 7};
  EXPECT_THROW(reflect(noise), UsageError);
}

}  // namespace
}  // namespace gnomon
