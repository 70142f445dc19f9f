// Scratch: memory of a kernel's own that is zero before every dispatch and zero again after it.
//
// Covered: a kernel that cleans up, one that does not, one that does only in the usual order,
// writes outside, a buffer that is too short; a foreign kernel without scratch, with scratch of its
// own making, and adapters that misname it. Not covered: scratch that shares a buffer with outputs,
// writes before its start, runs that are timed.
#include "harness/hygiene/observe.h"

#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

struct Counter {
  uint sum, arrived;
};
struct Total {
  uint sum;
};

constexpr std::uint32_t kGroups = 64;
constexpr std::size_t kCounters = 4;

KernelRecord record() {
  return {.stage = "test",
          .entry = "total",
          .buffers = {{"totals", 0, Access::kWrite,
                       describe<Total>("Total", field("sum", &Total::sum))},
                      {"scratch", 1, Access::kScratch,
                       describe<Counter>("Counter", field("sum", &Counter::sum),
                                         field("arrived", &Counter::arrived))}},
          .push = {},
          .features = {"scalarBlockLayout"}};
}

// Each group adds its number to a counter; the group that arrives last stores the sum and cleans
// up.
const std::string kDeclared = R"(#version 450
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 1) in;
struct Total { uint sum; };
layout(set = 0, binding = 0, scalar) writeonly buffer Totals { Total totals[]; };
)";
const std::string kScratch = R"(
struct Counter { uint sum, arrived; };
layout(set = 0, binding = 1, scalar) coherent buffer Scratch { Counter scratch[]; };
)";

SpirvWords summing(const std::string& cleaning) {
  return compileText(kDeclared + kScratch + R"(void main() {
  atomicAdd(scratch[3].sum, gl_WorkGroupID.x);
  memoryBarrierBuffer();
  if (atomicAdd(scratch[3].arrived, 1) != gl_NumWorkGroups.x - 1) return;
  totals[0].sum = atomicAdd(scratch[3].sum, 0);
)" + cleaning + "}");
}

const std::string kClean = "scratch[3].sum = 0; scratch[3].arrived = 0;";

class Scratch : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }

  static Stimulus stimulus(std::size_t counters = kCounters) {
    return {.outputs = {{"totals", 1}}, .scratch = {{"scratch", counters}}, .extent = {kGroups}};
  }

  static Observation observed(const SpirvWords& words, const std::optional<Adapter>& adapter = {},
                              const Stimulus& given = stimulus()) {
    const KernelRecord r = record();
    return observe({*gpu, r, {.words = words, .origin = "sum.comp", .adapter = adapter}}, given);
  }

  static inline std::unique_ptr<Gpu> gpu;
};

using Lines = std::vector<std::string>;

void expectTheSum(const Observation& seen) {
  EXPECT_EQ(seen.findings, Lines{});
  constexpr uint kSum = kGroups * (kGroups - 1) / 2;
  EXPECT_EQ(elementsOf<uint>(seen.plain.at("totals")), std::vector<uint>{kSum});
  EXPECT_EQ(elementsOf<uint>(seen.twin.at("totals")), std::vector<uint>{kSum});
}

TEST_F(Scratch, IsZeroBeforeEveryRunAndNoOutput) {
  const Observation seen = observed(summing(kClean));
  expectTheSum(seen);
  EXPECT_EQ(seen.twin.size(), 1u);
  EXPECT_TRUE(seen.unmapped.empty());
}

TEST_F(Scratch, ThatIsNotLeftAsZerosIsNamedWithItsFirstWord) {
  const std::string rest =
      "left 'scratch' other than zero, first at scratch[3].arrived: 64; the next dispatch starts "
      "from it";
  EXPECT_EQ(observed(summing("scratch[3].sum = 0;")).findings,
            (Lines{"the kernel " + rest, "the strict twin " + rest}));
}

// The group with the last number need not be the last to run.
TEST_F(Scratch, ThatOnlyTheUsualOrderLeavesAsZerosIsFound) {
  if (!gpu->info().software) GTEST_SKIP() << "no promise about the order on this device";
  const Observation seen = observed(compileText(kDeclared + kScratch + R"(void main() {
  if (gl_WorkGroupID.x == gl_NumWorkGroups.x - 1) {
    totals[0].sum = 1;
    for (uint i = 0; i < 100000 && atomicAdd(scratch[0].arrived, 0) != gl_WorkGroupID.x; ++i) {}
    scratch[0].arrived = 0;
  } else {
    atomicAdd(scratch[0].arrived, 1);
  }
})"));
  ASSERT_EQ(seen.findings.size(), 1u) << fmt::format("{}", fmt::join(seen.findings, "\n"));
  EXPECT_TRUE(
      seen.findings[0].starts_with("with the order of its groups and of the subgroups in a group "
                                   "turned round, it left 'scratch' "
                                   "other than zero, first at scratch[0].arrived: "))
      << seen.findings[0];
}

