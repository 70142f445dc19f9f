// Where a module keeps what a contract names, and what is said where the two contradict.
//
// Covered: our own layout, other bindings and layouts, fields scattered over buffers, headers,
// components, offsets in stripped modules, parameters in uniform blocks, row-major matrices,
// specialisation constants, grids, presets, fixed push constants; each contradiction as one line.
// Not covered: values in those places (foreign_test.cpp), images with samplers of their own.
#include "harness/program/interface.h"

#include <bit>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spirv-tools/optimizer.hpp>

#include "harness/error.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

struct Point {
  vec3 a;
  float r;
  uint k;
  mat3 m;
};
struct Lit {
  float D;
  vec3 F;
};
struct Push {
  uint count;
  float gain;
};

KernelRecord record() {
  return {.stage = "test",
          .entry = "kernel",
          .file = "",
          .buffers = {{"points", 0, Access::kRead,
                       describe<Point>("Point", field("a", &Point::a), field("r", &Point::r),
                                       field("k", &Point::k), field("m", &Point::m))},
                      {"results", 1, Access::kWrite,
                       describe<Lit>("Lit", field("D", &Lit::D), field("F", &Lit::F))}},
          .push = describe<Push>("Push", field("count", &Push::count), field("gain", &Push::gain)),
          .conventions = {{"y", {"down", "up"}}}};
}

const std::string kPoint = "struct Point { vec3 a; float r; uint k; mat3 m; };\n";
const std::string kLit = "struct Lit { float D; vec3 F; };\n";
const std::string kPush = "layout(push_constant, scalar) uniform P { uint count; float gain; };\n";
const std::string kPoints = "layout(binding = 0, scalar) buffer B0 { Point points[]; };\n";
const std::string kResults = "layout(binding = 1, scalar) buffer B1 { Lit results[]; };\n";
const std::string kStore =
    "results[0] = Lit(float(count) + gain * points[0].m[0].x, points[0].a);\n";

SpirvWords module(const std::string& declarations, const std::string& body = "",
                  const std::string& size = "local_size_x = 32") {
  return compileText("#version 450\n#extension GL_EXT_scalar_block_layout : require\nlayout(" +
                     size + ") in;\n" + declarations + "void main() {\n" + body + "}\n");
}

SpirvWords stripped(const SpirvWords& words) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  optimizer.RegisterPass(spvtools::CreateStripDebugInfoPass());
  spvtools::OptimizerOptions unchecked;
  unchecked.set_run_validator(false);  // it knows no scalar layout here
  SpirvWords result;
  EXPECT_TRUE(optimizer.Run(words.data(), words.size(), &result, unchecked));
  return result;
}

Interface mapped(const SpirvWords& words, const std::optional<Adapter>& adapter = {},
                 const KernelRecord& r = record()) {
  return interfaceOf(r, reflect(words), adapter ? &*adapter : nullptr, "theirs.comp");
}

/// The lines of a refusal without the first, which is always the same.
std::vector<std::string> contradictions(const SpirvWords& words,
                                        const std::optional<Adapter>& adapter = {},
                                        const KernelRecord& r = record()) {
  std::vector<std::string> lines;
  try {
    mapped(words, adapter, r);
  } catch (const UsageError& error) {
    std::istringstream said(error.what());
    std::string line;
    std::getline(said, line);
    EXPECT_EQ(line, "theirs.comp does not fit the contract of test/kernel:");
    while (std::getline(said, line)) lines.push_back(line.substr(2));
  }
  return lines;
}

using Lines = std::vector<std::string>;

/// "B0@16" for each field of a contract's buffer; "-" where the module lacks it.
Lines places(const Interface& i, const std::string& buffer) {
  Lines lines;
  for (const auto& p : i.placesOf(buffer))
    lines.push_back(!p ? "-" : fmt::format("{}@{}", i.buffers[p->buffer].name, p->offset));
  return lines;
}

Lines pushes(const Interface& i) {
  Lines lines;
  for (const Place& p : i.push)
    lines.push_back(fmt::format("{}:{}@{}", p.field.name,
                                p.buffer == Place::kPush ? "push" : i.buffers[p.buffer].name,
                                p.offset));
  return lines;
}

const std::string kOurs = kPoint + kLit + kPush + kPoints + kResults;

// ---- layouts --------------------------------------------------------------------------------

