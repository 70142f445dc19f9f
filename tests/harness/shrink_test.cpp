// Shrinking: what is simpler, the descent to a minimum, and the file that an input is kept in.
//
// Covered: faults planted at known places and their known minima; the same descent twice; answers
// that contradict each other, errors, no time; unit vectors stay unit vectors; sizes of buffers and
// images; every kind of float there and back through a file; files that are broken in every way.
// Not covered: real kernels (tests/command/replay_test.cpp).
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "harness/cases/case_file.h"
#include "harness/cases/random.h"
#include "harness/cases/shrink.h"
#include "harness/cases/simpler.h"
#include "harness/error.h"
#include "tests/scratch.h"

namespace gnomon {
namespace {

struct Item {
  vec3 normal;
  float roughness;
  vec3 light;
  vec3 colour;
  uint mode;
};

struct Settings {
  uvec2 size;
  float scale;
};

Struct itemLayout() {
  return describe<Item>("Item", field("normal", &Item::normal),
                        field("roughness", &Item::roughness), field("light", &Item::light),
                        field("colour", &Item::colour), field("mode", &Item::mode));
}

ImageSpec imageCalled(const char* name, unsigned binding) {
  return {.name = name, .binding = binding, .access = Access::kRead, .type = "texture2D"};
}

// A kernel for files to be of; nothing runs it.
const KernelRecord kRecord = {.stage = "shrinktest",
                              .entry = "kernel",
                              .file = "",
                              .buffers = {{"items", 0, Access::kRead, itemLayout()}},
                              .images = {imageCalled("whole", 1), imageCalled("part", 2)},
                              .push = describe<Settings>("Settings", field("size", &Settings::size),
                                                         field("scale", &Settings::scale))};
const bool registered = registerKernel(kRecord);

CaseInput itemsOf(const std::vector<Item>& items) {
  const auto bytes = std::as_bytes(std::span(items));
  CaseInput input;
  input.buffers.push_back({"items", itemLayout(), {bytes.begin(), bytes.end()}});
  return input;
}

std::vector<Item> itemsIn(const CaseInput& input) {
  std::vector<Item> items(input.buffers[0].elements());
  if (!items.empty())
    std::memcpy(items.data(), input.buffers[0].bytes.data(), input.buffers[0].bytes.size());
  return items;
}

std::vector<Item> generatedItems(std::size_t n, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<Item> items;
  for (std::size_t i = 0; i < n; ++i)
    items.push_back({vec3(random.direction()), static_cast<float>(random.uniform(0, 9.9)),
                     vec3(random.direction()),
                     vec3(random.uniform(), random.uniform(), random.uniform()),
                     static_cast<uint>(random.below(100))});
  return items;
}

constexpr ShrinkLimits kAmple{.time = std::chrono::minutes(1), .trials = 100'000};

/// Asked one by one; an input fails where the predicate holds.
template <class Fails>
Trials trialsOf(const Fails& fails) {
  return {.fitted = [](const CaseInput& c) { return std::optional(c); },
          .firstFailing = [fails](std::span<const CaseInput> all) -> std::optional<std::size_t> {
            for (std::size_t i = 0; i < all.size(); ++i)
              if (fails(all[i])) return i;
            return std::nullopt;
          },
          .atOnce = [](const CaseInput& c) { return c.buffers[0].elements() == 1; }};
}

template <class Fails>
auto anyItem(const Fails& fails) {
  return trialsOf([fails](const CaseInput& c) { return std::ranges::any_of(itemsIn(c), fails); });
}

TEST(Shrink, APlantedFaultComesDownToItsKnownMinimum) {
  // Of the numbers above 5 with one digit and exponent 0, the smallest.
  const Shrunk s = shrink(itemsOf(generatedItems(1000)),
                          anyItem([](const Item& i) { return i.roughness > 5; }), kAmple);
  EXPECT_TRUE(s.finished);
  const std::vector<Item> items = itemsIn(s.input);
  ASSERT_EQ(items.size(), 1u);
  EXPECT_EQ(items[0].roughness, 6);
  EXPECT_EQ(items[0].normal, vec3(0, 0, 1));
  EXPECT_EQ(items[0].light, vec3(0, 0, 1));
  EXPECT_EQ(items[0].colour, vec3(0));
  EXPECT_EQ(items[0].mode, 0u);
}

TEST(Shrink, AFaultOfTwoFieldsKeepsBoth) {
  const Shrunk s =
      shrink(itemsOf(generatedItems(1000)),
             anyItem([](const Item& i) { return i.mode >= 42 && i.colour.y > 0.3f; }), kAmple);
  const std::vector<Item> items = itemsIn(s.input);
  ASSERT_EQ(items.size(), 1u);
  EXPECT_EQ(items[0].mode, 42u);              // the smallest that fails
  EXPECT_EQ(items[0].colour, vec3(0, 1, 0));  // 1 is simpler than any other number above 0.3
}

TEST(Shrink, WhatNeedsManyElementsKeepsThatMany) {
  const Shrunk s =
      shrink(itemsOf(generatedItems(1000)),
             trialsOf([](const CaseInput& c) { return c.buffers[0].elements() >= 65; }), kAmple);
  EXPECT_EQ(s.input.buffers[0].elements(), 65u);
}

TEST(Shrink, DirectionsStayUnitVectors) {
  const Shrunk s = shrink(itemsOf(generatedItems(100)), anyItem([](const Item& i) {
                            const float cosine = glm::dot(i.normal, i.light);
                            return cosine > 0.1f && cosine < 0.9f;
                          }),
                          kAmple);
  const std::vector<Item> items = itemsIn(s.input);
  ASSERT_EQ(items.size(), 1u);
  EXPECT_TRUE(isUnit(items[0].normal));
  EXPECT_TRUE(isUnit(items[0].light));
  EXPECT_EQ(items[0].normal, vec3(0, 0, 1));
  EXPECT_EQ(items[0].light.x * items[0].light.y, 0) << "in a plane of two axes";
}

TEST(Shrink, EveryCandidateOfADirectionIsAUnitVector) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const vec3 v(random.direction());
    for (const vec3& simpler : simplerDirections(v))
      EXPECT_TRUE(isUnit(simpler)) << simpler.x << " " << simpler.y << " " << simpler.z;
  }
}

TEST(Shrink, TheSameInputComesDownTheSameWay) {
  const auto fails = anyItem([](const Item& i) { return i.roughness * i.colour.x > 1; });
  const Shrunk a = shrink(itemsOf(generatedItems(1000)), fails, kAmple);
  const Shrunk b = shrink(itemsOf(generatedItems(1000)), fails, kAmple);
  EXPECT_TRUE(a.input == b.input);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.trials, b.trials);
}

