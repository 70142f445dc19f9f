// Probes: a kernel's named intermediates beside what the model records of them.
//
// Covered: macros that are off leave no trace in a module; recordings over vectors, threads, paths,
// nested recordings and explorations, too many paths; made-up probes that are inside, outside,
// never written, not reached or not judged; messages as wide as they may be; names on which
// contract and model disagree.
// Not covered: probes on the device, which every stage's own cases judge.
#include "harness/cases/probes.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/mutate/normal_form.h"
#include "reference/bound/explore.h"
#include "reference/bound/recording.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
const fs::path kKernels = fs::path(GNOMON_SOURCE_DIR) / "kernels";

/// Where the argument that begins at `at` ends: at a comma or a bracket of its own level.
std::size_t endOfArgument(const std::string& text, std::size_t at) {
  for (int depth = 0; at < text.size(); ++at) {
    if (depth == 0 && (text[at] == ',' || text[at] == ')')) break;
    depth += text[at] == '(' ? 1 : text[at] == ')' ? -1 : 0;
  }
  return at;
}

/// The kernel as somebody would write it who has never heard of probes.
std::string withoutProbes(std::string text) {
  const std::string macro = "GNOMON_PROBE", include = "#include \"../lib/probe.glsl\"\n";
  const std::size_t included = text.find(include);
  EXPECT_NE(included, std::string::npos);
  text.erase(included, include.size());
  for (std::size_t at = text.find(macro); at != std::string::npos; at = text.find(macro, at)) {
    const std::size_t open = text.find('(', at);
    std::size_t end = endOfArgument(text, open + 1);
    std::string instead;
    if (text.compare(at, open - at, "GNOMON_PROBED") == 0) {
      const std::size_t expression = end + 1;
      end = endOfArgument(text, expression);
      instead = "(" + text.substr(expression, end - expression) + ")";
    } else {
      while (text[end] == ',') end = endOfArgument(text, end + 1);
      if (text[end + 1] == ';') ++end;
    }
    text.replace(at, end + 1 - at, instead);
  }
  return text;
}

std::uint64_t hashOfText(const fs::path& file, const std::string& text,
                         const std::map<std::string, std::string>& defines = {}) {
  return normalForm(
      compileText(file, text, {.includeFolders = {file.parent_path()}, .defines = defines}));
}

class ProbeMacros : public testing::TestWithParam<const char*> {};

TEST_P(ProbeMacros, LeaveNothingInTheModuleWhenTheyAreOff) {
  const fs::path file = kKernels / GetParam();
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  const std::string bare = withoutProbes(text.str());
  ASSERT_EQ(bare.find("GNOMON"), std::string::npos) << bare;
  const std::uint64_t off = hashOfText(file, text.str());
  EXPECT_EQ(off, hashOfText(file, bare));
  // Any binding that the kernel has not: this is compiled, but not run.
  EXPECT_NE(off, hashOfText(file, text.str(), {{"GNOMON_PROBES", "15"}})) << "they are never on";
}