TEST(Interface, OurOwnLayoutMapsByItself) {
  const Interface i = mapped(module(kOurs, kStore));
  EXPECT_EQ(places(i, "points"), (Lines{"points@0", "points@12", "points@16", "points@20"}));
  EXPECT_EQ(places(i, "results"), (Lines{"results@0", "results@4"}));
  EXPECT_EQ(pushes(i), (Lines{"count:push@0", "gain:push@4"}));
  EXPECT_EQ(i.buffers[0].stride, 56u);
  EXPECT_EQ(i.covered, (std::array{32u, 1u, 1u}));
  EXPECT_FALSE(i.buffers[0].written);
  EXPECT_TRUE(i.buffers[1].written);
  EXPECT_TRUE(i.unmapped.empty());
}

TEST(Interface, AStrippedModuleOfOursMapsByNumberAndOffset) {
  const Interface i = mapped(stripped(module(kOurs, kStore)));
  EXPECT_EQ(places(i, "points"), (Lines{"@0", "@12", "@16", "@20"}));
  EXPECT_EQ(pushes(i), (Lines{"count:push@0", "gain:push@4"}));
}

// std430 puts a vec3 on 16 bytes and the columns of a matrix 16 bytes apart.
TEST(Interface, OtherBindingsSetsAndPackingsAreTakenFromReflection) {
  const Interface i = mapped(module(kPoint + kLit + R"(
layout(push_constant) uniform P { float gain; uint count; };
layout(set = 2, binding = 5, std430) buffer B0 { Point things[]; };
layout(set = 1, binding = 9, std430) buffer B1 { Lit results[]; };)"),
                             Adapter{.bindings = {{"points", {2, 5}}}});
  EXPECT_EQ(places(i, "points"), (Lines{"things@0", "things@12", "things@16", "things@32"}));
  EXPECT_EQ(i.placesOf("points")[3]->matrixStride, 16u);
  EXPECT_FALSE(i.placesOf("points")[3]->rowMajor);
  EXPECT_EQ(places(i, "results"), (Lines{"results@0", "results@16"}));
  EXPECT_EQ(pushes(i), (Lines{"count:push@4", "gain:push@0"}));
  EXPECT_EQ(i.buffers[1].slot,
            (BindingSlot{2, 5, BindingSlot::Kind::kStorageBuffer}));  // sorted by set
}

TEST(Interface, ARowMajorMatrixIsKnownForOne) {
  const Interface i = mapped(module(kLit + kPush + R"(struct Q { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, std430, row_major) buffer B0 { Q points[]; };)" +
                                    kResults),
                             Adapter{});
  EXPECT_TRUE(i.placesOf("points")[3]->rowMajor);
}

TEST(Interface, FieldsMayBeScatteredAndBeComponents) {
  const Interface i = mapped(module(kPush + R"(struct Item { vec4 ar; ivec2 k; };
layout(set = 0, binding = 3, std430) buffer B0 { Item items[]; };
layout(set = 0, binding = 4, std430) buffer B1 { uint n; mat3 turns[]; };
layout(set = 0, binding = 5, std430) buffer B2 { vec4 colour[]; };
layout(set = 0, binding = 6, std430) buffer B3 { float D[]; };)"),
                             Adapter{.fields = {{"points.a", "items[].ar"},
                                                {"points.r", "ar.w"},
                                                {"points.k", "items.k.y"},
                                                {"points.m", "B1.turns"},
                                                {"results.D", "D"},
                                                {"results.F", "colour.y"}}});
  EXPECT_EQ(places(i, "points"), (Lines{"items@0", "items@12", "items@20", "B1@16"}));
  EXPECT_EQ(places(i, "results"), (Lines{"D@0", "colour@4"}));
  EXPECT_EQ(i.buffers[1].stride, 48u);  // behind a header of 16 bytes
  EXPECT_EQ(i.buffers[1].bytes, 16u);
  EXPECT_TRUE(i.buffers[2].written && i.buffers[3].written);
  EXPECT_FALSE(i.buffers[0].written || i.buffers[1].written);
}