TEST(Shrink, AnswersThatContradictEachOtherComeToAnEnd) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random coin(seed);
    const Shrunk s = shrink(itemsOf(generatedItems(50, seed)),
                            trialsOf([&](const CaseInput&) { return coin.chance(0.5); }), kAmple);
    EXPECT_LT(s.trials, kAmple.trials);
  }
}

TEST(Shrink, AnErrorKeepsWhatWasFound) {
  int asked = 0;
  const Shrunk s = shrink(itemsOf(generatedItems(1000)), trialsOf([&](const CaseInput& c) {
                            if (++asked == 5) throw GpuError("the device is lost");
                            return c.buffers[0].elements() > 0;
                          }),
                          kAmple);
  EXPECT_EQ(s.input.buffers[0].elements(), 1u);
  EXPECT_FALSE(s.finished);
}

TEST(Shrink, WithoutTimeOrTrialsNothingChanges) {
  const CaseInput original = itemsOf(generatedItems(10));
  const auto always = trialsOf([](const CaseInput&) { return true; });
  for (const ShrinkLimits& none : {ShrinkLimits{.time = {}, .trials = 100},
                                   ShrinkLimits{.time = std::chrono::minutes(1), .trials = 0}}) {
    const Shrunk s = shrink(original, always, none);
    EXPECT_TRUE(s.input == original);
    EXPECT_FALSE(s.finished);
  }
}

