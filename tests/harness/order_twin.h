// What tests of the order twin share: a device, twins for it, and a buffer that kernels write.
#pragma once

#include <array>
#include <chrono>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/program/order.h"
#include "harness/vulkan/gpu.h"
#include "tests/harness/glsl.h"

namespace gnomon {

using Words = std::vector<std::uint32_t>;
using Axes = std::array<std::uint32_t, 3>;

inline SpirvWords compile(const std::string& body) {
  return compileText(
      fmt::format("#version 450\n#extension GL_EXT_scalar_block_layout : require\n{}", body));
}

inline std::string localSize(const Axes& size) {
  return fmt::format("layout(local_size_x = {}, local_size_y = {}, local_size_z = {}) in;\n",
                     size[0], size[1], size[2]);
}

inline std::uint32_t volume(const Axes& size) { return size[0] * size[1] * size[2]; }

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

  static inline std::unique_ptr<Gpu> gpu;
};

// Reads whole vectors, components, and a copy in a function.
inline const char* const kIdentity = R"(
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

}  // namespace gnomon
