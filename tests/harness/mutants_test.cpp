// Mutants of SPIR-V modules: what operators change, under which names, what counts as the same
// computation, and that a missing barrier or a torn atomic is told from the kernel.
//
// Covered: each operator on a small kernel; ids that do not depend on lines; source lines; code
// that cannot run; duplicates and equivalents; the normal form; validity of every mutant; barriers
// and atomics judged on the device; the cache of fates; records of explained survivors. Not
// covered: campaigns (tests/command/mutate_test.cpp).
#include "harness/mutate/mutants.h"

#include <algorithm>
#include <fstream>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/error.h"
#include "harness/hygiene/observe.h"
#include "harness/mutate/explained.h"
#include "harness/mutate/fates.h"
#include "harness/mutate/normal_form.h"
#include "harness/mutate/operators.h"
#include "tests/harness/glsl.h"
#include "tests/scratch.h"

namespace gnomon {
namespace {

SpirvWords kernel(const std::string& body, const std::string& functions = "") {
  return compileText(
      "#version 450\nlayout(local_size_x = 4) in;\n"
      "layout(set = 0, binding = 0) readonly buffer In { float x[]; };\n"
      "layout(set = 0, binding = 1) writeonly buffer Out { float y[]; };\n" +
      functions + "void main() {\nuint i = gl_GlobalInvocationID.x;\n" + body + "\n}\n");
}

std::vector<std::string> changes(const SpirvWords& module, const std::string& operatorName) {
  std::vector<std::string> all;
  for (const Mutant& m : mutantsOf(module, {operatorName}).mutants) all.push_back(m.change);
  return all;
}

void expectChange(const std::string& body, const std::string& operatorName,
                  const std::string& change) {
  const std::vector<std::string> all = changes(kernel(body), operatorName);
  EXPECT_GE(std::ranges::count(all, change), 1)  // an index may be computed in the same way
      << body << ": " << fmt::format("{}", fmt::join(all, "; "));
}

TEST(Mutants, EveryOperatorMakesItsMistakes) {
  expectChange("y[i] = x[i] + x[i + 1];", "arithmetic", "+ becomes -");
  expectChange("y[i] = x[i] * x[i + 1];", "arithmetic", "* becomes /");
  expectChange("y[i] = min(x[i], x[i + 1]);", "arithmetic", "min becomes max");
  expectChange("y[i] = -x[i];", "arithmetic", "the sign is forgotten");
  expectChange("y[i] = x[i] * x[i + 1];", "arithmetic", "the second operand is forgotten");
  expectChange("y[i] = x[i] - x[i + 1];", "operands", "its operands are exchanged");
  expectChange("y[i] = pow(x[i], x[i + 1]);", "operands", "its first two operands are exchanged");
  expectChange("if (x[i] < 2.0) y[i] = 1.0;", "comparison", "< becomes <=");
  expectChange("if (x[i] < 2.0) y[i] = 1.0;", "comparison", "< becomes its opposite");
  expectChange("y[i] = x[i] * 0.5;", "constant", "0.5 becomes 0.50005");
  expectChange("y[i] = x[i] * 0.5;", "constant", "0.5 becomes -0.5");
  expectChange("y[i] = x[i] + 0.0 * x[0];", "constant", "0 becomes 0.0001");
  expectChange("y[i % 7] = x[i];", "constant", "7 becomes 8");
  expectChange("y[i] = clamp(x[i], 0.0, 1.0);", "removal", "clamp gives its operand 1");
  expectChange("y[i] = max(x[i], x[0]);", "removal", "max gives its operand 2");
  expectChange("y[i] = normalize(vec3(x[i], x[0], 1.0)).x;", "removal",
               "normalize gives its operand 1");
  expectChange("y[i] = x[i];", "store", "the store is forgotten");
  expectChange("float a = x[i]; y[i] = a * a;", "store", "a is 0");
  expectChange("vec2 v = vec2(x[i], x[0]); y[i] = v.x;", "component",
               "components 0 and 1 are exchanged");
  expectChange("y[i] = x[i];", "index", "the element behind");
  expectChange("if (x[i] < 2.0) y[i] = 1.0;", "branch", "the condition is true");
  expectChange("y[i] = x[i] > 0.0 && x[0] < 1.0 ? 1.0 : 2.0;", "branch",
               "the condition is negated");
}

TEST(Mutants, ADefaultIsWhatACaseBecomes) {
  const std::string body =
      "float a = 0.0; switch (i) { case 3: a = x[0]; break; default: a = x[1]; } y[i] = a;";
  expectChange(body, "branch", "case 3 is the default");
}

TEST(Mutants, EveryMutantIsValidAndDiffersFromTheKernel) {
  const SpirvWords module = kernel(
      "float a = clamp(x[i], 0.0, 1.0); for (int k = 0; k < 3; ++k) a += half_(a); y[i] = a;",
      "float half_(float v) { return v > 0.25 ? 0.5 * v : sqrt(v); }\n");
  const MutantSet found = mutantsOf(module, {});
  EXPECT_GT(found.mutants.size(), 30u);
  const std::uint64_t original = normalForm(module);
  std::set<std::string> ids;
  for (const Mutant& m : found.mutants) {
    EXPECT_EQ(validateSpirv(m.module), "") << m.id;
    EXPECT_NE(normalForm(m.module), original) << m.id << ": " << m.change;
    EXPECT_TRUE(ids.insert(m.id).second) << m.id << " is the name of two";
  }
}

TEST(Mutants, AreNamedByFunctionOperatorAndCount) {
  const MutantSet found =
      mutantsOf(kernel("y[i] = twice(x[i]);", "float twice(float v) {\nreturn v * 2.0;\n}\n"),
                {"arithmetic"});
  ASSERT_EQ(found.mutants.size(), 2u);
  EXPECT_TRUE(found.mutants[0].id.ends_with(":twice:arithmetic:1")) << found.mutants[0].id;
  EXPECT_TRUE(found.mutants[1].id.ends_with(":twice:arithmetic:2")) << found.mutants[1].id;
}

TEST(Mutants, OfCodeThatCannotRunThereAreNone) {
  const SpirvWords module =
      kernel("y[i] = x[i];", "float unused(float v) { return v * 3.0 + 1.0; }\n");
  for (const Mutant& m : mutantsOf(module, {}).mutants) EXPECT_EQ(m.place.function, "main") << m.id;
}

// A product that nobody reads.
TEST(Mutants, WhatAnOptimiserCannotTellIsEquivalent) {
  const MutantSet found =
      mutantsOf(kernel("float a = x[i]; a = a * 1.0; y[i] = x[i];"), {"constant"});
  EXPECT_EQ(found.mutants.size(), 0u);
  EXPECT_GT(found.equivalent.size(), 0u);
}

TEST(Mutants, AskedForByNameAreTheSame) {
  const SpirvWords module = kernel("y[i] = x[i] * 0.5;");
  const MutantSet found = mutantsOf(module, {});
  const auto again = mutantsNamed(module, {found.mutants.back().id, found.mutants.front().id});
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].module, found.mutants.back().module);
  EXPECT_EQ(again[1].module, found.mutants.front().module);
  EXPECT_THROW(mutantsNamed(module, {"nobody"}), UsageError);
}

