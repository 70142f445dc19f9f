// Adapters as files: what every key becomes, and what is said of a file that is none.
//
// Covered: all keys, paths relative to the adapter, each kind of wrong value, limits of numbers,
// size and depth, files that are missing, random damage. Not covered: whether an adapter fits a
// module (interface_test.cpp) or its files compile (foreign_test.cpp).
#include "harness/program/adapter.h"

#include <fstream>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "harness/error.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

const std::string kGood = R"json({
  "language": "glsl",
  "files": {"comp": "sub/kernel.comp"},
  "entry": "shade",
  "include": ["lib", "../shared"],
  "defines": {"FAST": "1", "NAME": ""},
  "specialization": {"TILE": 16, "3": 0.5},
  "bindings": {"samples": [1, 4], "results": [0, 65535]},
  "fields": {"samples.normal": "items[].n"},
  "constants": {"params.gamma": 2.2, "bias": -1},
  "grid": [8, 4, 1],
  "conventions": {"roughness": "alpha"},
  "functions": {"D": "ggx(n, h, roughness)"}
})json";

/// A folder with one file in it.
class Scratch {
 public:
  Scratch() { fs::create_directories(folder); }
  ~Scratch() { fs::remove_all(folder); }

  Adapter read(const std::string& text) const {
    std::ofstream(file, std::ios::binary) << text;
    return readAdapter(file);
  }

  fs::path folder = fs::temp_directory_path() / fmt::format("gnomon-adapter-{}", getpid());
  fs::path file = folder / "adapter.json";
};

/// What is said of a text that is refused, behind the name of the file.
std::string refusal(const std::string& text) {
  const Scratch scratch;
  try {
    scratch.read(text);
  } catch (const UsageError& error) {
    const std::string said = error.what(), start = scratch.file.string() + ": ";
    EXPECT_TRUE(said.starts_with(start)) << said;
    return said.substr(std::min(said.size(), start.size()));
  }
  ADD_FAILURE() << "accepted: " << text.substr(0, 200);
  return {};
}

/// Of an adapter that is good but for one key.
std::string refusalOf(const std::string& key, const std::string& value) {
  const std::string files = key == "files" ? "" : R"("files": {"comp": "a.comp"}, )";
  return refusal(fmt::format(R"({{{}"{}": {}}})", files, key, value));
}

TEST(Adapter, EveryKeyIsRead) {
  const Scratch scratch;
  const Adapter a = scratch.read(kGood);
  EXPECT_EQ(a.file, scratch.file);
  EXPECT_EQ(a.language, "glsl");
  EXPECT_EQ(a.compute, scratch.folder / "sub/kernel.comp");
  EXPECT_EQ(a.entry, "shade");
  EXPECT_EQ(a.include, (std::vector{scratch.folder / "lib", scratch.folder / "../shared"}));
  EXPECT_EQ(a.defines, (std::map<std::string, std::string>{{"FAST", "1"}, {"NAME", ""}}));
  EXPECT_EQ(a.specialization, (std::map<std::string, double>{{"TILE", 16}, {"3", 0.5}}));
  EXPECT_EQ(a.bindings.at("samples"), (std::array{1u, 4u}));
  EXPECT_EQ(a.bindings.at("results"), (std::array{0u, 65535u}));
  EXPECT_EQ(a.fields.at("samples.normal"), "items[].n");
  EXPECT_EQ(a.constants, (std::map<std::string, double>{{"params.gamma", 2.2}, {"bias", -1}}));
  EXPECT_EQ(a.grid, (std::array{8u, 4u, 1u}));
  EXPECT_EQ(a.conventions.at("roughness"), "alpha");
  EXPECT_EQ(a.functions.at("D"), "ggx(n, h, roughness)");
}

TEST(Adapter, OnlyFilesIsNeeded) {
  const Scratch scratch;
  const Adapter a = scratch.read(R"({"files": {"comp": "/elsewhere/k.hlsl"}})");
  EXPECT_EQ(a.compute, "/elsewhere/k.hlsl");
  EXPECT_EQ(a.entry, "main");
  EXPECT_EQ(a.language, "");
  EXPECT_FALSE(a.grid.has_value());
  EXPECT_TRUE(a.fields.empty());
}

TEST(Adapter, ATextThatIsNoJsonObjectIsRefused) {
  for (const char* text : {"", "{", "shader", "{\"files\": }", "{} {}", "{\"a\": 1e999}", "\xff"})
    EXPECT_TRUE(refusal(text).starts_with("no JSON: ")) << text;
  for (const char* text : {"[]", "1", "null", "\"files\""})
    EXPECT_EQ(refusal(text), "an adapter is a JSON object") << text;
}

TEST(Adapter, AnUnknownKeyIsAnsweredWithTheKeys) {
  EXPECT_EQ(refusalOf("field", "{}"),
            "nobody knows the key 'field'.\nKeys: bindings, constants, conventions, defines, "
            "entry, fields, files, functions, grid, include, language, specialization");
}

