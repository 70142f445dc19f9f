// The order twin: each invocation still runs once and its built-ins agree with each other; what the
// order of subgroups and groups hides in a wrong kernel shows; a right kernel stays right; every
// form of reading a built-in is redirected; twins of our kernels are valid.
// Not covered: dispatches with compute derivatives (lavapipe has none) and with LocalSizeId
// (validation for Vulkan 1.2 refuses it), kernels that HLSL compilers make.
#include "harness/program/order.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spirv-tools/libspirv.hpp>
#include <spirv_cross/spirv.hpp>
#include <unistd.h>

#include "harness/error.h"
#include "harness/program/compile.h"
#include "harness/vulkan/gpu.h"

namespace gnomon {
namespace {

using Words = std::vector<std::uint32_t>;
using Axes = std::array<std::uint32_t, 3>;

SpirvWords compile(const std::string& body) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("gnomon-order-{}.comp", getpid());
  std::ofstream(file) << "#version 450\n#extension GL_EXT_scalar_block_layout : require\n" << body;
  const SpirvWords words = compileShader(file, {});
  std::filesystem::remove(file);
  return words;
}

SpirvWords assemble(const std::string& text, spv_target_env target) {
  SpirvWords words;
  EXPECT_TRUE(spvtools::SpirvTools(target).Assemble(text, &words));
  return words;
}

std::string localSize(const Axes& size) {
  return fmt::format("layout(local_size_x = {}, local_size_y = {}, local_size_z = {}) in;\n",
                     size[0], size[1], size[2]);
}

std::uint32_t volume(const Axes& size) { return size[0] * size[1] * size[2]; }

class OrderTwin : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }
  void TearDown() override { EXPECT_EQ(gpu->takeMessages(), std::vector<std::string>()); }

  static std::uint32_t subgroup() { return gpu->info().subgroupSize; }
  static SpirvWords twinOf(const SpirvWords& plain) { return orderTwin(plain, {subgroup()}); }
  static bool startsWithFirst() { return gpu->info().name.starts_with("llvmpipe"); }

  /// What a kernel leaves in the buffer at binding 0, which holds `before` when it starts.
  static Words run(const SpirvWords& module, const Axes& groups, const Words& before,
                   const std::map<std::uint32_t, std::uint32_t>& specialization = {}) {
    ProgramDescription description;
    description.spirv = module;
    description.slots = {BindingSlot{}};  // a storage buffer
    description.specialization = specialization;
    const GpuProgram program = gpu->build(description);
    const GpuBuffer buffer = gpu->allocate(before.size() * 4);
    gpu->upload(buffer, 0, std::as_bytes(std::span(before)));
    Dispatch dispatch;
    dispatch.program = &program;
    dispatch.buffers = {{description.slots[0], &buffer}};
    dispatch.groups = groups;
    gpu->run(std::span(&dispatch, 1), std::chrono::seconds(20));
    Words after(before.size());
    gpu->download(buffer, 0, std::as_writable_bytes(std::span(after)));
    return after;
  }

  static std::unique_ptr<Gpu> gpu;
};

std::unique_ptr<Gpu> OrderTwin::gpu;

// ---- every id once, and the built-ins agree -------------------------------------------------

// Reads whole vectors, components, and a copy in a function.
const char* const kIdentity = R"(
struct Seen { uint count; uvec3 global; uvec3 local; uvec3 group; uint index; };
layout(set = 0, binding = 0, scalar) buffer Out { Seen seen[]; };
uint flat3(uvec3 at, uvec3 extent) { return (at.z * extent.y + at.y) * extent.x + at.x; }
void main() {
  uint at = flat3(gl_GlobalInvocationID, gl_NumWorkGroups * gl_WorkGroupSize);
  atomicAdd(seen[at].count, 1);
  seen[at].global = gl_GlobalInvocationID;
  for (int axis = 0; axis < 3; ++axis) seen[at].local[axis] = gl_LocalInvocationID[axis];
  seen[at].group = uvec3(gl_WorkGroupID.x, gl_WorkGroupID.y, gl_WorkGroupID.z);
  seen[at].index = gl_LocalInvocationIndex;
})";

