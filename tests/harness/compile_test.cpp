// GLSL to SPIR-V: the same words as glslangValidator, includes, defines, errors that name their
// place, hostile files; and the registry of embedded modules.
// Not covered: text that makes glslang itself recurse without end (expressions nested or chained
// tens of thousands deep), which only a worker process survives.
#include "harness/program/compile.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "harness/error.h"
#include "harness/program/embedded.h"
#include "harness/program/spirv.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

testing::AssertionResult contains(const std::string& text, std::string_view part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no \"" << part << "\" in: " << text;
}

testing::AssertionResult begins(const std::string& text, const std::string& start) {
  if (text.starts_with(start)) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no \"" << start << "\" at the start of: " << text;
}

/// A folder of shader files that lives as long as a test.
class Compile : public testing::Test {
 protected:
  Compile() : folder(fs::temp_directory_path() / fmt::format("gnomon-compile-{}", getpid())) {
    fs::create_directories(folder);
  }
  ~Compile() override { fs::remove_all(folder); }

  fs::path write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  }

  /// What the compiler says of a file; empty if it compiles.
  std::string complaint(const fs::path& file, const CompileOptions& options = {}) const {
    try {
      compileShader(file, options);
      return {};
    } catch (const UsageError& error) {
      return error.what();
    }
  }

  const fs::path folder;
};

const std::string kHead = "#version 450\n#extension GL_GOOGLE_include_directive : require\n";
const std::string kMain = "layout(local_size_x = 1) in;\nvoid main() {}\n";

TEST_F(Compile, WordsAreThoseOfGlslangValidator) {
  write("lib/noise.glsl", "float noise(float x) { return fract(x * 43.0); }\n");
  write("stage/stage.h", "#include \"lib/noise.glsl\"\nconst uint kSize = 8;\n");
  const fs::path file = write("stage/kernel.comp", kHead + R"(
#include "stage.h"
layout(local_size_x = kSize) in;
layout(set = 0, binding = 0) buffer Out { float to[]; };
void main() { to[gl_GlobalInvocationID.x] = noise(float(gl_LocalInvocationIndex)); }
)");
  const fs::path spirv = folder / "kernel.spv";
  const std::string command =
      fmt::format("glslangValidator --quiet -V -g --target-env vulkan1.2 -I{} -o {} {}",
                  folder.string(), spirv.string(), file.string());
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(disassemble(compileShader(file, {.includeFolders = {folder}, .defines = {}})),
            disassemble(readSpirv(spirv)));
}

TEST_F(Compile, AnIncludeIsSoughtBesideTheIncludingFileBeforeTheFolders) {
  write("lib/a.glsl", "#include \"b.glsl\"\n");
  write("lib/b.glsl", "const uint kWhich = 1;\n");
  write("other/b.glsl", "#error the folder came first\n");
  const fs::path file = write("main.comp", kHead + "#include \"lib/a.glsl\"\n" + kMain);
  EXPECT_EQ(complaint(file, {.includeFolders = {folder / "other"}, .defines = {}}), "");
}

TEST_F(Compile, AngleBracketsSeekInTheFoldersOnly) {
  write("beside.glsl", "#error beside\n");
  write("other/beside.glsl", "\n");
  const fs::path file = write("main.comp", kHead + "#include <beside.glsl>\n" + kMain);
  EXPECT_EQ(complaint(file, {.includeFolders = {folder / "other"}, .defines = {}}), "");
}

TEST_F(Compile, DefinesReachTheShader) {
  const fs::path file = write("main.comp", kHead + "#if SIZE != 3\n#error SIZE\n#endif\n" + kMain);
  EXPECT_EQ(complaint(file, {.includeFolders = {}, .defines = {{"SIZE", "3"}}}), "");
  EXPECT_TRUE(contains(complaint(file), "'#error' : SIZE"));
}

TEST_F(Compile, TheEntryPointHasTheNameAskedFor) {
  const fs::path file = write("main.comp", kHead + kMain);
  const auto words =
      compileShader(file, {.includeFolders = {}, .defines = {}, .entryPoint = "resolve"});
  EXPECT_TRUE(contains(disassemble(words), "OpEntryPoint GLCompute %resolve \"resolve\""));
}

TEST_F(Compile, EveryStageIsKnownByItsEnding) {
  const std::string vertex = "#version 450\nvoid main() { gl_Position = vec4(0); }\n";
  const std::string fragment =
      "#version 450\nlayout(location = 0) out vec4 c;\nvoid main() { c = vec4(1); }\n";
  EXPECT_EQ(complaint(write("a.vert", vertex)), "");
  EXPECT_EQ(complaint(write("a.frag", fragment)), "");
  EXPECT_TRUE(contains(complaint(write("a.glsl", vertex)), ".comp, .vert or .frag"));
}

// ---- errors --------------------------------------------------------------------------------

