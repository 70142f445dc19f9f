// Two lists as data: kernels with one deliberate fault, each of which must be called wrong, and
// correct re-formulations, none of which may be.
//
// A variant is the project's own kernel with some text replaced or optimised, or one of
// data/kernels, judged through --kernel as a user's file would be.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = GNOMON_SOURCE_DIR;

struct Edit {
  std::string file, from, to;
};

/// A kernel of the project's with some text replaced, or optimised, or one of data/kernels.
struct Variant {
  std::string name, kernel, verdict, adapter;
  std::string probe;  ///< the intermediate that the message must name; empty: any, or none
  nlohmann::json conventions{};  ///< that an adapter around it declares; null: it has none
  bool optimise = false;
  std::vector<Edit> edits;
};
void PrintTo(const Variant& v, std::ostream* out) { *out << v.kernel << ": " << v.name; }

Edit editOf(const nlohmann::json& j) { return {j["file"], j["from"], j["to"]}; }

/// Throws where a key is not one of these: misspelt, it would be a demand that nobody checks.
Variant variantOf(const nlohmann::json& j) {
  constexpr std::array kKeys = {"name",  "kernel", "class", "probe", "adapter",    "optimise",
                                "edits", "file",   "from",  "to",    "conventions"};
  for (const auto& [key, value] : j.items())
    if (std::ranges::find(kKeys, key) == kKeys.end())
      throw std::runtime_error(fmt::format("a variant has no key '{}'", key));
  Variant v{.name = j["name"],
            .kernel = j["kernel"],
            .verdict = j.value("class", "wrong"),
            .adapter = j.value("adapter", ""),
            .probe = j.value("probe", ""),
            .conventions = j.value("conventions", nlohmann::json()),
            .optimise = j.value("optimise", false),
            .edits = {}};
  if (!v.probe.empty() && v.verdict != "wrong")
    throw std::runtime_error(fmt::format("'{}' is right, so no probe of it diverges", v.name));
  if (j.contains("from")) v.edits.push_back(editOf(j));
  for (const auto& e : j.value("edits", nlohmann::json::array())) v.edits.push_back(editOf(e));
  return v;
}

std::vector<Variant> variants(const char* list) {
  std::vector<Variant> all;
  for (const auto& j : nlohmann::json::parse(std::ifstream(kRoot / "tests/variants" / list)))
    all.push_back(variantOf(j));
  return all;
}