constexpr std::size_t kSeenWords = 11;

/// What the invocation with this flat id must have seen.
Words expectedOf(std::uint32_t at, const Axes& size, const Axes& groups) {
  Words expected{1};
  Axes global{}, local{}, group{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t extent = size[axis] * groups[axis];
    global[axis] = at % extent;
    at /= extent;
    local[axis] = global[axis] % size[axis];
    group[axis] = global[axis] / size[axis];
  }
  for (const Axes& each : {global, local, group})
    expected.insert(expected.end(), each.begin(), each.end());
  expected.push_back((local[2] * size[1] + local[1]) * size[0] + local[0]);
  return expected;
}

/// How many invocations saw something else.
std::size_t disagreeing(const Words& seen, const Axes& size, const Axes& groups) {
  std::size_t wrong = 0;
  for (std::uint32_t at = 0; at < seen.size() / kSeenWords; ++at) {
    const std::span got = std::span(seen).subspan(at * kSeenWords, kSeenWords);
    wrong += !std::ranges::equal(got, expectedOf(at, size, groups));
  }
  return wrong;
}

Words unseen(const Axes& size, const Axes& groups) {
  return Words(volume(size) * volume(groups) * kSeenWords, 0);
}

TEST_F(OrderTwin, EachIdIsTakenOnceAndTheBuiltInsAgree) {
  const Axes groups{3, 2, 2};
  for (const Axes& size : std::initializer_list<Axes>{{1, 1, 1},
                                                      {subgroup(), 1, 1},
                                                      {64, 1, 1},
                                                      {65, 1, 1},
                                                      {16, 16, 1},
                                                      {1, 24, 2},
                                                      {5, 3, 2},
                                                      {4, 4, 8}}) {
    const SpirvWords twin = twinOf(compile(localSize(size) + kIdentity));
    EXPECT_EQ(disagreeing(run(twin, groups, unseen(size, groups)), size, groups), 0u)
        << fmt::format("{}", fmt::join(size, "x"));
  }
}

TEST_F(OrderTwin, EachIdIsTakenOnceWhateverTheSubgroupSizeIsSaidToBe) {
  const Axes size{12, 4, 1}, groups{2, 1, 1};
  const SpirvWords plain = compile(localSize(size) + kIdentity);
  for (const std::uint32_t said : {1u, 4u, 7u, 16u, 48u, 128u, ~0u})
    EXPECT_EQ(
        disagreeing(run(orderTwin(plain, {said}), groups, unseen(size, groups)), size, groups), 0u)
        << said;
}

TEST_F(OrderTwin, GroupSizesFromSpecialisationConstantsAreFollowed) {
  const SpirvWords twin = twinOf(compile(
      std::string("layout(local_size_x_id = 7, local_size_y = 2, local_size_z_id = 9) in;\n") +
      kIdentity));
  EXPECT_EQ(validateSpirv(twin), "");
  const Axes size{16, 2, 3}, groups{2, 2, 1};
  const Words seen = run(twin, groups, unseen(size, groups), {{7, 16}, {9, 3}});
  EXPECT_EQ(disagreeing(seen, size, groups), 0u);
}

// ---- the permutation ------------------------------------------------------------------------

// The turn in which each invocation of one group came.
const char* const kTurns = R"(
layout(set = 0, binding = 0, scalar) buffer Out { uint next; uint turns[]; };
void main() { turns[gl_LocalInvocationIndex] = atomicAdd(next, 1); })";

/// The turns of a group's subgroups, by subgroup; lanes of one may come in any order.
Words subgroupTurns(const Words& turns, std::uint32_t size) {
  Words first;
  for (std::size_t at = 1; at < turns.size(); at += size)
    first.push_back(*std::min_element(turns.begin() + static_cast<std::ptrdiff_t>(at),
                                      turns.begin() + static_cast<std::ptrdiff_t>(at + size)) /
                    size);
  return first;
}