TEST(NormalForm, DoesNotDependOnNamesAndOrderOfOperands) {
  EXPECT_EQ(normalForm(kernel("float a = x[i]; float b = x[0]; y[i] = a + b;")),
            normalForm(kernel("float c = x[i]; float d = x[0]; y[i] = d + c;")));
}

TEST(NormalForm, TellsWhatDiffers) {
  const std::uint64_t minus = normalForm(kernel("y[i] = x[i] - x[0];"));
  EXPECT_NE(minus, normalForm(kernel("y[i] = x[0] - x[i];")));
  EXPECT_NE(minus, normalForm(kernel("y[i] = x[i] + x[0];")));
  EXPECT_NE(minus, normalForm(kernel("y[i] = x[i] - x[1];")));
  EXPECT_NE(minus, normalForm(kernel("y[0] = x[i] - x[0];")));
}

// Two images of one type differ only in their bindings.
TEST(NormalForm, TellsVariablesOfOneTypeApart) {
  const auto fetching = [](const char* image) {
    return compileText(
        fmt::format("#version 450\n#extension GL_EXT_samplerless_texture_functions : require\n"
                    "layout(local_size_x = 1) in;\n"
                    "layout(set = 0, binding = 0) uniform texture2D a;\n"
                    "layout(set = 0, binding = 1) uniform texture2D b;\n"
                    "layout(set = 0, binding = 2, rgba32f) writeonly uniform image2D c;\n"
                    "void main() {{ imageStore(c, ivec2(0), texelFetch({}, ivec2(0), 0) + "
                    "texelFetch(a, ivec2(1), 0) * texelFetch(b, ivec2(2), 0)); }}",
                    image));
  };
  EXPECT_NE(normalForm(fetching("a")), normalForm(fetching("b")));
}