std::string read(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The text must be there, once.
void apply(const Edit& e, const fs::path& kernels) {
  std::string text = read(kernels / e.file);
  const std::size_t at = text.find(e.from);
  ASSERT_NE(at, std::string::npos) << e.file << " no longer holds '" << e.from << "'";
  ASSERT_EQ(text.find(e.from, at + 1), std::string::npos) << "'" << e.from << "' is not unique";
  std::ofstream(kernels / e.file) << text.replace(at, e.from.size(), e.to);
}

fs::path optimised(const fs::path& shader, const fs::path& kernels) {
  const fs::path spirv = kernels / "optimised.spv";
  const std::string made = fmt::format(
      "glslangValidator --quiet -V --target-env vulkan1.2 -I{} -o {} {} && spirv-opt -O {} -o {}",
      kernels.string(), spirv.string(), shader.string(), spirv.string(), spirv.string());
  EXPECT_EQ(std::system(made.c_str()), 0) << made;
  return spirv;
}

/// An adapter beside the shader.
fs::path adapted(const fs::path& shader, const nlohmann::json& conventions) {
  const fs::path adapter = fs::path(shader).replace_extension(".json");
  std::ofstream(adapter) << nlohmann::json{{"files", {{"comp", shader.filename().string()}}},
                                           {"conventions", conventions}};
  return adapter;
}

/// The variant's file, in a copy of kernels/.
fs::path fileOf(const Variant& v, const Scratch& scratch) {
  if (!v.adapter.empty()) return kRoot / "data/kernels" / v.adapter;
  const fs::path copy = scratch.path() / "kernels";
  fs::copy(kRoot / "kernels", copy, fs::copy_options::recursive);
  for (const Edit& e : v.edits) apply(e, copy);
  // Entries that share a shader are not called after it.
  const bool shared = !v.edits.empty() && v.kernel.starts_with("precision/");
  const fs::path shader = copy / (shared ? v.edits.front().file : v.kernel + ".comp");
  if (v.optimise) return optimised(shader, copy);
  return v.conventions.is_null() ? shader : adapted(shader, v.conventions);
}

/// Whether a message says that it first diverges there: at "G" or a component of it, and not at
/// another name that begins so.
bool saysThatItDivergesAt(const std::string& probe, const std::string& output) {
  const std::string said = "first diverges at " + probe;
  return output.find(said + ":") != std::string::npos ||
         output.find(said + ".") != std::string::npos;
}

class WrongVariant : public testing::TestWithParam<Variant> {};

/// Generated inputs a case: a scene of culling costs as much as a thousand elements of others.
std::size_t inputsFor(const Variant& v, std::size_t usually) {
  return v.kernel.starts_with("culling/") ? std::min<std::size_t>(usually, 1200) : usually;
}

TEST_P(WrongVariant, IsCalledWrong) {
  const Variant& v = GetParam();
  const Scratch scratch;
  // Shrinking has tests of its own; where a probe must be named, the user meets it with shrinking.
  const char* shrink = v.probe.empty() ? "--no-shrink " : "";
  const Said said =
      gnomonSays(fmt::format("validate {0} --fail-fast {1}--cases {3} --kernel {0}={2}", v.kernel,
                             shrink, fileOf(v, scratch).string(), inputsFor(v, 4096)));
  EXPECT_EQ(said.status, 1) << said.output;
  if (v.probe.empty()) return;
  EXPECT_TRUE(saysThatItDivergesAt(v.probe, said.output)) << v.probe << "\n" << said.output;
}

class RightVariant : public testing::TestWithParam<Variant> {};

TEST_P(RightVariant, IsNeverCalledWrong) {
  const Variant& v = GetParam();
  const Scratch scratch;
  const fs::path json = scratch.path() / "verdict.json";
  const Said said =
      gnomonSays(fmt::format("validate {0} --cases {3} --json {1} --kernel {0}={2}", v.kernel,
                             json.string(), fileOf(v, scratch).string(), inputsFor(v, 16384)));
  ASSERT_EQ(said.status, 0) << said.output;
  const auto stages = nlohmann::json::parse(std::ifstream(json))["stages"];
  EXPECT_EQ(stages.at(0)["class"], v.verdict) << said.output;
}

std::string identifier(const testing::TestParamInfo<Variant>& info) {
  std::string name = info.param.kernel + "_" + info.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

TEST(Variants, AKeyThatNobodyReadsIsRefused) {
  const nlohmann::json good = {{"name", "a fault"}, {"kernel", "brdf/evaluate"},
                               {"probe", "G"},      {"file", "lib/brdf.glsl"},
                               {"from", "1"},       {"to", "2"}};
  EXPECT_EQ(variantOf(good).probe, "G");
  nlohmann::json misspelt = good;
  misspelt["prob"] = "G";
  EXPECT_THROW(variantOf(misspelt), std::runtime_error);
  nlohmann::json right = good;
  right["class"] = "conforms";
  EXPECT_THROW(variantOf(right), std::runtime_error);
}

/// A wrong kernel whose probes cannot be compiled: what is said of it.
Said saidWithBrokenProbe(const Scratch& scratch) {
  const Variant v{
      .name = "pi, and a probe that the contract lacks",
      .kernel = "brdf/evaluate",
      .verdict = "wrong",
      .adapter = "",
      .probe = "",
      .edits = {{"lib/brdf.glsl", "kPi = 3.14159265358979", "kPi = 3.14160265358979"},
                {"brdf/evaluate.comp", "GNOMON_PROBE(G, o.G)", "GNOMON_PROBE(masking, o.G)"}}};
  return gnomonSays("validate --filter '*LobeStays*' --cases 64 --kernel brdf/evaluate=" +
                    fileOf(v, scratch).string());
}

// 64 samples of the lobe are judged wrong in D, with or without an explanation of where it began.
TEST(Variants, WhereTheRunWithProbesFailsTheMessageStandsAndALineSaysWhy) {
  const Scratch scratch;
  const Said said = saidWithBrokenProbe(scratch);
  EXPECT_EQ(said.status, 1) << said.output;
  for (const char* part : {"The first field that is wrong, in the order of the contract, is D.",
                           "Its intermediates are not known", "the run with probes failed",
                           "masking", "  got  ", "  allowed  ", "reproduce: "})
    EXPECT_NE(said.output.find(part), std::string::npos) << part << "\n" << said.output;
  EXPECT_EQ(said.output.find("first diverges"), std::string::npos) << said.output;
}

INSTANTIATE_TEST_SUITE_P(Kernels, WrongVariant, testing::ValuesIn(variants("wrong.json")),
                         identifier);
INSTANTIATE_TEST_SUITE_P(Kernels, RightVariant, testing::ValuesIn(variants("right.json")),
                         identifier);

}  // namespace
}  // namespace gnomon
