// The judge is judged: kernels with one fault each, and the verdict that must come of it.
//
// Covered: NaN and Inf for a number, a write past the end, an element left unwritten, a race, the
// sign of zero, a result that is mostly ambiguous, a model outside an operation's domain, a
// validation message, a plain module that computes something else, reassociation, widening, the
// budget itself, the words of a failure.
#include <cmath>
#include <filesystem>
#include <limits>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "harness/verdict/verdict.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

struct Number {
  float x;
};
struct Push {
  uint count;
};
template <class T>
struct NumberOf {
  T x;
  auto scalars() { return std::tie(x); }
};

KernelRecord recordOf(bool signOfZero = false) {
  auto x = field("x", &Number::x);
  x.signOfZero = signOfZero;
  return {
      .stage = "test",
      .entry = "kernel",
      .file = "",
      .buffers = {{"values", 0, Access::kRead, describe<Number>("Number", field("x", &Number::x))},
                  {"results", 1, Access::kWrite, describe<Number>("Number", x)}},
      .push = describe<Push>("Push", field("count", &Push::count)),
      .features = {"scalarBlockLayout"}};
}

/// A kernel whose main is `body`, which sees values, results, count and i.
SpirvWords kernelWith(const std::string& body) {
  return compileText(R"(#version 450
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;
struct Number { float x; };
layout(push_constant, scalar) uniform P { uint count; };
layout(set = 0, binding = 0, scalar) buffer Values { Number values[]; };
layout(set = 0, binding = 1, scalar) buffer Results { Number results[]; };
void main() {
  uint i = gl_GlobalInvocationID.x;
)" + body + "\n}\n");
}

class Judge : public testing::Test {
 protected:
  static Gpu& gpu() {
    static Gpu device({.device = "", .validation = true});
    return device;
  }

  static std::vector<Number> ramp(std::size_t n) {
    std::vector<Number> values(n);
    for (std::size_t i = 0; i < n; ++i) values[i].x = static_cast<float>(i) / 8 - 4;
    return values;
  }

  /// Runs the kernel on the values and judges it against the model `f` of one number.
  template <class F>
  Verdict judged(const std::string& body, const std::vector<Number>& values, F f,
                 bool signOfZero = false) {
    record = recordOf(signOfZero);
    const Subject subject(gpu(), record, {.words = kernelWith(body), .origin = "judge_test.comp"});
    const Push push{static_cast<uint>(values.size())};
    const Observation seen =
        observe(subject, {.inputs = {{"values", std::as_bytes(std::span(values))}},
                          .outputs = {{"results", values.size()}},
                          .push = std::as_bytes(std::span(&push, 1)),
                          .extent = {values.size()}});
    expected = expectationOf(
        "results", values.size(),
        [values, f]<class T>(std::size_t i) { return NumberOf<T>{f(input<T>(values[i].x))}; },
        [values](std::size_t i) { return fmt::format("    x  {}\n", values[i].x); });
    return judge(record.buffer("results").element, seen, expected,
                 Bounds::specification(gpu().info().roundingRteFloat32), policy, 1);
  }

  static bool mentions(const Verdict& v, const std::string& words) {
    for (const std::string& p : v.problems)
      if (p.find(words) != std::string::npos) return true;
    return false;
  }

  KernelRecord record;
  Expectation expected;
  Policy policy = Policy::load(std::filesystem::path(GNOMON_SOURCE_DIR) / "tests/policy.json");
};

const auto kTimesThree = [](const auto& x) { return x * 3; };
const std::string kGuarded = "if (i < count) results[i].x = values[i].x * 3.0;";

TEST_F(Judge, AcceptsTheRightKernel) {
  const Verdict v = judged(kGuarded, ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kConforms) << explain(v, expected);
  EXPECT_EQ(v.outside, 0u);
  EXPECT_EQ(v.elements, 200u);
  EXPECT_TRUE(v.problems.empty());
}

TEST_F(Judge, AcceptsAnEmptyInput) {
  EXPECT_EQ(judged(kGuarded, {}, kTimesThree).verdict, Class::kConforms);
}

TEST_F(Judge, RefusesNanForANumber) {
  const Verdict v = judged(
      "if (i < count) results[i].x = i == 77u ? uintBitsToFloat(0x7fc00000u) : values[i].x * 3.0;",
      ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.outside, 1u);
  EXPECT_EQ(v.worst->element, 77u);
}

TEST_F(Judge, RefusesInfinityForANumber) {
  const Verdict v = judged(
      "if (i < count) results[i].x = i == 3u ? uintBitsToFloat(0x7f800000u) : values[i].x * 3.0;",
      ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.worst->element, 3u);
  EXPECT_TRUE(std::isinf(v.worst->budget));
}

