// Foreign kernels from file to verdict's doorstep: what they are given, what is read back, what is
// found out about them.
//
// Covered: values through every layout bit by bit, both ways and in place; conventions; a narrow
// storage format; HLSL; functions without an entry point; outputs that are not given; strays,
// unwritten words and changed inputs in foreign buffers; files that are junk; hostile SPIR-V.
// Not covered: verdicts (judge_test.cpp), images in other shapes (observe_image_test.cpp), that
// compiling ends in time (worker_test.cpp).
#include "harness/program/foreign.h"

#include <bit>
#include <csignal>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "harness/hygiene/observe.h"
#include "harness/program/order.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

struct Item {
  vec3 a;
  float r;
  uint k;
  mat3 m;
};
struct Copy {
  vec3 a;
  float r;
  uint k;
  mat3 m;
};
struct Push {
  uint count;
};

KernelRecord record() {
  return {
      .stage = "test",
      .entry = "copy",
      .file = "",
      .buffers = {{"items", 0, Access::kRead,
                   describe<Item>("Item", field("a", &Item::a), field("r", &Item::r, "roughness"),
                                  field("k", &Item::k), field("m", &Item::m))},
                  {"copies", 1, Access::kWrite,
                   describe<Copy>("Copy", field("a", &Copy::a), field("r", &Copy::r),
                                  field("k", &Copy::k), field("m", &Copy::m))}},
      .push = describe<Push>("Push", field("count", &Push::count)),
      .features = {"scalarBlockLayout"},
      .conventions = {{"roughness", {"perceptual", "alpha"}}}};
}

constexpr std::size_t kCount = 77;  // two groups of 32 and a part of one

/// Random bits, NaNs and subnormals among them.
std::vector<Item> randomItems() {
  std::vector<Item> items(kCount);
  std::vector<std::uint32_t> words(kCount * sizeof(Item) / 4);
  std::mt19937 random(7);
  for (auto& w : words) w = static_cast<std::uint32_t>(random());
  std::memcpy(items.data(), words.data(), words.size() * 4);
  return items;
}

const std::string kHead = R"(#version 450
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 32) in;
)";
const std::string kPush = "layout(push_constant) uniform P { uint count; };\n";
const std::string kMain =
    "void main() {\n  uint i = gl_GlobalInvocationID.x;\n"
    "  if (i >= count) return;\n";

class Foreign : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    gpu = std::make_unique<Gpu>(Gpu::Options{.device = "", .validation = true});
  }
  static void TearDownTestSuite() { gpu.reset(); }
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  }

  static Observation seen(const KernelRecord& r, KernelModule module,
                          const std::vector<Item>& items) {
    const Subject subject(*gpu, r, std::move(module));
    const Push push{static_cast<uint>(items.size())};
    return observe(subject, {.inputs = {{"items", std::as_bytes(std::span(items))}},
                             .outputs = {{"copies", items.size()}},
                             .push = std::as_bytes(std::span(&push, 1)),
                             .extent = {items.size()}});
  }

  static Observation ran(const std::string& glsl, const Adapter& adapter,
                         const std::vector<Item>& items = randomItems()) {
    return seen(record(),
                {.words = compileText(kHead + glsl), .origin = "theirs.comp", .adapter = adapter},
                items);
  }

  static void expectCopied(const Observation& o, const std::vector<Item>& items = randomItems()) {
    EXPECT_TRUE(o.findings.empty()) << fmt::format("{}", fmt::join(o.findings, "\n"));
    const auto given = std::as_bytes(std::span(items));
    const Bytes wanted(given.begin(), given.end());
    EXPECT_TRUE(o.plain.at("copies") == wanted);
    EXPECT_TRUE(o.twin.at("copies") == wanted);
  }

  /// What loadKernel says of a file; it must name it.
  std::string refusal(const fs::path& file, const KernelRecord& r = record()) {
    try {
      loadKernel(file, r, folder);
    } catch (const UsageError& error) {
      EXPECT_NE(std::string_view(error.what()).find(folder.string()), std::string_view::npos)
          << error.what();
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << file << ", " << fs::file_size(file) << " bytes";
    return {};
  }

  static inline std::unique_ptr<Gpu> gpu;
  fs::path folder = fs::temp_directory_path() / fmt::format("gnomon-foreign-{}", getpid());
};

