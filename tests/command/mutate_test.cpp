// `gnomon mutate` as a user and CI meet it: a seeded sample of every kernel and model against the
// record, kernels of the user's, wrong flags.
#include <algorithm>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

nlohmann::json jsonOf(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

// Exit 0 says that README.md gives the scores on record and that every survivor of the sample is
// explained there.
TEST(Mutate, ASampleOfEveryKernelAndModelIsAsOnRecord) {
  const Scratch scratch;
  const auto file = scratch.path() / "m.json";
  const Said said = gnomonSays("mutate --sample 8 --seed 7 --json " + file.string());
  EXPECT_EQ(said.status, 0) << said.output;
  const nlohmann::json json = jsonOf(file);
  EXPECT_EQ(json["sample"], 8);
  ASSERT_GE(json["stages"].size(), 15u);
  for (const nlohmann::json& stage : json["stages"]) {
    EXPECT_EQ(stage["mutants"], 8) << stage["kernel"];
    EXPECT_EQ(stage["killed"].get<std::size_t>() + stage["survived"].size(), 8u);
    for (const nlohmann::json& survivor : stage["survived"])
      EXPECT_FALSE(survivor["reason"].is_null()) << survivor;
    for (const nlohmann::json& kill : stage["kills"])
      EXPECT_FALSE(kill["by"].get<std::string>().empty()) << kill;
  }
}

// tests/mutants/alone.json names for each of them a mutant that would live without it. Cases of the
// other kinds are not asked, nor is any other mutant: that takes minutes.
// TODO: culling's laws and truth; most of the latter is of host code, which nothing alters.
TEST(Mutate, EveryLawAndTruthTestTellsAMutantThatNoOtherDoes) {
  const Scratch scratch;
  const nlohmann::json alone = jsonOf(GNOMON_SOURCE_DIR "/tests/mutants/alone.json");
  std::string ids;
  for (const nlohmann::json& id : alone) ids += (ids.empty() ? "" : ",") + id.get<std::string>();
  const auto file = scratch.path() / "kills.json";
  const Said said = gnomonSays("list cases brdf tonemap post --kind law,truth --kills --mutants '" +
                               ids + "' --json " + file.string());
  ASSERT_EQ(said.status, 0) << said.output;
  const nlohmann::json cases = jsonOf(file)["cases"];
  EXPECT_EQ(cases.size(), alone.size()) << "alone.json names a case that is none";
  for (const nlohmann::json& c : cases) {
    const std::string name = c["case"], id = alone.value(name, "");
    const std::vector<std::string> only = c["only"];
    EXPECT_EQ(std::ranges::count(only, id), 1)
        << name << " does not alone tell '" << id << "', as tests/mutants/alone.json says.\n"
        << "`gnomon list cases --kills --json -` lists under \"only\" what it does; where that is "
           "nothing, strengthen it or merge it with its like";
  }
}

// In a kernel of the user's, mutants are hers: of the operators that she asks for.
TEST(Mutate, TakesAKernelOfTheUsers) {
  const Scratch scratch;
  const auto file = scratch.path() / "m.json";
  const Said said = gnomonSays("mutate brdf --kernel brdf/evaluate=" GNOMON_SOURCE_DIR
                               "/data/kernels/engine.json "
                               "--operators comparison,store --sample 4 --json " +
                               file.string());
  EXPECT_NE(said.status, 2) << said.output;
  const nlohmann::json json = jsonOf(file);
  ASSERT_EQ(json["stages"].size(), 1u);
  EXPECT_EQ(json["stages"][0]["mutants"], 4);
  for (const char* list : {"kills", "survived"})
    for (const nlohmann::json& m : json["stages"][0][list]) {
      EXPECT_TRUE(m["operator"] == "comparison" || m["operator"] == "store") << m;
      EXPECT_EQ(m["file"], "engine.comp") << m;
    }
}

// A kernel that is red already says nothing about its mutants.
TEST(Mutate, RefusesAKernelThatFails) {
  const Scratch scratch;
  std::ifstream in(GNOMON_SOURCE_DIR "/kernels/post/views.comp");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string alpha = ", 0.0, 1.0), 1.0));";
  const std::size_t at = text.find(alpha);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, alpha.size(), ", 0.0, 1.0), 0.5));");
  const auto kernel = scratch.file("views.comp", text);
  const Said said = gnomonSays("mutate post --sample 2 --kernel post/views=" + kernel.string());
  EXPECT_EQ(said.status, 1) << said.output;
  EXPECT_NE(said.output.find("without being mutated"), std::string::npos) << said.output;
}

TEST(Mutate, NamesWhatIsWrongWithItsArguments) {
  const auto refused = [](const std::string& arguments, const std::string& culprit) {
    const Said said = gnomonSays(arguments);
    EXPECT_EQ(said.status, 2) << arguments << "\n" << said.output;
    EXPECT_NE(said.output.find(culprit), std::string::npos) << said.output;
  };
  refused("mutate brdf --operators nonsense", "there is no operator 'nonsense'");
  refused("mutate brdf --sample 0", "--sample");
  refused("mutate brdf --bless --sample 3", "--bless");
  refused("mutate no_such_stage", "no_such_stage");
  refused("mutate precision", "precision");
  refused("list kernels --kills", "--kills");
  refused("list cases --kind nonsense", "nonsense");
  refused("list cases post --kind truth --kills --mutants no:such", "no:such");
}

}  // namespace
}  // namespace gnomon
