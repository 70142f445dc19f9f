// The order twin as a rewrite: each invocation still runs once, its built-ins agree with each
// other, the last subgroup runs first, and subgroup operations and kernels that are right stay
// right. Elsewhere: every form of module and malformed ones (order_robustness_test.cpp), and the
// faults that it shows (communication_test.cpp).
#include "tests/harness/order_twin.h"

#include <algorithm>

namespace gnomon {
namespace {

// ---- every id once, and the built-ins agree -------------------------------------------------

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
  const SpirvWords twin = twinOf(compile(fmt::format(
      "layout(local_size_x_id = 7, local_size_y = 2, local_size_z_id = 9) in;\n{}", kIdentity)));
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

}  // namespace
}  // namespace gnomon