bool finds(const Observation& o, std::string_view words) {
  for (const std::string& line : o.findings)
    if (line.find(words) != std::string::npos) return true;
  return false;
}

std::string all(const Observation& o) { return fmt::format("{}", fmt::join(o.findings, "\n")); }

bool says(const std::string& text, std::string_view words) {
  return text.find(words) != std::string::npos;
}

// ---- values through layouts -----------------------------------------------------------------

// Copied as uints: lavapipe may make a quiet NaN of another when a float passes through arithmetic.
TEST_F(Foreign, ValuesSurviveEveryPacking) {
  for (const char* packing : {"scalar", "std430", "std430, row_major", "scalar, row_major"})
    expectCopied(ran(fmt::format(R"(
struct Item {{ vec3 a; float r; uint k; mat3 m; }};
layout(set = 2, binding = 3, {0}) readonly buffer A {{ Item items[]; }};
layout(set = 1, binding = 0, scalar) writeonly buffer B {{ Item copies[]; }};
{1}{2} copies[i] = items[i]; }})",
                                 packing, kPush, kMain),
                     Adapter{}));
}

TEST_F(Foreign, ValuesSurviveScatteringBehindAHeaderAndInComponents) {
  expectCopied(ran(R"(
layout(binding = 0, std140) uniform Params { vec2 pad; uint count; };
struct Wide { uvec2 kk; mat3 turn; vec4 ar; };
layout(binding = 1, std430) readonly buffer A { uint version; Wide wide[]; };
layout(binding = 2, std430) writeonly buffer B { vec4 ar[]; };
layout(binding = 3, std430) writeonly buffer C { uint magic; uint ks[]; };
layout(binding = 4, std430, row_major) writeonly buffer D { mat3 turns[]; };
)" + kMain + "ar[i] = wide[i].ar.wxyz; ks[i] = wide[i].kk.y; turns[i] = wide[i].turn; }",
                   Adapter{.fields = {{"items.a", "wide.ar"},
                                      {"items.r", "wide.ar.w"},
                                      {"items.k", "wide.kk.y"},
                                      {"items.m", "wide.turn"},
                                      {"copies.a", "ar.y"},
                                      {"copies.r", "ar.x"},
                                      {"copies.k", "ks"},
                                      {"copies.m", "turns"}},
                           .constants = {{"pad.x", 1}, {"pad.y", 2}}}));
}

const std::string kInPlace = R"(
struct Both { vec3 a; float r; uint k; mat3 m; vec3 a2; float r2; uint k2; mat3 m2; };
layout(binding = 5, std430) buffer A { Both both[]; };
)";
const std::map<std::string, std::string> kInPlaceFields = {
    {"items.a", "a"},   {"items.r", "r"},   {"items.k", "k"},   {"items.m", "m"},
    {"copies.a", "a2"}, {"copies.r", "r2"}, {"copies.k", "k2"}, {"copies.m", "m2"}};
const std::map<std::string, std::array<unsigned, 2>> kInPlaceBindings = {{"items", {0, 5}},
                                                                         {"copies", {0, 5}}};
const std::string kCopyInPlace =
    "Both b = both[i]; both[i].a2 = b.a; both[i].r2 = b.r; both[i].k2 = b.k; both[i].m2 = b.m;";

TEST_F(Foreign, InputAndOutputMayShareABuffer) {
  expectCopied(ran(kInPlace + kPush + kMain + kCopyInPlace + "}",
                   Adapter{.bindings = kInPlaceBindings, .fields = kInPlaceFields}));
}

TEST_F(Foreign, InASharedBufferUnwrittenWordsAndChangedInputsAreFound) {
  const Adapter adapter{.bindings = kInPlaceBindings, .fields = kInPlaceFields};
  Observation o =
      ran(kInPlace + kPush + kMain + "if (i == 9u) return;" + kCopyInPlace + "}", adapter);
  EXPECT_TRUE(finds(o, "unwritten, first copies[9].a")) << all(o);
  o = ran(kInPlace + kPush + kMain + kCopyInPlace + "if (i == 9u) both[i].k = ~b.k; }", adapter);
  EXPECT_TRUE(finds(o, "wrote into its input, at items[9].k")) << all(o);
}