// ---- on the device --------------------------------------------------------------------------

struct Count {
  uint value;
};

// Every thread writes how many of its group's inputs are odd, counted in shared memory.
const char* const kCounting = R"(#version 450
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;
struct Count { uint value; };
layout(set = 0, binding = 0, scalar) readonly buffer In { Count given[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Out { Count odd[]; };
shared uint count;
void main() {
  if (gl_LocalInvocationIndex == 0) count = 0;
  barrier();
  if ((given[gl_GlobalInvocationID.x].value & 1u) == 1u) atomicAdd(count, 1u);
  barrier();
  odd[gl_GlobalInvocationID.x].value = count;
})";

TEST(Mutants, MissingBarriersAndTornAtomicsAreTold) {
  const Struct word = describe<Count>("Count", field("value", &Count::value));
  const KernelRecord record{
      .stage = "test",
      .entry = "counting",
      .buffers = {{"given", 0, Access::kRead, word}, {"odd", 1, Access::kWrite, word}},
      .push = {},
      .features = {"scalarBlockLayout"}};
  std::vector<Count> given(1024);
  for (std::size_t i = 0; i < given.size(); ++i)
    given[i].value = static_cast<uint>(i * 2654435761u >> 7);
  std::vector<Count> expected(given.size());
  for (std::size_t i = 0; i < given.size(); ++i)
    for (std::size_t k = i / 64 * 64; k < i / 64 * 64 + 64; ++k)
      expected[i].value += given[k].value & 1u;

  Gpu gpu(Gpu::Options{});
  const auto wrong = [&](const SpirvWords& module) {
    const Subject subject(gpu, record, {.words = module, .origin = "counting"});
    const Observation seen =
        observe(subject, {.inputs = {{"given", std::as_bytes(std::span(given))}},
                          .outputs = {{"odd", given.size()}},
                          .extent = {given.size()}});
    const auto right = std::as_bytes(std::span(expected));
    return !seen.findings.empty() || !std::ranges::equal(seen.twin.at("odd"), right);
  };
  const SpirvWords module = compileText(kCounting);
  ASSERT_FALSE(wrong(module)) << "unaltered";
  const MutantSet found = mutantsOf(module, {"barrier", "atomic"});
  EXPECT_EQ(std::ranges::count(found.mutants, "barrier", &Mutant::operatorName), 2);
  EXPECT_GE(std::ranges::count(found.mutants, "atomic", &Mutant::operatorName), 2);
  for (const Mutant& m : found.mutants) EXPECT_TRUE(wrong(m.module)) << m.id << ": " << m.change;
}

// ---- what is kept ---------------------------------------------------------------------------

TEST(FateCache, RemembersWhatWasSought) {
  const Scratch scratch;
  const auto file = scratch.path() / "deep/fates.jsonl";
  {
    FateCache cache(file);
    cache.keep(1, {.kills = {{"A.B", "how"}}, .sought = 1});
    cache.keep(2, {.kills = {}, .sought = 1});
    cache.keep(3, {.kills = {{"A.B", "how"}, {"A.C", "other"}}, .sought = 2});
  }
  std::ofstream(file, std::ios::app) << "{\"key\": 4, \"sought\"";  // killed while it wrote
  FateCache cache(file);
  ASSERT_TRUE(cache.find(1, 1));
  EXPECT_EQ(cache.find(1, 1)->kills.front().by, "A.B");
  EXPECT_FALSE(cache.find(1, 2)) << "the second kill was not looked for";
  ASSERT_TRUE(cache.find(2, 2)) << "no case kills it, so no second one does";
  EXPECT_TRUE(cache.find(2, 2)->survived());
  EXPECT_EQ(cache.find(3, 2)->kills.size(), 2u);
  EXPECT_FALSE(cache.find(4, 1));
  cache.keepOnly({3});
  EXPECT_FALSE(FateCache(file).find(1, 1));
  EXPECT_TRUE(FateCache(file).find(3, 2));
}

TEST(MutantRecords, ComeBackAsTheyWere) {
  const Scratch scratch;
  const auto file = scratch.path() / "mutants/brdf.json";
  const MutantRecords records = {
      {"brdf/evaluate",
       {.score = Score{.mutants = 10, .equivalent = 2, .killed = 7},
        .survivors = {{"f:g:constant:1", "a < b", "2 becomes 3", "b is never 2"},
                      {"f:g:atomic:1", "a + b", "torn", "two threads would have to meet", true}}}}};
  saveMutantRecords(file, records);
  const MutantRecords again = loadMutantRecords(file);
  EXPECT_EQ(again.at("brdf/evaluate").score, records.at("brdf/evaluate").score);
  ASSERT_NE(again.at("brdf/evaluate").find("f:g:constant:1"), nullptr);
  EXPECT_EQ(again.at("brdf/evaluate").find("f:g:constant:1")->reason, "b is never 2");
  EXPECT_FALSE(again.at("brdf/evaluate").find("f:g:constant:1")->race);
  EXPECT_TRUE(again.at("brdf/evaluate").find("f:g:atomic:1")->race);
  EXPECT_DOUBLE_EQ(again.at("brdf/evaluate").score->value(), 7.0 / 8);
}

TEST(MutantRecords, WithoutAReasonAreRefused) {
  const Scratch scratch;
  const auto refused = [&](const std::string& text) {
    const auto file = scratch.path() / "x.json";
    std::ofstream(file) << text;
    try {
      loadMutantRecords(file);
    } catch (const UsageError& error) {
      return std::string(error.what()).find("x.json") != std::string::npos;
    }
    return false;
  };
  EXPECT_TRUE(refused("[]"));
  EXPECT_TRUE(refused("{"));
  EXPECT_TRUE(refused(R"({"a/b": []})"));
  EXPECT_TRUE(refused(R"({"a/b": {"survivors": {}}})"));
  EXPECT_TRUE(refused(R"({"a/b": {"survivors": [{"id": "x", "text": "t", "change": "c"}]}})"));
  EXPECT_TRUE(refused(
      R"({"a/b": {"survivors": [{"id": "x", "text": "t", "change": "c", "reason": ""}]}})"));
  EXPECT_TRUE(refused(R"({"a/b": {"score": {"mutants": -1, "equivalent": 0, "killed": 0}}})"));
}

TEST(MutantRecords, ScoresStandInTheReadmesTable) {
  const std::string readme =
      "text\n\n| stage | entries | judged by | mutants killed |\n| --- | --- | --- | --- |\n"
      "| brdf | evaluate | laws | |\n| post | views: albedo, normal | intervals | old |\n\nmore\n";
  const std::string written =
      withScores(readme, {{"brdf/evaluate", "0.9 (9 of 10)"}, {"post/views", "1 (2 of 2)"}});
  EXPECT_NE(written.find("| brdf | evaluate | laws | 0.9 (9 of 10) |\n"), std::string::npos)
      << written;
  EXPECT_NE(written.find("| post | views: albedo, normal | intervals | 1 (2 of 2) |\n"),
            std::string::npos)
      << written;
  EXPECT_EQ(withScores(written, {{"brdf/evaluate", "0.9 (9 of 10)"}}), written);
  EXPECT_THROW(withScores("no table", {}), UsageError);
}

}  // namespace
}  // namespace gnomon