TEST_F(Judge, RefusesAWriteOnePastTheEnd) {
  const Verdict v = judged("if (i <= count) results[i].x = i < count ? values[i].x * 3.0 : 1.0;",
                           ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "wrote past the end of 'results'"));
}

TEST_F(Judge, RefusesAReadPastTheEndOfAnInput) {
  const Verdict v = judged(
      "if (i < count) results[i].x = values[i].x * 3.0 + (values[i + 1u].x - values[i].x - "
      "0.125);",
      ramp(200), kTimesThree);  // the ramp's step is 0.125
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.worst->element, 199u);
}

TEST_F(Judge, RefusesAWriteIntoAnInput) {
  const Verdict v =
      judged("if (i < count) { results[i].x = values[i].x * 3.0; if (i == 5u) values[i].x = 7.0; }",
             ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "wrote into its input, at values[5].x"));
}

TEST_F(Judge, RefusesAWritePastTheEndOfAnInput) {
  const Verdict v =
      judged("if (i < count) results[i].x = values[i].x * 3.0; if (i == count) values[i].x = 7.0;",
             ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "wrote past the end of its input 'values'"));
}

TEST_F(Judge, RefusesACaseWhoseBoundsAreTooWideToProveAnything) {
  std::vector<Number> small(200);
  for (std::size_t i = 0; i < small.size(); ++i) small[i].x = 1e-3f * static_cast<float>(i + 1);
  const Verdict v = judged(
      "if (i < count) results[i].x = 1.0 / inversesqrt((values[i].x + 1024.0) * (values[i].x + "
      "1024.0)) - 1024.0;",
      small, []<class T>(const T& x) {
        return T(1) / inversesqrt((x + T(1024)) * (x + T(1024))) - T(1024);
      });
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "proves nothing"));
}

TEST_F(Judge, RefusesAnElementLeftUnwritten) {
  const Verdict v =
      judged("if (i + 1u < count) results[i].x = values[i].x * 3.0;", ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "left 1 of 200 words of 'results' unwritten, first results[199].x"));
}

TEST_F(Judge, RefusesAResultThatDependsOnWhatStoodThereBefore) {
  const Verdict v =
      judged("if (i < count) results[i].x = values[i].x * (results[i].x > 0.0 ? 3.0 : 4.0);",
             ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "reads memory that nobody wrote"));
}

TEST_F(Judge, RefusesTheWrongSignOfZeroWhereTheContractCares) {
  const std::string body = "if (i < count) results[i].x = abs(values[i].x);";
  const std::vector<Number> zeros = {{-0.0f}, {-0.0f}};
  const auto identity = [](const auto& x) { return x; };
  EXPECT_EQ(judged(body, zeros, identity, false).verdict, Class::kConforms);
  EXPECT_EQ(judged(body, zeros, identity, true).verdict, Class::kWrong);
}

TEST_F(Judge, RefusesAResultThatIsMostlyAmbiguous) {
  // x - x/3 * 3 has either sign, so the choice is undecided nearly everywhere.
  const auto undecided = []<class T>(const T& x) {
    const T noise = x - x / T(3) * T(3);
    return select(noise > T(0), x, x + T(1));
  };
  const Verdict v = judged("if (i < count) results[i].x = values[i].x;", ramp(200), undecided);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "ambiguous"));
}

TEST_F(Judge, RefusesACaseWhoseModelLeavesAnOperationsDomain) {
  const Verdict v = judged("if (i < count) results[i].x = sqrt(values[i].x);", ramp(200),
                           [](const auto& x) { return sqrt(x); });
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "sqrt"));
}

