// A failure is shrunk, written to a file and replayed from it, as a user meets it.
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = GNOMON_SOURCE_DIR;

/// The project's kernel with some text replaced, in a copy of kernels/.
fs::path broken(const Scratch& scratch, const std::string& kernel, const std::string& file,
                const std::string& from, const std::string& to) {
  const fs::path copy = scratch.path() / "kernels";
  fs::copy(kRoot / "kernels", copy, fs::copy_options::recursive);
  std::ifstream in(copy / file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << file << " no longer holds '" << from << "'";
  std::ofstream(copy / file) << text.replace(at, from.size(), to);
  return copy / (kernel + ".comp");
}

/// What was got, what was allowed and the model's value.
std::string numbersIn(const std::string& output) {
  const std::size_t got = output.find("  got  "), model = output.find("  model  ", got);
  if (got == std::string::npos || model == std::string::npos) return "";
  return output.substr(got, output.find('\n', model) - got);
}

struct Found {
  Said said;
  fs::path file;
};

Found shrunk(const Scratch& scratch, const std::string& kernel, const fs::path& wrong,
             const std::string& name, const std::string& flags = "") {
  const fs::path out = scratch.path() / "out";
  return {gnomonSays(fmt::format("validate {} --filter '{}' --cases 4096 --out {} --kernel {}={}",
                                 flags, name, out.string(), kernel, wrong.string())),
          out / "failures" / (name + ".json")};
}

void expectReplays(const Found& found, const std::string& kernel, const fs::path& wrong) {
  ASSERT_EQ(found.said.status, 1) << found.said.output;
  const std::string command =
      fmt::format("reproduce: ./gnomon validate --replay '{}' --kernel '{}={}'",
                  found.file.string(), kernel, wrong.string());
  EXPECT_NE(found.said.output.find(command), std::string::npos) << found.said.output;
  const Said again = gnomonSays(fmt::format("validate --replay {} --kernel {}={}",
                                            found.file.string(), kernel, wrong.string()));
  EXPECT_EQ(again.status, 1) << again.output;
  EXPECT_EQ(again.output.find("Shrunk"), std::string::npos) << again.output;
  EXPECT_NE(again.output.find(command), std::string::npos) << again.output;
  const std::string numbers = numbersIn(found.said.output);
  EXPECT_FALSE(numbers.empty()) << found.said.output;
  EXPECT_EQ(numbers, numbersIn(again.output));
  const Said mended = gnomonSays("validate --replay " + found.file.string());
  EXPECT_EQ(mended.status, 0) << mended.output;
}

TEST(Replay, AWrongPiShowsOnOneSampleOfAxesAndComesBack) {
  const Scratch scratch;
  const fs::path wrong = broken(scratch, "brdf/evaluate", "lib/brdf.glsl", "kPi = 3.14159265358979",
                                "kPi = 3.14160265358979");
  const Found found =
      shrunk(scratch, "brdf/evaluate", wrong, "BrdfEvaluate.LobeStaysInsideTheBound");
  expectReplays(found, "brdf/evaluate", wrong);
  const auto json = nlohmann::json::parse(std::ifstream(found.file));
  EXPECT_EQ(json["field"], "D");
  ASSERT_EQ(json["input"]["buffers"]["samples"].size(), 1u);
  EXPECT_EQ(json["input"]["buffers"]["samples"][0]["normal"], nlohmann::json({0, 0, 1}));
}

TEST(Replay, WithoutShrinkingAFailureIsShownAsItWasGenerated) {
  const Scratch scratch;
  const fs::path wrong = broken(scratch, "brdf/evaluate", "lib/brdf.glsl", "kPi = 3.14159265358979",
                                "kPi = 3.14160265358979");
  const Found found = shrunk(scratch, "brdf/evaluate", wrong,
                             "BrdfEvaluate.LobeStaysInsideTheBound", "--no-shrink");
  EXPECT_EQ(found.said.status, 1) << found.said.output;
  EXPECT_EQ(found.said.output.find("Shrunk"), std::string::npos) << found.said.output;
  EXPECT_NE(found.said.output.find("reproduce: ./gnomon validate --filter"), std::string::npos)
      << found.said.output;
  EXPECT_FALSE(fs::exists(found.file));
}

// The fault lies between the two thresholds, so the shortest number there is 0.004.
TEST(Replay, AWrongThresholdShowsOnOnePixelBetweenTheTwo) {
  const Scratch scratch;
  const fs::path wrong =
      broken(scratch, "tonemap/resolve", "lib/tonemap.glsl", "x <= 0.0031308", "x <= 0.0041308");
  const Found found =
      shrunk(scratch, "tonemap/resolve", wrong, "TonemapResolve.ShadowsStayInsideTheBound");
  expectReplays(found, "tonemap/resolve", wrong);
  const auto input = nlohmann::json::parse(std::ifstream(found.file))["input"];
  EXPECT_EQ(input["push"]["size"], nlohmann::json({1, 1}));
  EXPECT_EQ(input["images"]["hdr"]["texels"], nlohmann::json({{0.004, 0, 0, 0}}));
}

TEST(Replay, WhatIsLeftUnwrittenShowsOnOnePixel) {
  const Scratch scratch;
  const fs::path wrong = broken(scratch, "post/views", "post/views.comp", "greaterThanEqual(",
                                "greaterThan(uvec2(1), uvec2(0))) || any(greaterThanEqual(");
  const Found found =
      shrunk(scratch, "post/views", wrong, "PostViews.EveryModeStaysInsideTheBound");
  ASSERT_EQ(found.said.status, 1) << found.said.output;
  EXPECT_NE(found.said.output.find("'albedo' of 1 x 1"), std::string::npos) << found.said.output;
  EXPECT_EQ(gnomonSays(fmt::format("validate --replay {} --kernel post/views={}",
                                   found.file.string(), wrong.string()))
                .status,
            1);
}

TEST(Replay, FilesThatAreNoneAreRefused) {
  const Scratch scratch;
  const auto refused = [&](const std::string& arguments, const std::string& culprit) {
    const Said said = gnomonSays("validate --replay " + arguments);
    EXPECT_EQ(said.status, 2) << arguments << "\n" << said.output;
    EXPECT_NE(said.output.find(culprit), std::string::npos) << said.output;
  };
  const auto file = [&](const std::string& name, const std::string& kernel, int judgement,
                        const std::string& input) {
    return scratch
        .file("input.json",
              fmt::format(R"({{"schema": 1, "case": "{}", "kernel": "{}", "seed": 1, "device": "",
                "output": "", "field": "", "judgement": {}, "input": {}}})",
                          name, kernel, judgement, input))
        .string();
  };
  const std::string lobe = "BrdfEvaluate.LobeStaysInsideTheBound",
                    none = R"({"buffers": {"samples": []}})";
  ASSERT_EQ(gnomonSays("validate --replay " + file(lobe, "brdf/evaluate", 0, none)).status, 0);
  refused("/no/such/file.json", "/no/such/file.json");
  refused(scratch.file("junk.json", "junk").string(), "junk.json");
  refused(file("No.Such", "brdf/evaluate", 0, none), "No.Such");
  refused(file("*", "brdf/evaluate", 0, none), "'*'");
  refused(file(lobe, "tonemap/resolve", 0, "{}"), "tonemap/resolve");
  refused(file(lobe, "brdf/evaluate", 1, none), "judgement");
  refused(file(lobe, "brdf/evaluate", 0, "{}"), "no buffer 'samples'");
  refused(file("BrdfEvaluateLaws.AMetalHasNoDiffuse", "brdf/evaluate", 0, none), "judgement");
  const auto frame = [&](const char* exposure, const char* size) {
    return file("TonemapResolve.BulkStaysInsideTheBound", "tonemap/resolve", 0,
                fmt::format(R"({{"push": {{"size": {}, "exposure": {}, "bloomIntensity": 0,
                  "curve": 0, "transfer": 0}}, "images": {{
                  "hdr": {{"size": [1, 1], "ofExtent": true, "texels": [[0, 0, 0, 0]]}},
                  "bloom": {{"size": [1, 1], "ofExtent": false, "texels": [[0, 0, 0, 0]]}}}}}})",
                            size, exposure));
  };
  ASSERT_EQ(gnomonSays("validate --replay " + frame("1", "[1, 1]")).status, 0);
  refused(frame("0", "[1, 1]"), "contract");
  refused(frame("1", "[4000000000, 4000000000]"), "sizes");
  refused(file(lobe, "brdf/evaluate", 0, none) + " brdf", "--replay");
  refused(file(lobe, "brdf/evaluate", 0, none) + " --cases 7", "--replay");
}

}  // namespace
}  // namespace gnomon