TEST_F(Foreign, TrulyInPlaceTheOutputReplacesTheInput) {
  expectCopied(ran(R"(struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, scalar) buffer A { Item items[]; };
)" + kPush + kMain + "uint k = items[i].k; items[i].k = k; }",
                   Adapter{.bindings = {{"copies", {0, 0}}}}));
}

TEST_F(Foreign, ABlockThatHoldsOneElementIsRefusedForMany) {
  try {
    ran(R"(layout(binding = 0, scalar) readonly buffer A { vec3 a; float r; uint k; mat3 m; } items;
layout(binding = 1, scalar) buffer B { vec3 copies[]; };
)" + kPush + kMain +
            "copies[i] = items.a; }",
        Adapter{.fields = {{"copies.a", "copies"}}});
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "theirs.comp: 'items' keeps one items.a, of which this case has 77");
  }
}

// ---- what is found in foreign buffers -------------------------------------------------------

const std::string kTheirs = R"(struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, std430) buffer A { Item things[]; };
layout(binding = 1, std430) buffer B { uint version; Item copies[]; };
)";
const Adapter kTheirsAdapter{.bindings = {{"items", {0, 0}}, {"copies", {0, 1}}}};

TEST_F(Foreign, AWritePastTheEndIsFound) {
  const Observation o = ran(kTheirs + kPush + R"(void main() { uint i = gl_GlobalInvocationID.x;
  if (i <= count) copies[i] = things[min(i, count - 1)]; })",
                            kTheirsAdapter);
  EXPECT_TRUE(finds(o, "wrote past the end of 'B'") || finds(o, "wrote past the end of 'copies'"))
      << all(o);
}

TEST_F(Foreign, AWriteIntoTheInputIsFoundByTheContractsName) {
  const Observation o =
      ran(kTheirs + kPush + kMain + "copies[i] = things[i]; if (i == 5u) things[i].k = 1u; }",
          kTheirsAdapter);
  EXPECT_TRUE(finds(o, "wrote into its input, at items[5].k")) << all(o);
}

TEST_F(Foreign, OutputsThatAreNotGivenAreListedAndNotMissed) {
  const Observation o = ran(R"(struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, scalar) readonly buffer A { Item items[]; };
layout(binding = 1, std430) writeonly buffer B { uint k[]; };
)" + kPush + kMain + "k[i] = items[i].k; }",
                            Adapter{.bindings = {{"copies", {0, 1}}},
                                    .fields = {{"copies.k", "k"}}});
  EXPECT_TRUE(o.findings.empty()) << all(o);
  EXPECT_EQ(o.unmapped, (std::set<std::string>{"copies.a", "copies.m", "copies.r"}));
  const auto copies = elementsOf<Copy>(o.plain.at("copies"));
  EXPECT_EQ(copies[3].k, randomItems()[3].k);
  EXPECT_EQ(copies[3].r, 0.0f);
}

// ---- conventions ----------------------------------------------------------------------------

TEST_F(Foreign, AlphaIsTheSquareOfRoughnessAndStaysSane) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kMax = std::numeric_limits<float>::max();
  const std::vector<std::pair<float, float>> table = {
      {0.0f, 0.0f},    {-0.0f, -0.0f},  {0.5f, 0.25f}, {1.0f, 1.0f},
      {-0.5f, -0.25f}, {3.0f, 9.0f},    {kInf, kInf},  {-kInf, -kInf},
      {1e30f, kMax},   {-1e30f, -kMax}, {kMax, kMax},  {1e-30f, 0.0f}};
  std::vector<Item> items(table.size() + 1);
  for (std::size_t i = 0; i < table.size(); ++i) items[i].r = table[i].first;
  items.back().r = std::bit_cast<float>(0x7fc01234u);
  const Observation o = ran(R"(struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, scalar) readonly buffer A { Item items[]; };
layout(binding = 1, scalar) writeonly buffer B { Item copies[]; };
)" + kPush + kMain + "copies[i] = items[i]; }",
                            Adapter{.conventions = {{"roughness", "alpha"}}}, items);
  EXPECT_TRUE(o.findings.empty()) << all(o);
  const auto copies = elementsOf<Copy>(o.plain.at("copies"));
  for (std::size_t i = 0; i < table.size(); ++i)
    EXPECT_EQ(std::bit_cast<std::uint32_t>(copies[i].r),
              std::bit_cast<std::uint32_t>(table[i].second))
        << table[i].first << " became " << copies[i].r;
  EXPECT_EQ(std::bit_cast<std::uint32_t>(copies.back().r), 0x7fc01234u);
}