// A driver may clip what lies before the start of a binding, so the band there is not asked for.
TEST_F(Scratch, HasAGuardBand) {
  const std::string what = "wrote past the end of 'scratch': byte 4 after its 4 elements";
  EXPECT_EQ(observed(summing(kClean + "scratch[4].arrived = 1;")).findings,
            (Lines{"the kernel " + what, "the strict twin " + what}));
}

TEST_F(Scratch, ThatTheStimulusDoesNotGiveIsWrittenOutside) {
  const Observation seen = observed(summing(kClean), {}, stimulus(3));
  ASSERT_FALSE(seen.findings.empty());
  EXPECT_TRUE(seen.findings[0].starts_with("the kernel wrote past the end of 'scratch'"))
      << seen.findings[0];
}

// ---- foreign kernels ------------------------------------------------------------------------

TEST_F(Scratch, IsNothingThatAForeignKernelMustHave) {
  const Observation seen = observed(compileText(kDeclared + R"(void main() {
  uint sum = 0;
  for (uint g = 0; g < gl_NumWorkGroups.x; ++g) sum += g;
  if (gl_WorkGroupID.x == 0) totals[0].sum = sum;
})"),
                                    Adapter{});
  expectTheSum(seen);
}

// A header and an array of its own making; found by its name, or where the adapter says.
TEST_F(Scratch, OfAForeignKernelMayHoldWhatItLikes) {
  const auto theirs = [](const std::string& name, const std::string& cleaning) {
    return compileText(kDeclared + fmt::format(R"(
layout(set = 1, binding = 7, std430) coherent buffer Mine {{ uint arrived; uvec4 sums[]; }} {};
#define MINE {}
void main() {{
  atomicAdd(MINE.sums[1].y, gl_WorkGroupID.x);
  memoryBarrierBuffer();
  if (atomicAdd(MINE.arrived, 1) != gl_NumWorkGroups.x - 1) return;
  totals[0].sum = atomicAdd(MINE.sums[1].y, 0);
  MINE.arrived = 0;
  {}
}})",
                                               name, name, cleaning));
  };
  const std::string clean = "MINE.sums[1].y = 0;";
  expectTheSum(observed(theirs("scratch", clean), Adapter{}));
  const Adapter bound{.bindings = {{"scratch", {1, 7}}}};
  expectTheSum(observed(theirs("mine", clean), bound));
  const Observation dirty = observed(theirs("mine", ""), bound);
  ASSERT_EQ(dirty.findings.size(), 2u);
  EXPECT_EQ(dirty.findings[0],
            "the kernel left 'mine' other than zero, first at mine[1]: 2016; the next dispatch "
            "starts from it");
}

std::string refusal(Gpu& gpu, const std::string& declared, const std::optional<Adapter>& adapter) {
  const KernelRecord r = record();
  try {
    const Subject subject(
        gpu, r,
        {.words = compileText(kDeclared + declared + "void main() { totals[0].sum = 1; }"),
         .origin = "sum.comp",
         .adapter = adapter});
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(Scratch, ThatContradictsTheContractIsRefused) {
  const std::string intro = "sum.comp does not fit the contract of test/total:\n  ";
  EXPECT_EQ(refusal(*gpu, "", {}),
            intro +
                "the shader has no buffer 'scratch', which the contract binds at set 0, "
                "binding 1");
  EXPECT_EQ(refusal(*gpu,
                    "struct Counter { uint sum; float arrived; };\n"
                    "layout(set = 0, binding = 1, scalar) buffer S { Counter scratch[]; };",
                    {}),
            intro + "scratch.arrived is float in the shader, uint in the contract");
  EXPECT_EQ(refusal(*gpu, "layout(set = 0, binding = 1) uniform S { uint x; } scratch;", Adapter{}),
            intro +
                "'scratch' is a uniform buffer in the shader, a storage buffer in the contract"
                "\n  nothing gives 'scratch.x' (uint) a value: name it in 'fields' or "
                "'constants'");
  EXPECT_EQ(refusal(*gpu, "", Adapter{.fields = {{"scratch.sum", "totals.sum"}}}),
            intro + "'fields' maps scratch.sum to 'totals.sum'; the contract has totals.sum");
}

TEST_F(Scratch, NobodyMayGiveWhatIsNoScratch) {
  Stimulus given = stimulus();
  given.scratch.push_back({"totals", 1});
  EXPECT_THROW(observed(summing(kClean), {}, given), std::logic_error);
}

}  // namespace
}  // namespace gnomon