INSTANTIATE_TEST_SUITE_P(Kernels, ProbeMacros,
                         testing::Values("brdf/evaluate.comp", "tonemap/resolve.comp",
                                         "post/views.comp"),
                         [](const testing::TestParamInfo<const char*>& kernel) {
                           std::string name = kernel.param;
                           std::ranges::replace_if(
                               name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
                           return name;
                         });

const Bounded kOpen = Bounded::between(0, 1);  // around 0.5

testing::AssertionResult is(const Intermediate& x, double lo, double hi, bool certain = true) {
  if (x.components.size() == 1 && x.components[0].lo == lo && x.components[0].hi == hi &&
      x.certain == certain)
    return testing::AssertionSuccess();
  auto failure = testing::AssertionFailure();
  for (const Bounded& component : x.components) failure << component << ' ';
  return failure << (x.certain ? "certain" : "uncertain");
}

TEST(Recording, KeepsWhatIsNamedAndWhatIsReported) {
  const Recording recording;
  named(Bounded(3), "named");
  reported(Bounded(4), "reported");
  reported(Vec3<Bounded>(Bounded(1), Bounded(2), Bounded(3)), "vector");
  const auto& names = recording.names();
  ASSERT_EQ(names.size(), 3u);
  EXPECT_TRUE(is(names.at("named"), 3, 3));
  EXPECT_TRUE(is(names.at("reported"), 4, 4));
  ASSERT_EQ(names.at("vector").components.size(), 3u);
  EXPECT_EQ(names.at("vector").components[2].value, 3);
}

TEST(Recording, ANameThatIsReachedTwiceStandsForTheLast) {
  const Recording recording;
  reported(Bounded(3), "x");
  reported(Bounded(4), "x");
  EXPECT_TRUE(is(recording.names().at("x"), 4, 4));
}

// A kernel may arrange differently what leads to a named one, but not to a reported one.
TEST(Recording, KeepsTheWideningOfWhatIsNamedAlone) {
  Rules wide = rules();
  wide.widenUlp = 1;
  const UseRules scope(wide);
  const Recording recording;
  named(Bounded(1), "named");
  reported(Bounded(1), "reported");
  EXPECT_TRUE(
      is(recording.names().at("named"), std::nextafter(1.0f, 0.0f), std::nextafter(1.0f, 2.0f)));
  EXPECT_TRUE(is(recording.names().at("reported"), 1, 1));
}

TEST(Recording, HearsItsOwnThreadAlone) {
  const Recording recording;
  std::thread([] {
    EXPECT_EQ(Recording::current(), nullptr);
    reported(Bounded(1), "elsewhere");
    const Recording own;
    reported(Bounded(2), "x");
    EXPECT_TRUE(is(own.names().at("x"), 2, 2));
  }).join();
  EXPECT_TRUE(recording.names().empty());
  EXPECT_EQ(Recording::current(), &recording);
}

TEST(Recording, TheInnermostIsToldAndTheOuterGoesOnAfterIt) {
  Recording outer;
  {
    const Recording inner;
    reported(Bounded(1), "inner");
    EXPECT_EQ(inner.names().size(), 1u);
  }
  EXPECT_EQ(Recording::current(), &outer);
  reported(Bounded(2), "outer");
  ASSERT_EQ(outer.names().size(), 1u);
  EXPECT_TRUE(is(outer.names().at("outer"), 2, 2));
}

// Begun and ended on one path of an exploration that it knows nothing of.
TEST(Recording, OneWithinAPathKeepsItsNamesAndTheExplorationItsOwn) {
  const Recording outer;
  explore([] {
    const bool low = static_cast<bool>(kOpen < 0.5f);
    const Recording inner;
    reported(Bounded(low ? 1.0f : 2.0f), "x");
    EXPECT_TRUE(is(inner.names().at("x"), low ? 1 : 2, low ? 1 : 2));
    return Bounded(0);
  });
  EXPECT_TRUE(outer.names().empty());
}

TEST(Recording, WhatANameStandsForIsJoinedOverPaths) {
  const Recording recording;
  explore([] { return reported(kOpen < 0.75f ? Bounded(3) : Bounded(4), "x"); });
  const Intermediate& x = recording.names().at("x");
  EXPECT_TRUE(is(x, 3, 4));
  EXPECT_TRUE(x.components[0].ambiguous());
  EXPECT_EQ(x.components[0].value, 3) << "0.5 < 0.75, so the first path is the plain model's";
}

// The plain model's path comes first: the name is missed once there, and once on the other one.
TEST(Recording, ANameThatOnePathDoesNotReachIsUncertain) {
  for (const bool reachedFirst : {true, false}) {
    const Recording recording;
    explore([&] {
      if (static_cast<bool>(kOpen < 0.75f) == reachedFirst) reported(Bounded(3), "x");
      return reported(Bounded(1), "always");
    });
    EXPECT_TRUE(is(recording.names().at("x"), 3, 3, false)) << reachedFirst;
    EXPECT_TRUE(is(recording.names().at("always"), 1, 1)) << reachedFirst;
  }
}

TEST(Recording, ANameOfAnotherNumberOfScalarsOnOnePathIsUncertain) {
  const Recording recording;
  explore([] {
    if (kOpen < 0.75f)
      reported(Bounded(1), "x");
    else
      reported(Vec3<Bounded>(Bounded(1)), "x");
    return Bounded(0);
  });
  EXPECT_FALSE(recording.names().at("x").certain);
}

TEST(Recording, AnExplorationWithinAPathIsJoinedFirst) {
  const Recording recording;
  explore([] {
    const float base = kOpen < 0.75f ? 0.0f : 10.0f;
    explore([&] {
      const bool low = static_cast<bool>(kOpen < 0.75f);
      if (low) reported(Bounded(base), "low");
      return reported(Bounded(low ? base + 1 : base + 2), "x");
    });
    return Bounded(0);
  });
  EXPECT_TRUE(is(recording.names().at("x"), 1, 12));
  EXPECT_TRUE(is(recording.names().at("low"), 0, 10, false));
}

TEST(Recording, TooManyPathsSayNothing) {
  static_assert(kMaxPaths < 1 << 7);  // of seven decisions
  const Recording recording;
  explore([] {
    int sum = 0;
    for (int i = 0; i < 7; ++i)
      if (kOpen < 0.5f) sum += 1 << i;
    return reported(Bounded(sum), "x");
  });
  EXPECT_TRUE(recording.names().at("x").components[0].notJudged());
}

struct Made {
  float depth;
  vec3 F0;
  uint cascade;
  int side;
};

Struct layout() {
  return describe<Made>("Made", field("depth", &Made::depth), field("F0", &Made::F0),
                        field("cascade", &Made::cascade), field("side", &Made::side));
}

constexpr Made kMade{.depth = 0.5f, .F0 = {0.25f, 0.5f, 0.75f}, .cascade = 3, .side = -2};

Intermediate exactly(std::initializer_list<float> components) {
  Intermediate exact;
  for (const float x : components) exact.components.push_back(Bounded(x));
  return exact;
}

Recording::Names modelOfMade() {
  return {{"depth", exactly({0.5f})},
          {"F0", exactly({0.25f, 0.5f, 0.75f})},
          {"cascade", exactly({3})},
          {"side", exactly({-2})}};
}

/// The scalar of that number within Made.
constexpr std::size_t kFirstOfF0 = 1, kCascade = 4;

/// Two runs that wrote the same.
struct Runs {
  explicit Runs(const Made& made) {
    std::memcpy(first.data(), &made, sizeof made);
    second = first;
  }
  /// Neither touched that scalar, so both hold what they were filled with.
  void leaveOut(std::size_t scalar) {
    poison(first, 0, scalar);
    poison(second, 1, scalar);
  }
  static void poison(std::array<std::byte, sizeof(Made)>& run, unsigned number,
                     std::size_t scalar) {
    const std::uint32_t word = poisonOf(number);
    std::memcpy(run.data() + scalar * sizeof word, &word, sizeof word);
  }
  std::vector<ProbedScalar> against(const Recording::Names& model) const {
    return probedElement(layout(), first, second, model);
  }
  std::array<std::byte, sizeof(Made)> first{}, second{};
};

/// The name of the first that diverges, or nothing.
std::string firstOf(const std::vector<ProbedScalar>& element) {
  const ProbedScalar* first = firstDiverging(element);
  return first == nullptr ? "" : first->name;
}

TEST(Probes, AreReadScalarByScalarInTheOrderOfTheStruct) {
  const std::vector<ProbedScalar> element = Runs(kMade).against(modelOfMade());
  std::string read;
  for (const ProbedScalar& s : element) read += fmt::format("{} {} {}\n", s.field, s.name, s.got);
  EXPECT_EQ(read,
            "depth depth 0.5\nF0 F0.x 0.25\nF0 F0.y 0.5\nF0 F0.z 0.75\ncascade cascade 3\n"
            "side side -2\n");
}

TEST(Probes, WhereAllAreInsideTheFaultComesAfterThem) {
  const std::vector<ProbedScalar> element = Runs(kMade).against(modelOfMade());
  EXPECT_EQ(firstOf(element), "");
  EXPECT_EQ(describeDivergence(element, "results[12]"),
            "At results[12] every intermediate that the kernel names is inside: the fault comes "
            "after them\n(depth, F0, cascade, side).\n");
}

TEST(Probes, TheFirstOutsideIsNamedWithItsComponentAndWhatIsBeforeIt) {
  Made made = kMade;
  made.F0.y = 1.5f;
  made.cascade = 2;
  const std::vector<ProbedScalar> element = Runs(made).against(modelOfMade());
  EXPECT_EQ(firstOf(element), "F0.y");
  EXPECT_EQ(describeDivergence(element, "results[12]"),
            "At results[12] it first diverges at F0.y: got 1.5 (strict twin), allowed [0.5, 0.5], "
            "model 0.5; the\none before it is inside (depth).\n");
}

TEST(Probes, TheEndsOfAnIntervalAreInside) {
  Recording::Names model = modelOfMade();
  const float above = std::nextafter(0.5f, 1.0f), beyond = std::nextafter(above, 1.0f);
  model["depth"] = {.components = {Bounded::between(0.5, above)}};
  Made made = kMade;
  for (const float end : {0.5f, above}) {
    made.depth = end;
    EXPECT_EQ(firstOf(Runs(made).against(model)), "") << end;
  }
  for (const float outside :
       {std::nextafter(0.5f, 0.0f), beyond, std::numeric_limits<float>::quiet_NaN()}) {
    made.depth = outside;
    EXPECT_EQ(firstOf(Runs(made).against(model)), "depth") << outside;
  }
}

TEST(Probes, WhatTheModelReachesAndTheKernelDoesNotWriteDiverges) {
  Runs runs(kMade);
  runs.leaveOut(kFirstOfF0 + 2);
  const std::vector<ProbedScalar> element = runs.against(modelOfMade());
  EXPECT_EQ(firstOf(element), "F0.z");
  EXPECT_EQ(describeDivergence(element, "target(3, 5)"),
            "At target(3, 5) it first diverges at F0.z: never computed, allowed [0.75, 0.75]; the "
            "one before it\nis inside (depth).\n");
}

// A value may be the poison of one run, since the other run has another.
TEST(Probes, APoisonInOneRunAloneWasWritten) {
  for (const unsigned run : {0u, 1u}) {
    Made made = kMade;
    made.cascade = poisonOf(run);
    const std::vector<ProbedScalar> element = Runs(made).against({});
    EXPECT_TRUE(element[kCascade].written) << run;
    EXPECT_EQ(element[kCascade].got, poisonOf(run));
  }
}

TEST(Probes, WhatOnlySomePathsReachOrIsNotJudgedIsNeverOutside) {
  Made made = kMade;
  made.depth = 7;
  Recording::Names model = modelOfMade();
  model["depth"].certain = false;
  EXPECT_EQ(firstOf(Runs(made).against(model)), "");
  model = modelOfMade();
  model["depth"].components[0].flags |= kNotJudged;
  EXPECT_EQ(firstOf(Runs(made).against(model)), "");
  model = modelOfMade();
  model["depth"].components[0].flags |= kUnspecified;
  EXPECT_EQ(firstOf(Runs(made).against(model)), "");
  model.erase("depth");
  Runs left(made);
  left.leaveOut(0);
  EXPECT_EQ(firstOf(left.against(model)), "");
}

TEST(Probes, WhereTheModelReachesNothingThatIsSaid) {
  EXPECT_EQ(describeDivergence(Runs(kMade).against({}), "results[0]"),
            "Of results[0] the model ends before any intermediate that has a name; the kernel goes "
            "on.\n");
  Runs runs(kMade);
  for (std::size_t i = 0; i < sizeof(Made) / sizeof(float); ++i) runs.leaveOut(i);
  EXPECT_EQ(describeDivergence(runs.against({}), "results[0]"),
            "Of results[0] the model ends before any intermediate that has a name.\n");
}

// Twice as many names as any contract has, each as long as the longest number in nine digits.
TEST(Probes, NoLineIsWiderThanATerminal) {
  std::vector<ProbedScalar> element;
  const Bounded wide = Bounded::between(-1.23456789e-30, -1.23456780e-30);
  for (int i = 0; i < 40; ++i) {
    const std::string name = fmt::format("intermediate{}", i);
    element.push_back({.name = name, .field = name, .got = wide.lo, .allowed = wide});
  }
  element.back().got = 1.23456789e-30;
  const std::string text = describeDivergence(element, "target(16383, 16383)");
  EXPECT_NE(text.find("first diverges at intermediate39: got"), std::string::npos) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << text;
}

/// An expectation whose model names these, of as many scalars, at its elements in turn.
Expectation naming(std::vector<std::pair<const char*, std::size_t>> names) {
  return expectationOf(
      "results", names.size(),
      [names]<class T>(std::size_t i) {
        const auto& [name, scalars] = names[i];
        struct {
          T x;
          auto scalars() { return std::tie(x); }
        } result{T(0)};
        if (scalars == 1)
          reported(T(0), name);
        else
          reported(Vec3<T>(T(0)), name);
        return result;
      },
      [](std::size_t) { return std::string(); });
}

TEST(Probes, ContractAndModelAgreeOnNamesOverAllExpectations) {
  const std::vector<Expectation> apart = {naming({{"depth", 1}, {"F0", 3}}),
                                          naming({{"cascade", 1}, {"side", 1}})};
  EXPECT_EQ(disagreements(layout(), apart), std::vector<std::string>());
}

TEST(Probes, EveryNameThatOnlyOneOfThemKnowsIsSaid) {
  const std::vector<Expectation> expected = {
      naming({{"depth", 1}, {"F0", 1}, {"cascade", 1}, {"gloss", 1}})};
  EXPECT_EQ(disagreements(layout(), expected),
            (std::vector<std::string>{"the model does not name the probe 'side'",
                                      "'F0' has 3 scalars in the contract and 1 in the model",
                                      "the contract has no probe 'gloss', which the model names"}));
}

}  // namespace
}  // namespace gnomon