KernelRecord pictures() {
  return {.stage = "test",
          .entry = "pictures",
          .file = "",
          .images = {{.name = "source",
                      .binding = 0,
                      .type = "texture2D",
                      .format = PixelFormat::kR32f,
                      .meaning = "depth"},
                     {.name = "target",
                      .binding = 1,
                      .access = Access::kWrite,
                      .type = "image2D",
                      .format = PixelFormat::kRgba8}},
          .push = {},
          .features = {"shaderStorageImageWriteWithoutFormat"},
          .conventions = {{"y", {"down", "up"}}, {"depth", {"reverse", "standard"}}}};
}

// The target is rgba8 in the shader, and yet 2 and -1 are seen: they were stored as floats.
TEST_F(Foreign, DepthAndRowsAreConvertedAndANarrowFormatIsJudgedAsFloat) {
  write("picture.comp", R"(#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D source;
layout(binding = 1, rgba8) uniform writeonly image2D target;
void main() {
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(p, imageSize(target)))) return;
  imageStore(target, p, vec4(texelFetch(source, p, 0).r, p.y, 2.0, -1.0));
})");
  constexpr unsigned kWidth = 3, kHeight = 4;
  std::vector<float> depths(kWidth * kHeight, 0.25f);
  depths[1] = std::numeric_limits<float>::infinity();
  depths[4] = 1.0f;
  depths[8] = 1e38f;
  for (const bool foreign : {true, false}) {
    const fs::path file =
        write("picture.json",
              fmt::format(R"({{"files": {{"comp": "picture.comp"}}{}}})",
                          foreign ? R"(, "conventions": {"y": "up", "depth": "standard"})" : ""));
    const KernelRecord r = pictures();
    KernelModule module = loadKernel(file, r, folder);
    EXPECT_FALSE(says(disassemble(module.words), "Rgba8"));  // lavapipe would overlook it
    const Subject subject(*gpu, r, std::move(module));
    const Observation o = observe(
        subject,
        {.inputImages = {{"source",
                          {.format = PixelFormat::kR32f, .width = kWidth, .height = kHeight},
                          std::as_bytes(std::span(depths))}},
         .outputImages = {{"target", kWidth, kHeight}},
         .extent = {kWidth, kHeight}});
    EXPECT_TRUE(o.findings.empty()) << all(o);
    const auto pixels = elementsOf<vec4>(o.plain.at("target"));
    for (unsigned i = 0; i < kWidth * kHeight; ++i) {
      const float z = depths[i];
      const auto row = static_cast<float>(foreign ? kHeight - 1 - i / kWidth : i / kWidth);
      EXPECT_EQ(pixels[i].x, foreign && std::isfinite(z) ? 1 - z : z) << i;
      EXPECT_EQ(pixels[i].y, row) << i;
      EXPECT_EQ(pixels[i].z, 2.0f);
      EXPECT_EQ(pixels[i].w, -1.0f);
    }
    EXPECT_TRUE(o.plain.contains("target as RGBA8"));
  }
}

// ---- files ----------------------------------------------------------------------------------