TEST(Interface, OffsetsReachMembersWithoutNames) {
  const Interface i = mapped(stripped(module(R"(
layout(push_constant) uniform P { vec2 unused; float g; uint n; };
struct Item { vec4 ar; uint k; mat3 m; };
layout(binding = 7, std430) buffer B0 { Item items[]; };
layout(binding = 8, std430) buffer B1 { vec4 to[]; };)")),
                             Adapter{.bindings = {{"points", {0, 7}}, {"results", {0, 8}}},
                                     .fields = {{"points.a", "x@0"},
                                                {"points.r", "x@0.w"},
                                                {"points.k", "x@16"},
                                                {"points.m", "x@32"},
                                                {"results.D", "x@0"},
                                                {"push.count", "push@12"},
                                                {"push.gain", "push@8"}},
                                     .constants = {{"push@0.x", 3}, {"push@0.y", 4}}});
  EXPECT_EQ(places(i, "points"), (Lines{"@0", "@12", "@16", "@32"}));
  EXPECT_EQ(pushes(i), (Lines{"count:push@12", "gain:push@8"}));
  ASSERT_EQ(i.presets.size(), 2u);
  EXPECT_EQ(i.presets[1].offset, 4u);
  EXPECT_EQ(i.presets[1].bits, std::bit_cast<std::uint32_t>(4.0f));
}

TEST(Interface, ParametersMayStandInAUniformBlock) {
  const std::string block = R"(
layout(set = 3, binding = 0, std140) uniform Params { vec3 tint; uint count; float scale; } p;)";
  const Adapter adapter{.fields = {{"push.gain", "p.scale"}}, .constants = {}};
  const SpirvWords words = module(kPoint + kLit + kPoints + kResults + block);
  EXPECT_EQ(contradictions(words, adapter),
            (Lines{"nothing gives 'p.tint' (vec3) a value: name it in 'fields' or 'constants'"}));
  Adapter half = adapter;
  half.constants = {{"p.tint.x", 1}, {"p.tint.b", 1}};
  EXPECT_EQ(contradictions(words, half),
            Lines{"'constants' gives 2 of the 3 components of 'tint'"});
  const std::string plain = R"(
layout(set = 3, binding = 0, std140) uniform Params { uint count; float bias; float scale; } p;)";
  const Interface i =
      mapped(module(kPoint + kLit + kPoints + kResults + plain),
             Adapter{.fields = {{"push.gain", "p.scale"}}, .constants = {{"p.bias", -0.5}}});
  EXPECT_EQ(pushes(i), (Lines{"count:p@0", "gain:p@8"}));
  ASSERT_EQ(i.presets.size(), 1u);
  EXPECT_EQ(i.presets[0].offset, 4u);
  EXPECT_EQ(i.presets[0].bits, std::bit_cast<std::uint32_t>(-0.5f));
  EXPECT_EQ(i.pushBytes, 0u);
}

// ---- constants, groups ----------------------------------------------------------------------

TEST(Interface, SpecializationIsByNameOrIdAndResizesTheGroup) {
  const std::string constants =
      "layout(constant_id = 3) const float bias = 0;\n"
      "layout(constant_id = 4) const int turns = 0;\n";
  const SpirvWords words = module(constants + kOurs, kStore + "results[1].D = bias + turns;",
                                  "local_size_x_id = 0, local_size_y_id = 7");
  KernelRecord r = record();
  r.specialization = {{9, 1}};
  const Interface i =
      mapped(words, Adapter{.specialization = {{"bias", 0.5}, {"4", -2}, {"0", 16}, {"7", 2}}}, r);
  EXPECT_EQ(i.specialization, (std::map<std::uint32_t, std::uint32_t>{
                                  {0, 16}, {3, 0x3f000000}, {4, 0xfffffffe}, {7, 2}, {9, 1}}));
  EXPECT_EQ(i.groupSize, (std::array{16u, 2u, 1u}));
  EXPECT_EQ(i.covered, i.groupSize);
}

TEST(Interface, AGridSaysWhatAGroupCoversWhateverItsThreads) {
  const Interface i = mapped(
      module(kOurs, kStore, "local_size_x_id = 0"),
      Adapter{.specialization = {{"0", 16}}, .grid = std::array{64u, 1u, 1u}, .conventions = {}});
  EXPECT_EQ(i.groupSize[0], 16u);
  EXPECT_EQ(i.covered[0], 64u);
}

TEST(Interface, AConstantFixesAPushConstantThatTheModuleLacks) {
  const std::string less = "layout(push_constant) uniform P { uint count; };\n";
  const Interface i = mapped(module(kPoint + kLit + less + kPoints + kResults),
                             Adapter{.constants = {{"gain", 2}}});
  EXPECT_EQ(i.fixed, (std::map<std::string, double>{{"gain", 2}}));
  EXPECT_EQ(pushes(i), Lines{"count:push@0"});
}

TEST(Interface, OutputsThatAreNotGivenAreListed) {
  const std::string half = R"(struct Half { float D; float spare; };
layout(binding = 1, std430) buffer B1 { Half results[]; };)";
  const Interface i = mapped(module(kPoint + kPush + kPoints + half), Adapter{});
  EXPECT_EQ(places(i, "results"), (Lines{"results@0", "-"}));
  EXPECT_EQ(i.unmapped, Lines{"results.F"});
}

