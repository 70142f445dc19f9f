// The command line as scripts rely on it: exit statuses, messages, JSON keys.
#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

std::ptrdiff_t lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

/// Exit 2, a few lines, the culprit named.
void expectUsageError(const std::string& arguments, const std::string& culprit) {
  const Said said = gnomonSays(arguments);
  EXPECT_EQ(said.status, 2) << arguments << "\n" << said.output;
  EXPECT_LE(lines(said.output), 12) << said.output;
  EXPECT_NE(said.output.find(culprit), std::string::npos) << said.output;
}

TEST(Command, NamesWhatIsWrongWithItsArguments) {
  expectUsageError("no-such-command", "no-such-command");
  expectUsageError("", "which command");
  expectUsageError("validate no_such_stage", "no_such_stage");
  expectUsageError("validate --no-such-flag", "no-such-flag");
  expectUsageError("validate --filter 'NoSuch*'", "NoSuch*");
  expectUsageError("validate --shard 3/2", "3/2");
  expectUsageError("validate --cases many", "many");
  expectUsageError("validate --timeout 0", "--timeout");
  expectUsageError("list nonsense", "nonsense");
  expectUsageError("bench no_such_stage", "no_such_stage");
  expectUsageError("bench --baseline /no/such/file", "/no/such/file");
  expectUsageError("validate brdf --kernel brdf/evaluate", "brdf/evaluate");
  expectUsageError("validate brdf --kernel no/kernel=x.comp", "no/kernel");
}

TEST(Command, RefusesForeignKernelsThatAreNone) {
  const Scratch scratch;
  const auto judge = [&](const std::string& file) {
    return "validate brdf --kernel brdf/evaluate=" + (scratch.path() / file).string();
  };
  scratch.file("junk.spv", "not spir-v");
  scratch.file("words.spv", "0123456789abcdef");
  scratch.file("broken.comp", "#version 450\nvoid main( {");
  scratch.file("empty.comp", "");
  scratch.file("other.comp", "#version 450\nvoid main() {}\n");
  expectUsageError(judge("none.comp"), "none.comp");
  expectUsageError(judge("junk.spv"), "junk.spv");
  expectUsageError(judge("words.spv"), "words.spv");
  expectUsageError(judge("broken.comp"), "broken.comp");
  expectUsageError(judge("empty.comp"), "empty.comp");
  expectUsageError(judge("other.comp"), "no buffer 'samples'");
}

TEST(Command, CompareRefusesFilesThatAreNoImages) {
  const Scratch scratch;
  const std::string junk = scratch.file("junk.exr", "junk").string();
  expectUsageError("compare " + junk + " " + junk, "junk.exr");
  expectUsageError("compare none.exr none.exr", "none.exr");
}

TEST(Command, SaysThatThereIsNoSuchDevice) {
  const Said said = gnomonSays("validate brdf --device no-such-device");
  EXPECT_EQ(said.status, 3) << said.output;
  EXPECT_NE(said.output.find("no-such-device"), std::string::npos) << said.output;
}

TEST(Command, HelpNamesEveryCommandAndExitStatus) {
  const Said said = gnomonSays("--help");
  EXPECT_EQ(said.status, 0);
  for (const char* word : {"devices", "list", "validate", "bench", "test", "Exit status"})
    EXPECT_NE(said.output.find(word), std::string::npos) << word;
  for (const char* command : {"devices", "list", "validate", "bench", "test"})
    EXPECT_EQ(gnomonSays(std::string(command) + " --help").status, 0) << command;
}

TEST(Command, ListsStagesKernelsAndCases) {
  EXPECT_NE(gnomonSays("list stages").output.find("brdf"), std::string::npos);
  EXPECT_NE(gnomonSays("list kernels").output.find("brdf/evaluate"), std::string::npos);
  const Said cases = gnomonSays("list cases brdf");
  EXPECT_EQ(cases.status, 0);
  EXPECT_NE(cases.output.find("BrdfEvaluate.LobeStaysInsideTheBound"), std::string::npos);
  EXPECT_EQ(cases.output.find("Precision"), std::string::npos) << "another stage's cases";
}

