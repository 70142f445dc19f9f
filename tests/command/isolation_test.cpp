// Nothing that a kernel, a worker or the machine does ends a run: what dies, hangs, eats memory or
// loses the device fails one case, and the others are judged; what was judged outlives the run.
// Workers commit the faults that cannot be forced from a shader themselves
// (harness/isolate/fault.h). Not covered: a device that hangs so that not even SIGKILL helps.
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/command/command.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kRoot = GNOMON_SOURCE_DIR;
constexpr const char* kCase = "BrdfEvaluate.LobeStaysInsideTheBound";

/// An environment variable while the object lives.
struct Setting {
  Setting(const char* variable, const std::string& value) : name(variable) {
    setenv(name, value.c_str(), 1);
  }
  ~Setting() { unsetenv(name); }
  Setting(const Setting&) = delete;
  Setting& operator=(const Setting&) = delete;
  const char* name;
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

std::ptrdiff_t count(const std::string& text, const std::string& part) {
  std::ptrdiff_t n = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::string read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Without what a clock says.
Json withoutSeconds(Json json) {
  for (Json& stage : json["stages"]) stage.erase("seconds");
  return json;
}

struct Judged {
  Said said;
  Json json;
};

/// `validate` with --json; null where it wrote none.
Judged validates(const std::string& arguments) {
  const Scratch scratch;
  const fs::path file = scratch.path() / "v.json";
  Judged judged{gnomonSays(fmt::format("validate {} --json {}", arguments, file.string())), {}};
  judged.json = Json::parse(read(file), nullptr, false);
  return judged;
}

/// The named kernel failed in one case, for that reason, and was judged in all others.
void expectOneFailure(const Judged& judged, const std::string& why) {
  EXPECT_EQ(judged.said.status, 1) << judged.said.output;
  ASSERT_TRUE(judged.json.is_object()) << judged.said.output;
  EXPECT_EQ(judged.json["failed"], 1) << judged.said.output;
  const Json& stage = judged.json["stages"][0];
  EXPECT_EQ(stage["cases"], 28) << "another number of brdf's cases: adapt this";
  EXPECT_GT(stage["elements"], 10'000);
  ASSERT_EQ(stage["failures"].size(), 1u);
  EXPECT_EQ(stage["failures"][0]["case"], kCase);
  EXPECT_TRUE(has(stage["failures"][0]["message"], why)) << stage["failures"][0]["message"];
  EXPECT_TRUE(has(judged.said.output, why)) << judged.said.output;
  EXPECT_TRUE(
      has(judged.said.output, fmt::format("reproduce: ./gnomon validate --filter '{}'", kCase)))
      << judged.said.output;
}

Judged validatesWithFault(const std::string& fault, const std::string& more = "") {
  const Setting setting("GNOMON_FAULT", fault);
  return validates("brdf --cases 64 " + more);
}

const std::string kOwnAsForeign =
    "--kernel brdf/evaluate=" + (kRoot / "kernels/brdf/evaluate.comp").string();

TEST(Isolation, ACaseThatKillsItsWorkerFailsAlone) {
  expectOneFailure(validatesWithFault(fmt::format("crash:{}", kCase)),
                   "worker was killed by signal 11 (Segmentation fault)");
  expectOneFailure(validatesWithFault(fmt::format("exit:{}", kCase)),
                   "worker exited with status 7");
}

TEST(Isolation, ARunThatFailsFastEndsWithTheCaseThatFails) {
  const Judged judged = validatesWithFault(fmt::format("exit:{}", kCase), "--fail-fast --jobs 1");
  EXPECT_EQ(judged.said.status, 1);
  EXPECT_TRUE(has(judged.said.output, "worker exited with status 7")) << judged.said.output;
  EXPECT_TRUE(has(judged.said.output, "stopped at the first failure: ")) << judged.said.output;
  EXPECT_TRUE(has(judged.said.output, " of 28 cases have not run")) << judged.said.output;
  const auto stage = judged.json["stages"][0];
  EXPECT_EQ(stage["failed"], 1);
  EXPECT_LT(stage["cases"], 28);
}

TEST(Isolation, ARunThatFailsFastAndDoesNotFailIsLikeAnyOther) {
  const Judged judged = validates("brdf --cases 64 --fail-fast");
  EXPECT_EQ(judged.said.status, 0) << judged.said.output;
  EXPECT_EQ(judged.json["stages"][0]["cases"], 28);
}

TEST(Isolation, ACaseThatHangsFailsAlone) {
  expectOneFailure(validatesWithFault(fmt::format("hang:{}", kCase), "--timeout 1"),
                   "did not end within 1 s");
}

TEST(Isolation, ACaseThatLosesTheDeviceFailsAlone) {
  expectOneFailure(validatesWithFault(fmt::format("lose:{}", kCase)), "VK_ERROR_DEVICE_LOST");
}

// Sanitizers, whose shadow would count, run without these limits and without these tests.
TEST(Isolation, AForeignKernelThatEatsMemoryFailsOneCase) {
  expectOneFailure(validatesWithFault(fmt::format("memory:{}", kCase), kOwnAsForeign),
                   "out of memory, of which it has 8 GiB");
}

TEST(Isolation, AForeignFileThatCannotBeLoadedInBoundsIsAUsageError) {
  const std::pair<const char*, const char*> faults[] = {
      {"crash", "was killed by signal 11"},
      {"hang", "did not end within 1 s"},
      {"memory", "out of memory, of which it has 2 GiB"}};
  for (const auto& [fault, why] : faults) {
    const Judged judged =
        validatesWithFault(fmt::format("{}:brdf/evaluate", fault), kOwnAsForeign + " --timeout 1");
    EXPECT_EQ(judged.said.status, 2) << judged.said.output;
    EXPECT_TRUE(has(judged.said.output, "evaluate.comp: the worker that compiled it"))
        << judged.said.output;
    EXPECT_TRUE(has(judged.said.output, why)) << judged.said.output;
  }
}

/// A kernel for brdf/evaluate that writes what is right after `prelude` in main.
std::string evaluateWith(const std::string& globals, const std::string& prelude) {
  std::string text = read(kRoot / "kernels/brdf/evaluate.comp");
  const std::string main = "void main() {\n";
  const std::size_t at = text.find(main);
  EXPECT_NE(at, text.npos);
  text.replace(at, main.size(), globals + main + prelude);
  for (const char* lib : {"brdf", "safe"}) {
    const std::string include = fmt::format("\"../lib/{}.glsl\"", lib);
    text.replace(text.find(include), include.size(), fmt::format("\"lib/{}.glsl\"", lib));
  }
  return text;
}

TEST(Isolation, AKernelThatDoesNotEndIsStoppedInEveryCaseAndTheRestIsJudged) {
  const Scratch scratch;
  // lavapipe leaves loops after 65,535 iterations, so each of them is made dear.
  std::string dear;
  for (int i = 0; i < 200; ++i) dear += "x = sin(x) + cos(x * 1.5);\n";
  const auto kernel = scratch.file(
      "endless.comp",
      evaluateWith("",
                   "float x = float(gl_GlobalInvocationID.x);\nfor (int k = 0; k >= 0; k ^= 1) "
                   "{\n" +
                       dear + "if (isnan(x)) break;\n}\nif (x > 5.0) return;\n"));
  const Judged judged = validates(
      "brdf/evaluate precision/sqrt --filter '*Stays*' --cases 4096 --timeout 2 "
      "--kernel brdf/evaluate=" +
      kernel.string());
  EXPECT_EQ(judged.said.status, 1) << judged.said.output;
  ASSERT_TRUE(judged.json.is_object()) << judged.said.output;
  EXPECT_EQ(judged.json["stages"][0]["kernel"], "precision/sqrt");
  EXPECT_EQ(judged.json["stages"][0]["failed"], 0);
  EXPECT_EQ(judged.json["stages"][1]["cases"], 5);
  EXPECT_EQ(judged.json["stages"][1]["failed"], 4) << judged.said.output;
  EXPECT_EQ(count(judged.said.output, "reproduce: "), 4) << judged.said.output;
}

TEST(Isolation, ADeviceThatIsNotThereIsSaidOnce) {
  const Said said = gnomonSays("validate --jobs 4 --device no-such-device");
  EXPECT_EQ(said.status, 3) << said.output;
  EXPECT_EQ(count(said.output, "no-such-device"), 1) << said.output;
}

TEST(Isolation, TheReportDoesNotDependOnHowManyWorkersThereAre) {
  const Judged one = validates("brdf precision/sqrt precision/sin --cases 64 --jobs 1");
  const Judged many = validates("brdf precision/sqrt precision/sin --cases 64 --jobs 4");
  EXPECT_EQ(one.said.status, 0) << one.said.output;
  EXPECT_EQ(withoutSeconds(one.json), withoutSeconds(many.json));
}

/// Not through a shell: its number is that of the command itself.
pid_t startValidate(const std::string& folder) {
  const pid_t pid = fork();
  if (pid == 0) {
    execl(GNOMON_COMMAND, "gnomon", "validate", "brdf", "--cases", "64", "--jobs", "1", "--out",
          folder.c_str(), nullptr);
    _exit(127);
  }
  return pid;
}

/// Whether the file has so many lines, soon.
bool comesToHold(const fs::path& file, std::ptrdiff_t lines) {
  for (int i = 0; i < 2000 && count(read(file), "\n") < lines; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return count(read(file), "\n") >= lines;
}

TEST(Isolation, ARunThatWasKilledGoesOnWhereItWas) {
  const Scratch scratch;
  const fs::path out = scratch.path() / "out", results = out / "results.jsonl";
  const std::string same = "brdf --cases 64 --jobs 1 --out " + out.string();
  const Judged whole = validates("brdf --cases 64");
  // Case 18 hangs: 17 have ended then, after the line that says whose they are.
  pid_t run;
  {
    const Setting setting("GNOMON_FAULT", "hang:BrdfEvaluate.RoughStaysInsideTheBound");
    run = startValidate(out.string());
  }
  const bool came = comesToHold(results, 18);
  kill(run, SIGKILL);
  waitpid(run, nullptr, 0);
  ASSERT_TRUE(came) << read(results);
  fs::resize_file(results, fs::file_size(results) - 5);  // the last line is torn

  const Judged rest = validates(same);
  EXPECT_EQ(rest.said.status, 0) << rest.said.output;
  EXPECT_TRUE(has(rest.said.output, "16 of 28 cases are taken from")) << rest.said.output;
  EXPECT_EQ(withoutSeconds(rest.json), withoutSeconds(whole.json));
  const std::string text = read(results);
  EXPECT_EQ(count(text, "\"record\""), 28);
  EXPECT_TRUE(text.ends_with("{\"finished\":true}\n"));

  const Judged again = validates(same);
  EXPECT_FALSE(has(again.said.output, "are taken from")) << again.said.output;
}

TEST(Isolation, ResultsOfAnotherRunAreNotTaken) {
  const Scratch scratch;
  const fs::path results = scratch.path() / "results.jsonl";
  const auto judge = [&](const std::string& more) {
    return gnomonSays("validate brdf --cases 64 --out " + scratch.path().string() + more);
  };
  judge("");
  std::string text = read(results);
  const std::string mark = "{\"finished\":true}\n";
  ASSERT_TRUE(text.ends_with(mark)) << text;
  std::ofstream(results) << text.substr(0, text.size() - mark.size());
  const Said other = judge(" --seed 2");
  EXPECT_TRUE(has(other.output, "was of another run")) << other.output;
  EXPECT_FALSE(has(other.output, "are taken from")) << other.output;
}

TEST(Isolation, CasesWhoseThreadsCommunicateRunAgainAtOtherWidths) {
  if (!has(gnomonSays("devices").output, "llvmpipe")) GTEST_SKIP() << "its width is a setting";
  const Scratch scratch;
  // Right in subgroups of 8, which are lavapipe's; and a shared word, so that threads communicate.
  const auto kernel = scratch.file(
      "narrow.comp",
      evaluateWith("#extension GL_KHR_shader_subgroup_basic : require\nshared uint word;\n",
                   "if (gl_LocalInvocationIndex == 0) word = 0u;\nbarrier();\n"
                   "if (gl_SubgroupSize == 4u + word) return;\n"));
  const Judged judged =
      validates("brdf --device llvmpipe --filter '*LobeStays*' --cases 64 --kernel brdf/evaluate=" +
                kernel.string());
  EXPECT_EQ(judged.said.status, 1) << judged.said.output;
  EXPECT_TRUE(has(judged.said.output, "in subgroups of 4 (LP_NATIVE_VECTOR_WIDTH=128)"))
      << judged.said.output;
  EXPECT_FALSE(has(judged.said.output, "in subgroups of 16")) << judged.said.output;
}

/// A tree whose waivers are these.
std::string rootWith(const Scratch& scratch, const std::string& waivers) {
  for (const char* folder : {"kernels", "data"})
    fs::create_directory_symlink(kRoot / folder, scratch.path() / folder);
  scratch.file("tests/policy.json", read(kRoot / "tests/policy.json"));
  scratch.file("tests/waivers.json", waivers);
  return scratch.path().string();
}

std::string waiverUntil(const std::string& expiry) {
  return Json::array({{{"device", "*"},
                       {"driver", "*"},
                       {"case", "BrdfEvaluate.Lobe*"},
                       {"reason", "a known bug"},
                       {"link", "https://example.org"},
                       {"expiry", expiry}}})
      .dump();
}

TEST(Waiver, ExcusesAFailureAndIsCounted) {
  const Scratch scratch;
  const Setting root("GNOMON_ROOT", rootWith(scratch, waiverUntil("2999-12-31")));
  const fs::path junit = scratch.path() / "v.xml";
  const Judged judged =
      validatesWithFault(fmt::format("exit:{}", kCase), "--junit " + junit.string());
  EXPECT_EQ(judged.said.status, 0) << judged.said.output;
  EXPECT_EQ(judged.json["failed"], 0);
  EXPECT_EQ(judged.json["waived"], 1);
  ASSERT_EQ(judged.json["stages"][0]["waivers"].size(), 1u) << judged.said.output;
  EXPECT_EQ(judged.json["stages"][0]["waived"], 1);
  EXPECT_EQ(judged.json["stages"][0]["waivers"][0]["case"], kCase);
  EXPECT_EQ(judged.json["stages"][0]["class"], "conforms");
  EXPECT_TRUE(has(judged.said.output, fmt::format("waived {} (brdf/evaluate): a known bug", kCase)))
      << judged.said.output;
  EXPECT_TRUE(has(read(junit), "<skipped message=\"waived: a known bug")) << read(junit);
  EXPECT_FALSE(has(read(junit), "<failure")) << read(junit);
}

TEST(Waiver, OfACaseThatPassesIsAFailure) {
  const Scratch scratch;
  const Setting root("GNOMON_ROOT", rootWith(scratch, waiverUntil("2999-12-31")));
  const Judged judged = validates("brdf --cases 64");
  expectOneFailure(judged, "unexpected pass: remove the waiver");
}

TEST(Waiver, ThatHasExpiredExcusesNothing) {
  const Scratch scratch;
  const Setting root("GNOMON_ROOT", rootWith(scratch, waiverUntil("2020-02-29")));
  const Judged judged = validatesWithFault(fmt::format("exit:{}", kCase));
  EXPECT_EQ(judged.said.status, 1) << judged.said.output;
  EXPECT_TRUE(has(judged.said.output, "expired on 2020-02-29")) << judged.said.output;
  EXPECT_EQ(validates("brdf --cases 64").said.status, 0);
}

TEST(Waiver, ThatCannotBeReadIsAUsageError) {
  const Scratch scratch;
  const Setting root("GNOMON_ROOT", rootWith(scratch, "[{\"device\": \"*\"}]"));
  const Said said = gnomonSays("validate brdf");
  EXPECT_EQ(said.status, 2) << said.output;
  EXPECT_TRUE(has(said.output, "waivers.json: waiver 1: needs a text \"driver\"")) << said.output;
}

}  // namespace
}  // namespace gnomon