TEST_F(Foreign, AnHlslEntryPointIsLoadedAndRuns) {
  write("copy.hlsl", R"(struct Item { float3 a; float r; uint k; float3 m0; float3 m1; float3 m2; };
[[vk::binding(4, 0)]] StructuredBuffer<Item> theirs;
[[vk::binding(5, 0)]] RWStructuredBuffer<Item> made;
[[vk::binding(6, 0)]] cbuffer Dispatch { uint count; };
[numthreads(32, 1, 1)] void CSMain(uint3 id : SV_DispatchThreadID) {
  if (id.x < count) made[id.x] = theirs[id.x];
})");
  const fs::path file = write("copy.json", R"({"language": "hlsl", "files": {"comp": "copy.hlsl"},
  "entry": "CSMain", "bindings": {"items": [0, 4], "copies": [0, 5]}})");
  const KernelRecord r = record();
  const Observation o = seen(r, loadKernel(file, r, folder), randomItems());
  EXPECT_TRUE(o.findings.empty()) << all(o);
  EXPECT_EQ(o.unmapped, std::set<std::string>{"copies.m"});
  const auto items = randomItems();
  const auto copies = elementsOf<Copy>(o.plain.at("copies"));
  for (std::size_t i = 0; i < kCount; ++i)
    EXPECT_EQ(std::memcmp(&items[i], &copies[i], offsetof(Item, m)), 0) << i;
}

/// The record with an entry point around somebody's functions.
KernelRecord callingRecord(const fs::path& folder) {
  std::ofstream(folder / "entry.glsl") << kHead +
                                              R"(#extension GL_GOOGLE_include_directive : require
#include "FUNCTIONS"
struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, scalar) readonly buffer A { Item items[]; };
layout(binding = 1, scalar) writeonly buffer B { Item copies[]; };
)" + kPush + kMain + R"(
copies[i].a = items[i].a;
copies[i].m = items[i].m;
#ifdef GNOMON_R
copies[i].r = GNOMON_R;
#endif
#ifdef GNOMON_K
copies[i].k = GNOMON_K;
#endif
})";
  KernelRecord r = record();
  r.functions = {.file = "entry.glsl",
                 .slots = {{.name = "R", .output = "copies.r"},
                           {.name = "K", .output = "copies.k"},
                           {.name = "curve", .push = "count"}}};
  return r;
}

TEST_F(Foreign, FunctionsWithoutAnEntryPointAreCalledAndTheRestIsNotJudged) {
  const KernelRecord r = callingRecord(folder);
  write("theirs.glsl", "float half_(float x) { return x * 0.5; }\n");
  const fs::path file = write("theirs.json", R"json({"files": {"comp": "theirs.glsl"},
    "functions": {"R": "half_(float(i))"}})json");
  const Observation o = seen(r, loadKernel(file, r, folder), randomItems());
  EXPECT_TRUE(o.findings.empty()) << all(o);
  EXPECT_EQ(o.unmapped, std::set<std::string>{"copies.k"});
  EXPECT_EQ(elementsOf<Copy>(o.plain.at("copies"))[7].r, 3.5f);
}

TEST_F(Foreign, FunctionsThatDoNotFitAreNamed) {
  const KernelRecord r = callingRecord(folder);
  write("theirs.glsl", "float twice(float x) { return 2 * x; }\n");
  const fs::path file = folder / "theirs.json";
  const auto said = [&](const std::string& slot, const std::string& expression) {
    write("theirs.json",
          fmt::format(R"({{"files": {{"comp": "theirs.glsl"}}, "functions": {{"{}": "{}"}}}})",
                      slot, expression));
    return refusal(file, r);
  };
  EXPECT_EQ(said("D", "twice(1)"),
            file.string() + ": 'functions' gives 'D'; test/copy takes R, K, curve");
  EXPECT_EQ(said("curve", "twice(1)"),
            file.string() +
                ": 'functions' gives 'curve': say in 'constants' which count of test/copy it is");
  EXPECT_TRUE(says(said("R", "thrice(1)"), "'thrice' : no matching overloaded function"));
  EXPECT_TRUE(says(said("R", "vec3(1)"), file.string() + ": with its 'functions':\n"));
  EXPECT_EQ(refusal(file), file.string() + ": test/copy takes no 'functions'");
  write("theirs.glsl", "float twice(float x) { return 2 * x }\n");
  EXPECT_TRUE(says(said("R", "twice(1)"), "theirs.glsl:1"));
  fs::remove(folder / "theirs.glsl");
  EXPECT_EQ(said("R", "twice(1)"), (folder / "theirs.glsl").string() + ": no such file");
  EXPECT_TRUE(says(refusal(write("long.json", R"({"files": {"comp": ")" + std::string(300, 'x') +
                                                  R"("}, "functions": {"R": "1.0"}})"),
                           r),
                   "no such file"));
}

