// `gnomon bench` as scripts rely on it: flags, JSON keys, the plot. Covered with few objects only;
// times are no business of a test.
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"
#include "tests/xml.h"

namespace gnomon {
namespace {

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Exit 2 before anything is timed, the culprit named.
void expectUsageError(const std::string& arguments, const std::string& culprit) {
  const Said said = gnomonSays("bench " + arguments);
  EXPECT_EQ(said.status, 2) << arguments << "\n" << said.output;
  EXPECT_NE(said.output.find(culprit), std::string::npos) << said.output;
}

TEST(Bench, NamesWhatIsWrongWithItsArguments) {
  expectUsageError("objects --to many", "--to");
  expectUsageError("objects --to 99", "--to");
  expectUsageError("brdf --to 1000", "--to");
  expectUsageError("brdf --plot x.svg", "--plot");
  expectUsageError("objects --plot /no/such/folder/x.svg", "/no/such/folder/x.svg");
  expectUsageError("no_such_stage", "objects");
}

/// One run for the tests below, since it casts millions of rays.
class BenchObjects : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch = new Scratch;
    said =
        gnomonSays("bench objects --to 316 --json " + file("o.json") + " --plot " + file("o.svg"));
  }
  static void TearDownTestSuite() { delete scratch; }
  static std::string file(const char* name) { return (scratch->path() / name).string(); }

  inline static Scratch* scratch = nullptr;
  inline static Said said;
};

TEST_F(BenchObjects, WritesAWellFormedPlotOfBothWorlds) {
  ASSERT_EQ(said.status, 0) << said.output;
  const std::string svg = textOf(file("o.svg"));
  EXPECT_EQ(xmlFault(svg), "");
  for (const char* word :
       {">city<", ">field<", ">frustum<", ">hiz<", ">occlusion<", ">cpu_bvh<", ">100<"})
    EXPECT_NE(svg.find(word), std::string::npos) << word;
}

TEST_F(BenchObjects, WritesGoogleBenchmarksJsonWithItsCounters) {
  ASSERT_EQ(said.status, 0) << said.output;
  const auto json = nlohmann::json::parse(std::ifstream(file("o.json")));
  for (const char* key : {"empty_dispatch_seconds", "copy_bytes_per_second"})
    EXPECT_TRUE(json["context"].contains(key)) << key;
  std::set<std::string> names;
  for (const auto& b : json["benchmarks"]) {
    if (b.value("aggregate_name", "") != "median") continue;
    const std::string name = b["run_name"];
    names.insert(name.substr(0, name.rfind('/')));
    const bool draws = name.find("/hiz/") == name.npos, moves = name.find("/cpu_") == name.npos;
    for (const char* key : {"survivors", "culled", "draws_before", "draws_after"})
      EXPECT_EQ(b.contains(key), draws) << name << ": " << key;
    for (const char* key : {"bytes_per_second", "share_of_copy"})
      EXPECT_EQ(b.contains(key), moves) << name << ": " << key;
  }
  for (const char* world : {"city", "field"})
    for (const char* entry : {"cpu_none", "cpu_frustum", "cpu_bvh", "frustum", "hiz", "occlusion"})
      for (const char* objects : {"100", "316"})
        EXPECT_TRUE(names.contains(std::string("objects/") + world + "/" + entry + "/" + objects))
            << world << entry << objects;
}

TEST_F(BenchObjects, GpuAndCpuDrawTheSame) {
  ASSERT_EQ(said.status, 0) << said.output;
  const auto json = nlohmann::json::parse(std::ifstream(file("o.json")));
  const auto drawn = [&](const std::string& name) {
    for (const auto& b : json["benchmarks"])
      if (b["run_name"].get<std::string>().starts_with(name + "/"))
        return b["draws_after"].get<double>();
    return -1.0;
  };
  for (const std::string world : {"objects/city/", "objects/field/"}) {
    EXPECT_EQ(drawn(world + "cpu_none/316"), 316);
    EXPECT_EQ(drawn(world + "cpu_frustum/316"), drawn(world + "cpu_bvh/316"));
    EXPECT_EQ(drawn(world + "frustum/316"), drawn(world + "cpu_bvh/316"));
    EXPECT_LE(drawn(world + "occlusion/316"), drawn(world + "frustum/316"));
  }
}

TEST_F(BenchObjects, EndsWithATableAndTheLawOfEveryEntry) {
  ASSERT_EQ(said.status, 0) << said.output;
  const std::size_t head = said.output.find("t = c + a n^b");
  ASSERT_NE(head, std::string::npos) << said.output;
  const std::string table = said.output.substr(head);
  for (const char* entry : {"cpu_none", "cpu_frustum", "cpu_bvh", "frustum", "hiz", "occlusion"})
    EXPECT_NE(table.find(entry), std::string::npos) << entry;
}

TEST_F(BenchObjects, ComparesWithItsOwnBaseline) {
  ASSERT_EQ(said.status, 0) << said.output;
  auto json = nlohmann::json::parse(std::ifstream(file("o.json")));
  std::erase_if(json["benchmarks"].get_ref<nlohmann::json::array_t&>(), [](const auto& b) {
    return b["run_name"].template get<std::string>().find("/100/") == std::string::npos;
  });
  // A hundred times as slow, which no machine is on its own; then a ten-thousandth of that.
  const auto comparedWith = [&](double factor) {
    for (auto& b : json["benchmarks"]) b["real_time"] = factor * b["real_time"].get<double>();
    std::ofstream(file("before.json")) << json;
    return gnomonSays("bench objects --to 100 --baseline " + file("before.json"));
  };
  const Said faster = comparedWith(100), slower = comparedWith(1e-4);
  EXPECT_EQ(faster.status, 0) << faster.output;
  EXPECT_EQ(slower.status, 1) << slower.output;
}

}  // namespace
}  // namespace gnomon