// ---- contradictions -------------------------------------------------------------------------

TEST(Interface, WithoutAnAdapterEveryDifferenceIsALine) {
  EXPECT_EQ(
      contradictions(module(kPush + kLit + kResults + R"(
struct Q { vec3 a; int r; uint spare; uint k; };
layout(set = 1, binding = 2, scalar) buffer B0 { Q points[]; };)")),
      (Lines{"'points' is at set 1, binding 2 in the shader, set 0, binding 0 in the contract",
             "an element of 'points' takes 24 bytes in the shader, 56 in the contract",
             "points.r is int in the shader, float in the contract",
             "points.k is at byte 20 in the shader, 16 in the contract",
             "points has no member 'm' in the shader; the contract has mat3 m at byte 20",
             "points.spare (uint) stands in the shader but not in the contract"}));
}

TEST(Interface, BuffersAndPushConstantsThatDoNotAgreeAreNamed) {
  EXPECT_EQ(contradictions(module(kPoint + kPoints + R"(
layout(push_constant, scalar) uniform P { uint count; uint gain; uint more; };
layout(binding = 6) buffer B6 { uint log[]; };)")),
            (Lines{"the shader has no buffer 'results', which the contract binds at set 0, "
                   "binding 1",
                   "push constants take 12 bytes in the shader, 8 in the contract",
                   "the push constant 'gain' is uint at byte 4 in the shader, float at byte 4 in "
                   "the contract",
                   "the shader binds storage buffer 'log' (set 0, binding 6), which the contract "
                   "does not know"}));
}

/// What an adapter of a module of our own layout is told.
Lines told(const Adapter& adapter) { return contradictions(module(kOurs, kStore), adapter); }

TEST(Interface, FieldsThatLeadNowhereAreNamed) {
  EXPECT_EQ(told({.fields = {{"points.a", "items[].n"}}}),
            Lines{"'fields' maps points.a to 'items[].n', which the shader does not have"});
  EXPECT_EQ(told({.fields = {{"points.r", "m.w"}}}),
            Lines{"'fields' maps points.r, a float, to 'm.w', in a mat3"});
  EXPECT_EQ(told({.fields = {{"points.a", "a.y"}}}),
            Lines{"'fields' maps points.a, a vec3, to 'a.y', in a vec3"});
  EXPECT_EQ(told({.fields = {{"points.k", "r"}}}),
            Lines{"'fields' maps points.k, a uint, to 'r', in a float"});
  EXPECT_EQ(told({.fields = {{"push.count", "push@2"}}}),
            (Lines{"'fields' maps push.count to 'push@2', which the shader does not have",
                   "nothing gives 'push.count' (uint) a value: name it in 'fields' or "
                   "'constants'"}));
}

TEST(Interface, NamesThatTheContractDoesNotHaveAreRefused) {
  EXPECT_EQ(told({.fields = {{"point.a", "a"}}}),
            Lines{"'fields' maps point.a to 'a'; the contract has points.a, points.k, points.m, "
                  "points.r, push.count, push.gain, results.D, results.F"});
  EXPECT_EQ(told({.bindings = {{"samples", {0, 0}}}}),
            Lines{"'bindings' puts 'samples' at set 0, binding 0; the contract has points, "
                  "results"});
}

TEST(Interface, AnElementInAPushConstantAndAParameterInAnArrayAreRefused) {
  EXPECT_EQ(told({.fields = {{"points.r", "push.gain"}}}),
            Lines{"'fields' maps points.r, of which there are many, to 'push.gain', a push "
                  "constant"});
  EXPECT_EQ(told({.fields = {{"results.D", "push.gain"}}}),
            Lines{"'fields' maps results.D, of which there are many, to 'push.gain', a push "
                  "constant"});
  EXPECT_EQ(told({.fields = {{"push.gain", "points.r"}}}),
            (Lines{"'fields' maps push.gain, of which there is one, to 'points.r', in a runtime "
                   "array",
                   "nothing gives 'push.gain' (float) a value: name it in 'fields' or "
                   "'constants'"}));
}

TEST(Interface, BindingsWhereNothingIsAreNamed) {
  EXPECT_EQ(told({.bindings = {{"points", {4, 2}}}}),
            (Lines{"'bindings' puts 'points' at set 4, binding 2, where the shader has nothing",
                   "the shader binds storage buffer 'points' (set 0, binding 0), which the "
                   "contract does not know"}));
}

TEST(Interface, ABufferThatIsAnImageIsNamed) {
  EXPECT_EQ(contradictions(module(kLit + kPush + kResults +
                                  "layout(binding = 0) writeonly uniform image2D points;\n"),
                           Adapter{}),
            Lines{"'points' is a storage image in the shader, a storage buffer in the contract"});
}

TEST(Interface, ImagesOfAnotherShapeAreNamed) {
  KernelRecord r = record();
  r.images = {{.name = "source", .binding = 4, .type = "texture2D"},
              {.name = "target", .binding = 5, .access = Access::kWrite, .type = "image2D"}};
  EXPECT_EQ(contradictions(module(kOurs + "layout(binding = 4) uniform samplerCube source;\n"),
                           Adapter{}, r),
            (Lines{"'source' is samplerCube in the shader, texture2D in the contract",
                   "the shader has no image 'target', which the contract binds at set 0, "
                   "binding 5"}));
}

TEST(Interface, ConstantsThatNobodyHasOrThatAreMappedAreNamed) {
  EXPECT_EQ(told({.constants = {{"gamma", 2.2}}}),
            Lines{"'constants' gives 'gamma' a value, which neither the shader nor the contract "
                  "has"});
  EXPECT_EQ(told({.constants = {{"gain", 2}}}),
            Lines{"'constants' fixes 'gain', which the shader takes from the contract"});
  EXPECT_EQ(told({.specialization = {{"TILE", 8}}}),
            Lines{"'specialization' gives 'TILE' a value, but the shader has no such constant"});
}

// Without these, a number would be cut to what fits, and a vector would get one component.
TEST(Interface, NumbersThatAParameterCannotBeAreRefused) {
  const SpirvWords words = module(
      "layout(constant_id = 1) const bool fast = true;\n"
      "layout(constant_id = 2) const double wide = 1;\n" +
          kPoint + kLit + kPoints + kResults + R"(
layout(binding = 8, std140) uniform Params { uint count; float gain; uint n; int i; float f; vec3 v; };)",
      "results[0].D = fast ? 1 : float(wide);", "local_size_x_id = 0");
  const auto with = [&](std::map<std::string, double> constants,
                        std::map<std::string, double> specialization = {}) {
    std::map<std::string, double> all = {{"n", 1}, {"i", 1}, {"f", 1}};
    constants.merge(all);
    Lines lines =
        contradictions(words, Adapter{.specialization = specialization, .constants = constants});
    std::erase_if(lines, [](const std::string& l) { return l.starts_with("nothing gives"); });
    return lines;
  };
  const std::string c = "'constants' gives '", s = "'specialization' gives '";
  EXPECT_EQ(with({{"n", -1}}), Lines{c + "n' the number -1, but it is uint in the shader"});
  EXPECT_EQ(with({{"n", 1.5}}), Lines{c + "n' the number 1.5, but it is uint in the shader"});
  EXPECT_EQ(with({{"i", 1e10}}),
            Lines{c + "i' the number 10000000000, but it is int in the shader"});
  EXPECT_EQ(with({{"f", 1e300}}), Lines{c + "f' the number 1e+300, but it is float in the shader"});
  EXPECT_EQ(with({{"v", 1}}), Lines{c + "v' the number 1, but it is vec3 in the shader"});
  EXPECT_EQ(with({{"points.r", 1}}).size(), 1u);
  EXPECT_EQ(with({}, {{"fast", 2}}), Lines{s + "fast' the number 2, but it is bool in the shader"});
  EXPECT_EQ(with({}, {{"2", 0.5}}), Lines{s + "2' the number 0.5, but it is double in the shader"});
  EXPECT_EQ(with({}, {{"0", 0}}), Lines{"'specialization' makes a group of 0 threads on axis 0"});
  EXPECT_EQ(with({}, {{"0", -8}}), Lines{s + "0' the number -8, but it is uint in the shader"});
}

TEST(Interface, AnOutputThatIsNowhereIsNoPartialKernel) {
  EXPECT_EQ(contradictions(module(kPoint + kPush + kPoints +
                                  "struct Other { float d; vec3 f; };\n"
                                  "layout(binding = 1) buffer B1 { Other results[]; };"),
                           Adapter{}),
            Lines{"no field of the output 'results' is found in the shader"});
}

TEST(Interface, ConventionsAreCheckedAgainstTheRecord) {
  EXPECT_EQ(told({.conventions = {{"depth", "standard"}}}),
            Lines{"the convention 'depth' says nothing for this kernel"});
  EXPECT_EQ(told({.conventions = {{"y", "left"}}}),
            Lines{"the convention 'y' is one of down, up, not 'left'"});
}

}  // namespace
}  // namespace gnomon