TEST_F(Foreign, JunkIsRefusedWithItsName) {
  std::mt19937 random(3);
  std::string noise(4096, ' ');
  for (char& c : noise) c = static_cast<char>(random());
  const SpirvWords spirv = compileText(kHead + kPush + kMain + "}");
  const std::string half(reinterpret_cast<const char*>(spirv.data()), spirv.size() / 2 * 4);
  for (const char* ending : {".comp", ".hlsl", ".spv", ".json", ".txt", ""})
    for (const std::string& text : {noise, half, std::string("hello"), std::string()})
      refusal(write(std::string("junk") + ending, text));
  refusal(folder / "missing.comp");
  fs::create_directory(folder / "folder.comp");
  for (const char* ending : {".comp", ".hlsl", ".spv", ".json"}) {
    const fs::path directory = folder / (std::string("folder") + ending);
    fs::create_directories(directory);
    refusal(directory);
    refusal(folder / (std::string(300, 'x') + ending));
  }
}

TEST_F(Foreign, AnEntryPointThatIsMissingOrNoComputeShaderIsNamedWithItsFile) {
  const std::string text =
      "RWStructuredBuffer<uint> to; [numthreads(8, 1, 1)] void CSMain() { to[0] = 1; }\n";
  EXPECT_EQ(refusal(write("a.hlsl", text)),
            (folder / "a.hlsl").string() +
                ": entry point 'main' is empty or not there; an adapter's 'entry' names another");
  const std::string vertex = "#version 450\nvoid main() { gl_Position = vec4(0); }\n";
  EXPECT_EQ(refusal(write("a.vert", vertex)),
            (folder / "a.vert").string() + ": 'main' is a vertex shader, not a compute shader");
  const SpirvWords words = compileText(vertex, ".vert");
  EXPECT_EQ(
      refusal(write("a.spv", {reinterpret_cast<const char*>(words.data()), 4 * words.size()})),
      (folder / "a.spv").string() + ": 'main' is a vertex shader, not a compute shader");
}

// ---- hostile SPIR-V -------------------------------------------------------------------------

SpirvWords damaged(const SpirvWords& words, std::mt19937& random) {
  SpirvWords w = words;
  const auto below = [&](std::size_t n) { return random() % std::max<std::size_t>(n, 1); };
  for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
    const std::size_t at = below(w.size()), other = below(w.size());
    switch (below(7)) {
      case 0:
        w[at] ^= 1u << below(32);
        break;
      case 1:
        w[at] ^= 1u << below(4);  // mostly another id or literal, which may well be valid
        break;
      case 2:
        std::swap(w[at], w[other]);
        break;
      case 3:
        if (below(4) == 0) w.resize(std::max<std::size_t>(at, 1));
        break;
      case 4:
        w[at] = static_cast<std::uint32_t>(below(w[3 % w.size()]));
        break;
      case 5:
        w[at] = w[other];
        break;
      default: {
        const std::size_t length = std::min(below(12), w.size() - other);
        const SpirvWords chunk(w.begin() + static_cast<std::ptrdiff_t>(other),
                               w.begin() + static_cast<std::ptrdiff_t>(other + length));
        w.insert(w.begin() + static_cast<std::ptrdiff_t>(at), chunk.begin(), chunk.end());
      }
    }
  }
  return w;
}

/// Ours, whatever they are, and two whose interface the record knows.
std::vector<SpirvWords> manyModules() {
  const fs::path kernels = fs::path(GNOMON_SOURCE_DIR) / "kernels";
  std::set<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kernels))
    if (entry.path().extension() == ".comp") files.insert(entry.path());
  std::vector<SpirvWords> modules = {
      compileText(kHead + kInPlace + kPush + kMain + kCopyInPlace + "}"),
      compileText(kHead + R"(struct Item { vec3 a; float r; uint k; mat3 m; };
layout(binding = 0, scalar) buffer A { Item items[]; };
layout(binding = 1, scalar) buffer B { Item copies[]; };
)" + kPush + kMain +
                  "copies[i] = items[i]; }")};
  for (const fs::path& file : files)
    modules.push_back(compileShader(file, {.includeFolders = {kernels}}));
  return modules;
}