TEST_F(OrderTwin, TheLastSubgroupRunsFirst) {
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  const std::uint32_t size = subgroup();
  const SpirvWords plain = compile(localSize({4 * size, 1, 1}) + kTurns);
  const Words before(4 * size + 1, 0);
  const auto turnsOf = [&](const SpirvWords& module) {
    return subgroupTurns(run(module, {1, 1, 1}, before), size);
  };
  EXPECT_EQ(turnsOf(plain), (Words{0, 1, 2, 3}));
  EXPECT_EQ(turnsOf(twinOf(plain)), (Words{3, 2, 1, 0}));
  EXPECT_EQ(turnsOf(twinOf(twinOf(plain))), (Words{0, 1, 2, 3}));
}

const char* const kLanes = R"(
#extension GL_KHR_shader_subgroup_basic : require
struct Lane { uint index; uint subgroup; uint lane; uint size; };
layout(set = 0, binding = 0, scalar) buffer Out { Lane lanes[]; };
void main() {
  lanes[gl_LocalInvocationIndex] =
      Lane(gl_LocalInvocationIndex, gl_SubgroupID, gl_SubgroupInvocationID, gl_SubgroupSize);
})";

TEST_F(OrderTwin, LanesStayAndSubgroupIdFollows) {
  if (!gpu->info().features.at("subgroupBasic")) GTEST_SKIP() << "no subgroup operations";
  const std::uint32_t size = subgroup();
  for (const std::uint32_t count : {4 * size, size, 2 * size + 1}) {
    Words blocks;
    for (std::uint32_t i = 0; i < count; ++i)
      blocks.insert(blocks.end(), {i, i / size, i % size, size});
    const SpirvWords plain = compile(localSize({count, 1, 1}) + kLanes);
    const SpirvWords twin = twinOf(plain);
    EXPECT_EQ(validateSpirv(twin), "");
    const Words before(count * 4, ~0u);
    // lavapipe with vectors of 1024 bits says 32 and runs 16.
    if (run(plain, {1, 1, 1}, before) != blocks)
      GTEST_SKIP() << "the device's subgroups are no blocks of the size that it states";
    EXPECT_EQ(run(twin, {1, 1, 1}, before), blocks) << count;
  }
}

const char* const kSums = R"(
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(set = 0, binding = 0, scalar) buffer Out { uint to[]; };
void main() {
  uint sum = subgroupAdd(gl_LocalInvocationIndex);
  to[gl_GlobalInvocationID.x] = sum;
})";

TEST_F(OrderTwin, SubgroupOperationsGiveWhatTheyGave) {
  if (!gpu->info().features.at("subgroupArithmetic")) GTEST_SKIP() << "no subgroupAdd";
  for (const std::uint32_t count : {2 * subgroup(), 2 * subgroup() + 3, subgroup() - 1}) {
    const SpirvWords plain = compile(localSize({count, 1, 1}) + kSums);
    const Words before(count * 3, 0);
    EXPECT_EQ(run(twinOf(plain), {3, 1, 1}, before), run(plain, {3, 1, 1}, before)) << count;
  }
}

// Each group's sum of its indices: one atomic a subgroup, whatever the subgroups are.
const char* const kGroupSums = R"(
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(set = 0, binding = 0, scalar) buffer Out { uint to[]; };
shared uint total;
void main() {
  if (gl_LocalInvocationIndex == 0) total = 0;
  barrier();
  uint sum = subgroupAdd(gl_LocalInvocationIndex);
  if (subgroupElect()) atomicAdd(total, sum);
  barrier();
  if (gl_LocalInvocationIndex == 0) to[gl_WorkGroupID.x] = total + gl_WorkGroupID.x;
})";

TEST_F(OrderTwin, AKernelThatAssumesNothingOfItsSubgroupsStaysRight) {
  if (!gpu->info().features.at("subgroupArithmetic")) GTEST_SKIP() << "no subgroupAdd";
  for (const Axes& size : {Axes{12, 4, 1}, Axes{3, 8, 1}, Axes{16, 4, 2}}) {
    const SpirvWords plain = compile(localSize(size) + kGroupSums);
    const std::uint32_t sum = volume(size) * (volume(size) - 1) / 2;
    const Words expected{sum, sum + 1, sum + 2};
    EXPECT_EQ(run(plain, {3, 1, 1}, Words(3, 0)), expected)
        << fmt::format("{}", fmt::join(size, "x"));
    EXPECT_EQ(run(twinOf(plain), {3, 1, 1}, Words(3, 0)), expected)
        << fmt::format("{}", fmt::join(size, "x"));
  }
}

