// What the command says of a user's kernel whose threads communicate: the order of its groups and
// subgroups, and the width of a subgroup, must not matter.
//
// Every kernel is the project's own brdf/evaluate with another main.
#include <cstdlib>
#include <fstream>
#include <optional>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/command/command.h"

namespace gnomon {
namespace {

/// A variable of the environment, for a while; null: not set.
class Setting {
 public:
  Setting(const char* variable, const char* value) : name(variable) {
    if (const char* now = std::getenv(name)) before = now;
    set(value);
  }
  ~Setting() { set(before ? before->c_str() : nullptr); }
  Setting(const Setting&) = delete;
  Setting& operator=(const Setting&) = delete;

 private:
  void set(const char* value) const {
    if (value == nullptr)
      unsetenv(name);
    else
      setenv(name, value, 1);
  }

  const char* name;
  std::optional<std::string> before;
};

constexpr const char* kWidthVariable = "LP_NATIVE_VECTOR_WIDTH";

class Sweep : public testing::Test {
 protected:
  /// Whether the device that the command chooses is one whose order and widths are known.
  static bool onLavapipe() {
    const Said said = gnomonSays("devices --json -", "2>/dev/null");
    return said.output.find("llvmpipe") != std::string::npos;
  }

  /// The project's kernel with `main` for its own, judged by one case of 512 generated inputs.
  Said judged(const std::string& main, const std::string& extensions = "") const {
    const std::filesystem::path root = GNOMON_SOURCE_DIR;
    std::ifstream in(root / "kernels/brdf/evaluate.comp");
    std::string text{std::istreambuf_iterator<char>(in), {}};
    text.erase(text.find("void main()"));
    const std::string version = "#version 450\n";
    text.insert(text.find(version) + version.size(), extensions);
    const auto kernel = scratch.file("evaluate.comp", text.append(main));
    return gnomonSays(
        fmt::format("validate --filter 'BrdfEvaluate.LobeStays*' --cases 512 --kernel "
                    "brdf/evaluate={} --json {}",
                    kernel.string(), reportFile().string()));
  }

  /// What the last judgement wrote as JSON.
  std::string report() const {
    std::ifstream in(reportFile());
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static testing::AssertionResult mentions(const Said& said, const std::string& words) {
    if (said.output.find(words) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "no \"" << words << "\" in:\n" << said.output;
  }

  std::filesystem::path reportFile() const { return scratch.path() / "report.json"; }

  const Scratch scratch;
  const Setting sweeps{kWidthVariable, nullptr};  // whoever runs these tests may have set it
};

/// The lower half of a group loads the samples of all of it.
std::string staged(const char* barrier) {
  return fmt::format(R"(
shared Sample loaded[kGroupSize];
void main() {{
  const uint i = gl_GlobalInvocationID.x, t = gl_LocalInvocationIndex, other = kGroupSize / 2;
  if (t < other) {{
    if (i < push.count) loaded[t] = samples[i];
    if (i + other < push.count) loaded[t + other] = samples[i + other];
  }}
  {}
  if (i < push.count) results[i] = evaluate(loaded[t]);
}}
)",
                     barrier);
}

TEST_F(Sweep, AKernelThatStagesItsInputBehindABarrierConforms) {
  const Said said = judged(staged("barrier();"));
  EXPECT_EQ(said.status, 0) << said.output;
}

TEST_F(Sweep, AKernelThatStagesItsInputWithoutABarrierIsWrong) {
  if (!onLavapipe()) GTEST_SKIP() << "only lavapipe promises the order that the twin turns round";
  const Said said = judged(staged(""));
  EXPECT_EQ(said.status, 1) << said.output;
  EXPECT_TRUE(
      mentions(said, "with the order of its groups and of the subgroups in a group turned round"));
  EXPECT_TRUE(mentions(said, "a barrier is missing"));
}

// Lane l of the eight invocations from a multiple of eight on is the l-th of them only where a
// subgroup is eight wide.
const char* const kEightWide = R"(
void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  const uint at = gl_WorkGroupID.x * kGroupSize + gl_LocalInvocationIndex / 8 * 8 +
                  gl_SubgroupInvocationID;
  Sample s = samples[i];
  s.roughness = samples[min(at, push.count - 1)].roughness;
  results[i] = evaluate(s);
}
)";
const char* const kLanes = "#extension GL_KHR_shader_subgroup_basic : require\n";

TEST_F(Sweep, AKernelThatIsRightForSubgroupsOfEightAloneIsWrong) {
  if (!onLavapipe()) GTEST_SKIP() << "the width of a subgroup is a setting of lavapipe alone";
  {
    const Setting eight(kWidthVariable, "256");
    const Said said = judged(kEightWide, kLanes);
    EXPECT_EQ(said.status, 0) << "at its own width\n" << said.output;
  }
  const Said said = judged(kEightWide, kLanes);
  EXPECT_EQ(said.status, 1) << said.output;
  EXPECT_TRUE(mentions(said, "in subgroups of 4 (LP_NATIVE_VECTOR_WIDTH=128)"));
  // By the model, at that width: a program cached for eight lanes would differ in order alone.
  EXPECT_TRUE(mentions(said, "of 512 elements of 'results' are outside"));
  EXPECT_NE(report().find("in subgroups of 16 (LP_NATIVE_VECTOR_WIDTH=512)"), std::string::npos)
      << "the terminal names the first width alone, the report every one\n"
      << report();
}

// Subgroups draw the samples of their group, as many each as it has invocations.
TEST_F(Sweep, AKernelThatAssumesNothingOfItsSubgroupsConforms) {
  const Said said = judged(R"(
shared uint taken;
void main() {
  if (gl_LocalInvocationIndex == 0) taken = 0;
  barrier();
  const uint mine = subgroupAdd(1u);
  uint first = 0;
  if (subgroupElect()) first = atomicAdd(taken, mine);
  const uint i = gl_WorkGroupID.x * kGroupSize + subgroupBroadcastFirst(first) +
                 subgroupExclusiveAdd(1u);
  if (i < push.count) results[i] = evaluate(samples[i]);
}
)",
                           "#extension GL_KHR_shader_subgroup_arithmetic : require\n"
                           "#extension GL_KHR_shader_subgroup_ballot : require\n");
  EXPECT_EQ(said.status, 0) << said.output;
}

TEST_F(Sweep, AWorkerRefusesWhatIsNoTask) {
  for (const char* task : {"garbage", "''", "'{}'", "'[]'", "'{\"root\": 5}'", "null"}) {
    const Said said = gnomonSays(fmt::format("worker {}", task));
    EXPECT_EQ(said.status, 2) << task << "\n" << said.output;
    EXPECT_TRUE(mentions(said, "this is no task of a worker")) << task;
  }
  EXPECT_EQ(gnomonSays("worker").status, 2);
}

TEST_F(Sweep, AWorkerRefusesACaseThatDoesNotExist) {
  const Said said = gnomonSays(
      R"(worker '{"root": "/", "device": "", "seed": 1, "generated": null, "timeout": null, "errors": null, )"
      R"("kernels": {}, "shrinks": false, "failures": "", "replay": "", "validation": true, "probes": false, "watch": 0, "firstFailureOnly": false, "cases": ["No.SuchCase"], "mutated": "", "mutants": [], "models": false, "kills": 1}')");
  EXPECT_EQ(said.status, 2) << said.output;
  EXPECT_TRUE(mentions(said, "cases that do not exist"));
}

}  // namespace
}  // namespace gnomon