TEST(Shrink, AnImageComesDownToThePixelThatFails) {
  Random random(1);
  CaseInput input;
  input.images = {{"whole", {.size = {37, 21}}, true}, {"part", {.size = {18, 10}}, false}};
  for (CaseInput::Image& i : input.images)
    for (uint t = 0; t < i.picture.size.x * i.picture.size.y; ++t)
      i.picture.texels.emplace_back(random.uniform(), random.uniform(), 0.5, 1);
  input.images[0].picture.texels[5 * 37 + 30].x = 7.5f;
  const Shrunk s =
      shrink(input,
             {.fitted = [](const CaseInput& c) { return std::optional(c); },
              .firstFailing = [](std::span<const CaseInput> all) -> std::optional<std::size_t> {
                const bool fails = std::ranges::any_of(all[0].images[0].picture.texels,
                                                       [](const vec4& t) { return t.x > 3; });
                return fails ? std::optional<std::size_t>(0) : std::nullopt;
              },
              .atOnce = [](const CaseInput&) { return false; }},
             kAmple);
  EXPECT_EQ(s.input.images[0].picture.size, uvec2(1));
  EXPECT_EQ(s.input.images[1].picture.size, uvec2(1));
  EXPECT_EQ(s.input.images[0].picture.at(0), vec4(4, 0, 0, 0));  // the smallest digit above 3
  EXPECT_EQ(s.input.images[1].picture.at(0), vec4(0));
}

TEST(Simpler, EveryCandidateOfANumberIsSimplerSoThatChainsEnd) {
  using Limits = std::numeric_limits<float>;
  for (const float x : {0.1f, -3.25f, 1e-30f, 65504.0f, Limits::max(), Limits::denorm_min(),
                        Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN(), -0.0f}) {
    float at = x;
    int steps = 0;
    // The longest chain goes through nine digits, 45 exponents and the bits of nine digits.
    for (auto next = simplerThan(at); !next.empty(); next = simplerThan(at)) {
      at = next.back();
      ASSERT_LT(++steps, 100) << x;
    }
    EXPECT_EQ(std::bit_cast<std::uint32_t>(at), 0u) << x;
  }
}

// ---- files ----------------------------------------------------------------------------------

class CaseFiles : public testing::Test {
 protected:
  std::filesystem::path with(const std::string& text) const {
    return scratch.file("input.json", text);
  }

  static CaseFile example() {
    CaseFile f{.name = "Shrinktest.Case",
               .kernel = "shrinktest/kernel",
               .seed = ~std::uint64_t{0},
               .device = "a \"device\"\n",
               .output = "items",
               .field = "x",
               .judgement = 3,
               .input = itemsOf(generatedItems(2))};
    const Settings push{.size = {2, 1}, .scale = -0.0f};
    const auto bytes = std::as_bytes(std::span(&push, 1));
    f.input.push = {"push", kRecord.push, {bytes.begin(), bytes.end()}};
    f.input.images = {{"whole", {.size = {2, 1}, .texels = {vec4(0.1f), vec4(1)}}, true},
                      {"part", {.size = {1, 1}, .texels = {vec4(3)}}, false}};
    return f;
  }

  Scratch scratch;
};