/// What a child tells of its work; it lies in memory that both see.
struct Progress {
  unsigned next = 0;  ///< the copy that it is at
  char step[32]{};    ///< and what it does with it
  unsigned valid = 0, reflected = 0, mapped = 0;
  char complaint[512]{};

  void enter(const char* what) { std::strncpy(step, what, sizeof step - 1); }
};

constexpr unsigned kCopies = 10'000;

void handle(const SpirvWords& words, Progress& progress) {
  const auto attempt = [&](const char* what, const auto& action) {
    progress.enter(what);
    try {
      action();
      return true;
    } catch (const UsageError&) {
      return false;
    }
  };
  attempt("parse", [&] { parseSpirv(words); });
  bool valid = false;
  attempt("validate", [&] { valid = validateSpirv(words).empty(); });
  if (!valid) return void(attempt("withoutImageFormats", [&] { withoutImageFormats(words); }));
  ++progress.valid;
  const auto stillValid = [&](const char* what, const SpirvWords& twin) {
    if (const std::string why = validateSpirv(twin); !why.empty() && progress.complaint[0] == 0)
      fmt::format_to_n(progress.complaint, sizeof progress.complaint - 1,
                       "copy {}: {} is not valid: {}", progress.next, what, why);
  };
  attempt("withoutImageFormats", [&] { withoutImageFormats(words); });
  attempt("strictTwin", [&] { stillValid("strictTwin", strictTwin(words, {true, true})); });
  attempt("orderTwin", [&] { stillValid("orderTwin", orderTwin(words, {.subgroupSize = 8})); });
  attempt("threadsCommunicate", [&] { threadsCommunicate(words); });
  Reflection reflection;
  if (!attempt("reflect", [&] { reflection = reflect(words); })) return;
  ++progress.reflected;
  const KernelRecord r = record();
  const Adapter adapter{.bindings = kInPlaceBindings, .fields = kInPlaceFields};
  for (const Adapter* a : {static_cast<const Adapter*>(nullptr), &adapter})
    if (attempt("interfaceOf", [&] { interfaceOf(r, reflection, a, "copy.spv"); }))
      ++progress.mapped;
}

/// Does the copies from progress.next on; only a crash, a hang or an exception of another kind
/// ends it early.
void workThrough(const std::vector<SpirvWords>& modules, Progress& progress) {
  for (; progress.next < kCopies; ++progress.next) {
    const itimerval limit{.it_interval = {}, .it_value = {.tv_sec = 5, .tv_usec = 0}};
    setitimer(ITIMER_REAL, &limit, nullptr);  // SIGALRM ends the child
    std::mt19937 random(progress.next);
    handle(damaged(modules[progress.next % modules.size()], random), progress);
  }
}

TEST_F(Foreign, HostileModulesEndInAnErrorOrAnAnswer) {
  const std::vector<SpirvWords> modules = manyModules();
  ASSERT_GT(modules.size(), 5u);
  void* shared =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  Progress& progress = *new (shared) Progress;
  std::vector<std::string> deaths;
  while (progress.next < kCopies && deaths.size() < 20) {
    const pid_t child = fork();
    if (child == 0) {
      signal(SIGALRM, SIG_DFL);
      try {
        workThrough(modules, progress);
        _exit(0);
      } catch (...) {
        _exit(3);
      }
    }
    ASSERT_GT(child, 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    if (progress.next >= kCopies) break;
    deaths.push_back(fmt::format(
        "copy {} of module {} in {}: {}", progress.next, progress.next % modules.size(),
        progress.step, WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "another exception"));
    ++progress.next;
  }
  EXPECT_TRUE(deaths.empty()) << fmt::format("{}", fmt::join(deaths, "\n"));
  EXPECT_STREQ(progress.complaint, "");
  // The damage is not all of a kind that the first check finds.
  EXPECT_GT(progress.valid, kCopies / 20);
  EXPECT_GT(progress.reflected, kCopies / 20);
  EXPECT_GT(progress.mapped, 0u);
  munmap(shared, sizeof(Progress));
}

}  // namespace
}  // namespace gnomon