TEST_F(Compile, AnErrorBeginsWithFileAndLine) {
  const fs::path file = write("main.comp", kHead + "void main() { x = 1; }\n");
  EXPECT_TRUE(
      begins(complaint(file), fmt::format("{}:3: 'x' : undeclared identifier", file.string())));
}

TEST_F(Compile, AnErrorInAnIncludeNamesTheInclude) {
  const fs::path include = write("lib/broken.glsl", "\n\nfloat f() { return y; }\n");
  const fs::path file = write("main.comp", kHead + "#include \"lib/broken.glsl\"\n" + kMain);
  EXPECT_TRUE(begins(complaint(file), include.string() + ":3: 'y'"));
}

TEST_F(Compile, AMissingIncludeIsNamed) {
  const fs::path file = write("main.comp", kHead + "#include \"lib/nowhere.glsl\"\n" + kMain);
  EXPECT_TRUE(begins(complaint(file), file.string() + ":3: "));
  EXPECT_TRUE(contains(complaint(file), "lib/nowhere.glsl"));
}

TEST_F(Compile, ManyErrorsAreCutToTenLines) {
  std::string body;
  for (int i = 0; i < 40; ++i) body += fmt::format("void f{}() {{ f{}(); }}\n", i, i);  // recursion
  const std::string text = complaint(write("main.comp", kHead + body + kMain));
  EXPECT_EQ(std::ranges::count(text, '\n'), 9);
  EXPECT_TRUE(contains(text, "\n... and 31 more"));
}

TEST_F(Compile, ErrorsWithoutAPlaceNameTheFile) {
  const fs::path file = write("main.comp", "#version 450\nlayout(local_size_x = 1) in;\n");
  EXPECT_TRUE(begins(complaint(file), file.string()));
  EXPECT_TRUE(contains(complaint(file), "entry point"));
}

TEST_F(Compile, WhatIsNoShaderFileIsRefusedByName) {
  fs::create_directories(folder / "folder.comp");
  EXPECT_TRUE(begins(complaint(folder / "nowhere.comp"), (folder / "nowhere.comp").string()));
  EXPECT_TRUE(contains(complaint(folder / "folder.comp"), "no such file"));
  EXPECT_TRUE(contains(complaint(write("binary.comp", std::string("\x03\x02\x23\x07\0\0", 6))),
                       "not a text file"));
}

TEST_F(Compile, HostileTextIsAnErrorAndNoCrash) {
  std::string noise;
  for (unsigned i = 0, state = 1; i < 5000; ++i) {
    state = state * 1664525u + 1013904223u;
    noise += static_cast<char>((state >> 24) % 255 + 1);
  }
  const std::string texts[] = {"",
                               "\n",
                               "\xff\xfe\xfd",
                               noise,
                               "#version 99999\n" + kMain,
                               "#version 450\n/* unfinished",
                               "#version 450\n\"",
                               "#",
                               "#include",
                               kHead + "#include \"",
                               kHead + "#define f(x) f(x) f(x)\nf(",
                               "#version 450\n" + std::string(100000, '('),
                               "#version 450\nvoid main() " + std::string(20000, '{'),
                               "#version 450\n#if " + std::string(20000, '-') + "1\n#endif\n"};
  for (std::size_t i = 0; i < std::size(texts); ++i)
    EXPECT_NE(complaint(write(fmt::format("{}.comp", i), texts[i])), "") << "text " << i;
}

TEST_F(Compile, EndlessIncludesEnd) {
  write("once.glsl", "#include \"once.glsl\"\n");
  const fs::path once = write("once.comp", kHead + "#include \"once.glsl\"\n" + kMain);
  EXPECT_TRUE(contains(complaint(once), "includes nest deeper than 64"));
  write("twice.glsl", "#include \"twice.glsl\"\n#include \"twice.glsl\"\n");
  const fs::path twice = write("twice.comp", kHead + "#include \"twice.glsl\"\n" + kMain);
  EXPECT_TRUE(contains(complaint(twice), "includes nest deeper than 64"));
  std::string many;
  for (int i = 0; i < 1100; ++i) many += "#include \"empty.glsl\"\n";
  write("empty.glsl", "\n");
  EXPECT_TRUE(
      contains(complaint(write("many.comp", kHead + many + kMain)), "more than 1000 includes"));
}

// ---- embedded modules ----------------------------------------------------------------------

TEST(Embedded, AModuleIsFoundByItsNameAndNoOther) {
  static const std::uint32_t words[] = {1, 2, 3};
  const EmbeddedSpirv registration("embedded_test/words.comp", words, words + 3);
  const auto found = embeddedSpirv("embedded_test/words.comp");
  EXPECT_TRUE(std::ranges::equal(found, words));
  EXPECT_EQ(std::ranges::count(embeddedNames(), "embedded_test/words.comp"), 1);
  EXPECT_THROW(embeddedSpirv("embedded_test/none.comp"), std::logic_error);
}

}  // namespace
}  // namespace gnomon