TEST_F(CaseFiles, EveryKindOfFloatComesBackToTheBit) {
  CaseFile f = example();
  std::vector<vec4> texels;
  std::mt19937_64 random(1);
  for (const std::uint32_t bits :
       {0x00000000u, 0x80000000u, 0x00000001u, 0x807fffffu, 0x00800000u, 0x7f7fffffu, 0xff7fffffu,
        0x7f800000u, 0xff800000u, 0x7fc00000u, 0xffc00000u, 0x7f800001u, 0xffffdeadu, 0x3f800000u})
    texels.emplace_back(std::bit_cast<float>(bits));
  for (int i = 0; i < 10'000; ++i)
    texels.emplace_back(std::bit_cast<float>(static_cast<std::uint32_t>(random())));
  f.input.images[1].picture = {.size = {static_cast<uint>(texels.size()), 1}, .texels = texels};
  const auto file = scratch.path() / "deep/down/input.json";
  ASSERT_TRUE(writeCaseFile(file, f));
  const CaseFile back = readCaseFile(file);
  EXPECT_TRUE(back.input == f.input);
  EXPECT_EQ(back.name, f.name);
  EXPECT_EQ(back.kernel, f.kernel);
  EXPECT_EQ(back.seed, f.seed);
  EXPECT_EQ(back.device, f.device);
  EXPECT_EQ(back.judgement, f.judgement);
}

TEST_F(CaseFiles, WhatIsNoInputIsRefusedWithTheFileAndTheReason) {
  const std::string good = caseFileJson(example());
  ASSERT_NO_THROW(readCaseFile(with(good)));
  const auto edited = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const std::vector<std::pair<std::string, std::string>> broken = {
      {"", "not JSON"},
      {"[]", "not an object"},
      {good.substr(0, good.size() / 2), "not JSON"},
      {std::string(100'000, '['), "not JSON"},
      {std::string(1000, '\0'), "not JSON"},
      {edited("\"schema\": 1", "\"schema\": 2"), "schema"},
      {edited("\"case\"", "\"cased\""), "cased"},
      {edited("\"Shrinktest.Case\"", "7"), "case"},
      {edited("shrinktest/kernel", "no/kernel"), "no/kernel"},
      {edited("\"judgement\": 3", "\"judgement\": -3"), "judgement"},
      {edited("\"seed\": 18446744073709551615", "\"seed\": 1.5"), "seed"},
      {edited("\"scale\": -0.0", "\"scale\": 1e39"), "scale"},
      {edited("\"scale\": -0.0", "\"scale\": 1e999"), "not JSON"},
      {edited("\"scale\": -0.0", "\"scale\": \"NaN 0x3f800000\""), "scale"},
      {edited("\"scale\": -0.0", "\"scale\": null"), "scale"},
      {edited("\"scale\": -0.0", "\"scale\": -0.0, \"more\": 1"), "more"},
      {edited("\"size\": [2, 1]", "\"size\": [2]"), "size"},
      {edited("\"size\": [2, 1]", "\"size\": [2, -1]"), "size"},
      {edited("\"size\": [2, 1], \"ofExtent\"", "\"size\": [4294967295, 4294967295], \"ofExtent\""),
       "texels"},
      {edited("\"items\": [", "\"thing\": ["), "thing"},
      {edited("\"whole\"", "\"hole\""), "hole"}};
  for (const auto& [text, reason] : broken) {
    const auto file = with(text);
    try {
      readCaseFile(file);
      ADD_FAILURE() << "taken: " << text.substr(0, 400);
    } catch (const UsageError& e) {
      const std::string what = e.what();
      EXPECT_NE(what.find(file.string()), std::string::npos) << what;
      EXPECT_NE(what.find(reason), std::string::npos) << what << "\nfor " << reason;
      EXPECT_LT(what.size(), 1000u);
    }
  }
  EXPECT_THROW(readCaseFile(scratch.path() / "none.json"), UsageError);
  EXPECT_THROW(readCaseFile(scratch.path()), UsageError);
}

TEST_F(CaseFiles, WhatCannotBeWrittenIsSaidSo) {
  EXPECT_FALSE(writeCaseFile(with("a file") / "below/it.json", example()));
}

}  // namespace
}  // namespace gnomon