TEST(Adapter, AValueOfTheWrongKindIsNamedWithWhatItIs) {
  const char* const cases[][3] = {
      {"language", "3", "'language' must be a text, not 3"},
      {"language", "\"cg\"", "'language' must be \"glsl\", \"hlsl\" or \"spirv\", not \"cg\""},
      {"files", "\"a.comp\"", "'files' must be an object, not \"a.comp\""},
      {"files", "{\"comp\": 1}", "'files.comp' must be a text, not 1"},
      {"entry", "null", "'entry' must be a text, not null"},
      {"include", "\"lib\"", "'include' must be a list of texts, not \"lib\""},
      {"include", "[\"lib\", 2]", "'include' must be a text, not 2"},
      {"defines", "[\"FAST\"]", "'defines' must be an object, not [\"FAST\"]"},
      {"defines", "{\"FAST\": 1}", "'defines.FAST' must be a text, not 1"},
      {"specialization", "4", "'specialization' must be an object, not 4"},
      {"specialization", "{\"N\": true}", "'specialization.N' must be a number, not true"},
      {"bindings", "[0, 1]", "'bindings' must be an object, not [0,1]"},
      {"bindings", "{\"a\": 1}", "'bindings.a' must be a list of 2 whole numbers, not 1"},
      {"bindings", "{\"a\": [1, 2, 3]}",
       "'bindings.a' must be a list of 2 whole numbers, not [1,2,3]"},
      {"fields", "{\"a.b\": [\"c\"]}", "'fields.a.b' must be a text, not [\"c\"]"},
      {"constants", "{\"a\": \"2\"}", "'constants.a' must be a number, not \"2\""},
      {"grid", "8", "'grid' must be a list of 3 whole numbers, not 8"},
      {"grid", "[8, 8]", "'grid' must be a list of 3 whole numbers, not [8,8]"},
      {"conventions", "{\"y\": 1}", "'conventions.y' must be a text, not 1"},
      {"functions", "{\"D\": {}}", "'functions.D' must be a text, not {}"}};
  for (const auto& [key, value, said] : cases) EXPECT_EQ(refusalOf(key, value), said);
}

TEST(Adapter, NumbersThatNoBindingOrGroupHasAreRefused) {
  for (const char* number : {"-1", "65536", "1.5", "18446744073709551616", "1e30", "\"1\""}) {
    const std::string said =
        std::string("must be a whole number from 0 to 65535, not ") +
        (std::string(number) == "18446744073709551616" ? "1.8446744073709552e+19"
         : std::string(number) == "1e30"               ? "1e+30"
                                                       : number);
    EXPECT_EQ(refusalOf("bindings", fmt::format("{{\"a\": [0, {}]}}", number)),
              "'bindings.a' " + said);
    EXPECT_EQ(refusalOf("grid", fmt::format("[{}, 1, 1]", number)), "'grid' " + said);
  }
  EXPECT_EQ(refusalOf("grid", "[8, 0, 1]"), "a group of 'grid' covers nothing");
}

TEST(Adapter, FilesNeedAComputeShader) {
  EXPECT_EQ(refusal("{}"), "it names no \"files\"");
  EXPECT_EQ(refusalOf("files", "{\"vert\": \"a.vert\", \"frag\": \"a.frag\"}"),
            "'files' must be an object with comp alone: entries that draw are not there yet, not "
            "{\"frag\":\"a.frag\",\"vert\":\"a.vert\"}");
  EXPECT_EQ(refusalOf("files", "{\"comp\": \"a.comp\", \"geom\": \"a.geom\"}"),
            "'files' must be an object with comp alone: entries that draw are not there yet, not "
            "{\"comp\":\"a.comp\",\"geom\":\"a.geom\"}");
}

TEST(Adapter, AFileThatIsMissingOrHugeIsNamed) {
  EXPECT_EQ(refusal(std::string((1u << 20) + 1, ' ')), "larger than 1048576 bytes");
  const Scratch scratch;
  for (const fs::path& file :
       {scratch.folder / "none.json", scratch.folder, scratch.folder / std::string(300, 'x')})
    try {
      readAdapter(file);
      ADD_FAILURE() << file;
    } catch (const UsageError& error) {
      EXPECT_EQ(error.what(), file.string() + ": no such file");
    }
}

// What is wrong is printed, and printing is recursive: a file of brackets must not end the stack.
TEST(Adapter, DeepNestingIsRefused) {
  EXPECT_EQ(refusalOf("files", std::string(200'000, '[') + std::string(200'000, ']')),
            "nested more than 8 deep");
}

TEST(Adapter, AMessageQuotesNoMoreThanTheBeginningAndOnlyAscii) {
  const std::string said = refusalOf("grid", "\"" + std::string(58, 'x') + "\xc3\xa9\xc3\xa9\"");
  EXPECT_TRUE(said.ends_with("xxx\\...")) << said;
}

TEST(Adapter, DamageEndsInAnErrorOrAnAdapter) {
  const Scratch scratch;
  std::mt19937 random(20240611);
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::string kSpice = "{}[]\",:\\0-9eE.tfn\n\xff\xc3";
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text = kGood;
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
      const std::size_t at = below(text.size());
      switch (below(5)) {
        case 0:
          text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
          break;
        case 1:
          text.erase(at, 1 + below(20));
          break;
        case 2:
          text.insert(at, 1, kSpice[below(kSpice.size())]);
          break;
        case 3:
          text.insert(at, kGood.substr(below(kGood.size()), below(60)));
          break;
        default:
          text[at] = static_cast<char>('0' + below(10));
      }
      if (text.empty()) text = "{";
    }
    try {
      scratch.read(text);
      ++accepted;
    } catch (const UsageError& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with(scratch.file.string()));
    } catch (...) {
      ADD_FAILURE() << "another exception for: " << text;
    }
  }
  EXPECT_GT(accepted, 100);  // and not all damage is found by the parser
  EXPECT_LT(accepted, 1900);
}

}  // namespace
}  // namespace gnomon