TEST_F(Judge, RefusesAKernelDuringWhichTheValidationLayerSpoke) {
  GpuBuffer buffer = gpu().allocate(1024);
  const GpuProgram program = gpu().build(
      {.spirv = kernelWith(kGuarded), .slots = {{0, 0}, {0, 1}}, .pushBytes = sizeof(Push)});
  const std::size_t misaligned = 1;
  const Dispatch dispatch{.program = &program,
                          .buffers = {{{0, 0}, &buffer, misaligned, 4}, {{0, 1}, &buffer, 512, 4}},
                          .push = std::vector<std::byte>(sizeof(Push)),
                          .groups = {1, 1, 1}};
  gpu().run({&dispatch, 1}, std::chrono::seconds(10));
  const Verdict v = judged(kGuarded, ramp(64), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_TRUE(mentions(v, "validation layer")) << "the layer is not loaded?";
}

TEST_F(Judge, CountsReassociationAndDoesNotFailIt) {
  const Verdict v = judged("float a = 1e8 + values[i].x; if (i < count) results[i].x = a - 1e8;",
                           ramp(200), [](const auto& x) { return (x + 1e8f) - 1e8f; });
  EXPECT_EQ(v.outside, 0u) << explain(v, expected);
  EXPECT_LE(v.reassociated, 200u);
}

TEST_F(Judge, CallsAnotherArrangementEquivalentAndSaysHowFarItIs) {
  // x * 3 * 5 rounds twice where the model's x * 15 rounds once: less than one ULP of x away.
  const std::vector<Number> values = {{1.1f}, {0.3f}, {7.7f}, {1e-3f}, {123.456f}};
  const Verdict v = judged("if (i < count) results[i].x = values[i].x * 3.0 * 5.0;", values,
                           [](const auto& x) { return x * 15; });
  EXPECT_EQ(v.verdict, Class::kEquivalent) << explain(v, expected);
  EXPECT_EQ(v.widening, 1);
}

TEST_F(Judge, CallsAConstantOffByOnePartInTenThousandWrong) {
  const Verdict v =
      judged("if (i < count) results[i].x = values[i].x * 3.0003;", ramp(200), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_GE(v.outside, 190u);
}

TEST_F(Judge, FindsOneWrongElementAmongAMillion) {
  constexpr std::size_t kMany = 1'000'000;
  const Verdict v =
      judged("if (i < count) results[i].x = values[i].x * 3.0 * (i == 765432u ? 1.00001 : 1.0);",
             ramp(kMany), kTimesThree);
  EXPECT_EQ(v.verdict, Class::kWrong);
  EXPECT_EQ(v.outside, 1u);
  EXPECT_EQ(v.worst->element, 765432u);
}

TEST_F(Judge, RefusesAModuleThatContradictsTheContractAndNamesBothSides) {
  record = recordOf();
  record.buffers[1].element.size = 12;
  record.push.size = 8;
  try {
    const Subject subject(gpu(), record,
                          {.words = kernelWith(kGuarded), .origin = "judge_test.comp"});
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("takes 4 bytes in the shader, 12 in the contract"), std::string::npos)
        << text;
    EXPECT_NE(text.find("take 4 bytes in the shader, 8 in the contract"), std::string::npos)
        << text;
  }
}

TEST_F(Judge, NamesTheFeatureThatADeviceLacks) {
  record = recordOf();
  record.features = {"featureThatNobodyHas"};
  try {
    const Subject subject(gpu(), record,
                          {.words = kernelWith(kGuarded), .origin = "judge_test.comp"});
    FAIL() << "accepted";
  } catch (const Unsupported& why) {
    EXPECT_NE(std::string(why.what()).find("featureThatNobodyHas"), std::string::npos);
  }
}

TEST(Budget, IsTheShareOfItsSide) {
  Bounded b = Bounded::between(1, 5);
  b.value = 2;
  EXPECT_EQ(budgetUsed(2, b, false), 0);
  EXPECT_EQ(budgetUsed(3.5, b, false), 0.5);
  EXPECT_EQ(budgetUsed(1, b, false), 1);
  EXPECT_EQ(budgetUsed(8, b, false), 2);
}

TEST(Budget, OfAnExactResultIsNothingOrInfinite) {
  const Bounded one(1.0f);
  EXPECT_EQ(budgetUsed(1, one, false), 0);
  EXPECT_EQ(budgetUsed(1 + 0x1p-23, one, false), std::numeric_limits<double>::infinity());
}

TEST(Budget, AtInfinityAsksOnlyWhetherTheResultIsInside) {
  const double infinity = std::numeric_limits<double>::infinity();
  Bounded b = Bounded::between(0x1.fffffep127, infinity);
  b.value = infinity;
  EXPECT_EQ(budgetUsed(infinity, b, false), 0);
  EXPECT_EQ(budgetUsed(0x1.fffffep127, b, false), 0);
  EXPECT_EQ(budgetUsed(1, b, false), infinity);
}

TEST(Budget, OfNanIsInfiniteUnlessNanIsAllowed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(budgetUsed(nan, Bounded(1.0f), false), std::numeric_limits<double>::infinity());
  EXPECT_EQ(budgetUsed(nan, Bounded(std::numeric_limits<float>::quiet_NaN()), false), 0);
}

TEST_F(Judge, ExplainsWhereWhatAndWhatWasAllowed) {
  const Verdict v = judged("if (i < count) results[i].x = values[i].x * (i == 5u ? 4.0 : 3.0);",
                           ramp(64), kTimesThree);
  const std::string text = explain(v, expected);
  EXPECT_NE(text.find("1 of 64 elements of 'results' are outside"), std::string::npos) << text;
  EXPECT_NE(text.find("worst: results[5].x"), std::string::npos) << text;
  EXPECT_NE(text.find("allowed   [-10.125, -10.125]"), std::string::npos) << text;
  EXPECT_NE(text.find("x  -3.375"), std::string::npos) << text;
}

}  // namespace
}  // namespace gnomon