// ---- what it is for -------------------------------------------------------------------------

// Each pixel gets the least and the largest value of its tile; the barrier that keeps the others
// from being overwritten by the start value is left out on demand.
const char* const kMinMax = R"(
layout(local_size_x = 16, local_size_y = 16) in;
layout(set = 0, binding = 0, scalar) buffer Image { uint value[16384]; uvec2 range[16384]; };
shared uint least, largest;
void main() {
  uint at = gl_GlobalInvocationID.y * 128 + gl_GlobalInvocationID.x;
  if (gl_LocalInvocationIndex == 0) { least = ~0u; largest = 0u; }
  FIRST_BARRIER
  atomicMin(least, value[at]);
  atomicMax(largest, value[at]);
  barrier();
  range[at] = uvec2(least, largest);
})";

SpirvWords minMax(const std::string& firstBarrier) {
  return compile(fmt::format("#define FIRST_BARRIER {}\n", firstBarrier) + kMinMax);
}

constexpr std::size_t kPixels = 128 * 128;
constexpr std::size_t kWidth = 128;
constexpr std::size_t kTile = 16;

Words noise() {
  Words words(kPixels * 3, 0x7fffffff);
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < kPixels; ++i) words[i] = state = state * 1664525u + 1013904223u;
  return words;
}

std::size_t wrongRanges(const Words& image) {
  std::map<std::size_t, std::array<std::uint32_t, 2>> tiles;
  const auto tileOf = [](std::size_t i) {
    return i / kWidth / kTile * kWidth + i % kWidth / kTile;
  };
  for (std::size_t i = 0; i < kPixels; ++i) {
    auto& [least, largest] = tiles.try_emplace(tileOf(i), std::array{~0u, 0u}).first->second;
    least = std::min(least, image[i]);
    largest = std::max(largest, image[i]);
  }
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < kPixels; ++i)
    wrong += std::array{image[kPixels + 2 * i], image[kPixels + 2 * i + 1]} != tiles[tileOf(i)];
  return wrong;
}

TEST_F(OrderTwin, AMissingBarrierThatTheOrderOfSubgroupsHidesShows) {
  const auto wrong = [](const SpirvWords& module) {
    return wrongRanges(run(module, {8, 8, 1}, noise()));
  };
  const SpirvWords right = minMax("barrier();"), racy = minMax("");
  EXPECT_EQ(wrong(right), 0u);
  EXPECT_EQ(wrong(twinOf(right)), 0u);
  const std::size_t hidden = wrong(racy), shown = wrong(twinOf(racy));
  fmt::print("without its barrier: plain {} of {} wrong, twin {}\n", hidden, kPixels, shown);
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  EXPECT_EQ(hidden, 0u);
  EXPECT_GT(shown, 0u);
}

const char* const kChain = R"(
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, scalar) buffer Data { uint data[4096]; uint before[4096]; };
void main() {
  uint g = gl_WorkGroupID.x;
  before[g] = g == 0 ? 0 : data[g - 1];
  data[g] = g + 1;
})";

constexpr std::uint32_t kGroups = 4096;  // many more than lavapipe has threads

TEST_F(OrderTwin, TrafficBetweenGroupsShows) {
  const auto wrong = [](const SpirvWords& module) {
    const Words after = run(module, {kGroups, 1, 1}, Words(2 * kGroups, 0));
    std::size_t count = 0;
    for (std::uint32_t g = 0; g < kGroups; ++g) count += after[kGroups + g] != g;
    return count;
  };
  const SpirvWords plain = compile(kChain);
  const std::size_t hidden = wrong(plain), shown = wrong(twinOf(plain));
  fmt::print("group g reads group g - 1: plain {} of {} wrong, twin {}\n", hidden, kGroups, shown);
  if (!startsWithFirst()) GTEST_SKIP() << "no promise about the order on this device";
  EXPECT_GT(shown, hidden);
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