TEST(Command, TellsTheKindOfEachCase) {
  const Scratch scratch;
  const auto file = scratch.path() / "cases.json";
  ASSERT_EQ(gnomonSays("list cases brdf --json " + file.string()).status, 0);
  const auto kind = nlohmann::json::parse(std::ifstream(file))["kind"];
  EXPECT_EQ(kind["BrdfEvaluate.LobeStaysInsideTheBound"], "comparison");
  EXPECT_EQ(kind["BrdfEvaluateProbes.ContractAndModelNameTheSame"], "comparison");
  EXPECT_EQ(kind["BrdfEvaluateLaws.AMetalHasNoDiffuse"], "law");
  EXPECT_EQ(kind["BrdfEvaluateModel.FresnelRisesWithTheFifthPower"], "truth");
  EXPECT_EQ(kind["BrdfEvaluateParts.EvaluateIsMadeOfItsParts"], "composition");
  EXPECT_EQ(kind["BrdfEvaluateBound.TheBoundTellsTheUsualConfusionsApart"], "bound");
  const Said laws = gnomonSays("list cases brdf --kind law");
  EXPECT_NE(laws.output.find("BrdfEvaluateLaws.AMetalHasNoDiffuse"), std::string::npos);
  EXPECT_EQ(laws.output.find("LobeStays"), std::string::npos) << laws.output;
}

TEST(Command, ValidateWritesTheJsonThatScriptsRelyOn) {
  const Scratch scratch;
  const auto file = scratch.path() / "v.json";
  const Said said = gnomonSays("validate brdf --cases 512 --seed 7 --json " + file.string());
  ASSERT_EQ(said.status, 0) << said.output;
  const auto json = nlohmann::json::parse(std::ifstream(file));
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["seed"], 7);
  for (const char* key : {"name", "driver", "api", "subgroupSize"})
    EXPECT_TRUE(json["device"].contains(key)) << key;
  ASSERT_EQ(json["stages"].size(), 1u);
  for (const char* key :
       {"stage", "kernel", "class", "cases", "failed", "skipped", "elements", "outside",
        "ambiguous", "reassociated", "maxBudget", "seconds", "unsupported", "failures"})
    EXPECT_TRUE(json["stages"][0].contains(key)) << key;
  EXPECT_EQ(json["stages"][0]["class"], "conforms");
  EXPECT_EQ(json["failed"], 0);
}

TEST(Command, JsonOnStandardOutputIsNothingButJson) {
  const Said said = gnomonSays("validate brdf --cases 64 --json -", "2>/dev/null");
  EXPECT_TRUE(nlohmann::json::accept(said.output)) << said.output;
}

TEST(Command, JunitHoldsEveryCase) {
  const Scratch scratch;
  const auto file = scratch.path() / "v.xml";
  ASSERT_EQ(gnomonSays("validate brdf --cases 64 --junit " + file.string()).status, 0);
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(text.find("name=\"BrdfEvaluate.LobeStaysInsideTheBound\""), std::string::npos) << text;
}

TEST(Command, ShardsSplitTheCasesBetweenThem) {
  const auto count = [](const std::string& more) {
    const Scratch scratch;
    const auto file = scratch.path() / "v.json";
    gnomonSays("validate brdf --cases 64 --json " + file.string() + more);
    return nlohmann::json::parse(std::ifstream(file))["stages"][0]["cases"].get<int>();
  };
  EXPECT_EQ(count(" --shard 1/3") + count(" --shard 2/3") + count(" --shard 3/3"), count(""));
}

TEST(Command, AFailureExitsWithOneAndSaysHowToSeeItAgain) {
  const Scratch scratch;
  const auto kernel = scratch.file("wrong.comp", R"(#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "brdf.h"
layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Evaluate push; };
layout(set = 0, binding = kSamples, scalar) readonly buffer Samples { Sample samples[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Results { Shaded results[]; };
void main() {}
)");
  const Said said = gnomonSays(
      "validate --filter '*LobeStays*' --cases 64 --kernel brdf/evaluate=" + kernel.string());
  EXPECT_EQ(said.status, 1) << said.output;
  EXPECT_NE(said.output.find("unwritten"), std::string::npos) << said.output;
  EXPECT_NE(said.output.find("reproduce: ./gnomon validate --replay"), std::string::npos);
}

}  // namespace
}  // namespace gnomon
