// Two lists as data: kernels with one deliberate fault, each of which must be called wrong.
//
// Every variant is the project's own kernel with one piece of text replaced, judged through
// --kernel as a user's file would be.
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = GNOMON_SOURCE_DIR;

struct Variant {
  std::string name, kernel, file, from, to;
};
void PrintTo(const Variant& v, std::ostream* out) { *out << v.kernel << ": " << v.name; }

std::vector<Variant> variants(const char* list) {
  std::vector<Variant> all;
  for (const auto& v : nlohmann::json::parse(std::ifstream(kRoot / "tests/variants" / list)))
    all.push_back({v["name"], v["kernel"], v["file"], v["from"], v["to"]});
  return all;
}

std::string read(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A copy of kernels/ in which the variant's text is replaced; the text must be there, once.
fs::path patchedKernel(const Scratch& scratch, const Variant& v) {
  const fs::path copy = scratch.path() / "kernels";
  fs::copy(kRoot / "kernels", copy, fs::copy_options::recursive);
  std::string text = read(copy / v.file);
  const std::size_t at = text.find(v.from);
  EXPECT_NE(at, std::string::npos) << v.file << " no longer holds '" << v.from << "'";
  if (at == std::string::npos) return {};
  EXPECT_EQ(text.find(v.from, at + 1), std::string::npos) << "'" << v.from << "' is not unique";
  std::ofstream(copy / v.file) << text.replace(at, v.from.size(), v.to);
  // Entries that share a shader are not called after it.
  return v.file.ends_with(".comp") ? copy / v.file : copy / (v.kernel + ".comp");
}

class WrongVariant : public testing::TestWithParam<Variant> {};

TEST_P(WrongVariant, IsCalledWrong) {
  const Variant& v = GetParam();
  const Scratch scratch;
  const fs::path kernel = patchedKernel(scratch, v);
  const Said said = gnomonSays(
      fmt::format("validate {0} --cases 4096 --kernel {0}={1}", v.kernel, kernel.string()));
  EXPECT_EQ(said.status, 1) << said.output;
}

std::string identifier(const testing::TestParamInfo<Variant>& info) {
  std::string name = info.param.kernel + "_" + info.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Kernels, WrongVariant, testing::ValuesIn(variants("wrong.json")),
                         identifier);

}  // namespace
}  // namespace gnomon
