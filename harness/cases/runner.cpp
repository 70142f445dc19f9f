#include "harness/cases/runner.h"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "harness/error.h"

namespace gnomon {
namespace {

/// "lights/tile_cull" -> "LightsTileCull".
std::string suiteName(const std::string& kernel) {
  std::string suite;
  bool upper = true;
  for (const char c : kernel) {
    if (c == '/' || c == '_') {
      upper = true;
    } else {
      suite += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
      upper = false;
    }
  }
  return suite;
}

/// The kernel whose suite name is the longest prefix of this suite's.
std::string kernelOf(std::string_view suite) {
  std::string best, bestSuite;
  for (const KernelRecord* record : catalogue()) {
    const std::string name = suiteName(record->name());
    if (suite.starts_with(name) && name.size() > bestSuite.size()) {
      best = record->name();
      bestSuite = name;
    }
  }
  if (best.empty()) throw std::logic_error(fmt::format("suite '{}' names no kernel", suite));
  return best;
}

void refuseUnknownStages(const std::vector<std::string>& wanted) {
  std::set<std::string> known;
  for (const KernelRecord* r : catalogue()) {
    known.insert(r->stage);
    known.insert(r->name());
  }
  for (const std::string& stage : wanted)
    if (!known.contains(stage))
      throw UsageError(fmt::format("there is no stage '{}'.\nStages and kernels: {}", stage,
                                   fmt::join(known, ", ")));
}

bool belongs(const CaseName& c, const std::vector<std::string>& stages) {
  return stages.empty() || std::ranges::any_of(stages, [&](const std::string& s) {
           return c.kernel == s || c.kernel.starts_with(s + "/");
         });
}

std::vector<CaseName> allCases() {
  std::vector<CaseName> all;
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  for (const KernelRecord* record : catalogue())
    for (int s = 0; s < tests.total_test_suite_count(); ++s) {
      const testing::TestSuite& suite = *tests.GetTestSuite(s);
      if (kernelOf(suite.name()) != record->name()) continue;
      for (int t = 0; t < suite.total_test_count(); ++t)
        all.push_back(
            {fmt::format("{}.{}", suite.name(), suite.GetTestInfo(t)->name()), record->name()});
    }
  return all;
}

/// Carries GoogleTest's events into the session.
class Listener : public testing::EmptyTestEventListener {
 public:
  Listener(Session& s, const std::vector<CaseName>& cases, const Observer& o)
      : session(s), chosen(cases), observer(o) {
    listeners().Append(this);
  }
  ~Listener() override { listeners().Release(this); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  static testing::TestEventListeners& listeners() {
    return testing::UnitTest::GetInstance()->listeners();
  }

 private:
  void OnTestStart(const testing::TestInfo& info) override {
    const std::string name = fmt::format("{}.{}", info.test_suite_name(), info.name());
    const auto found = std::ranges::find(chosen, name, &CaseName::name);
    session.beginCase(found->name, found->kernel);
    if (observer.begin) observer.begin(*found, started++, chosen.size());
  }

  void OnTestPartResult(const testing::TestPartResult& part) override {
    CaseRecord& record = session.currentCase();
    // ADD_FAILURE() puts a line of its own first, which says nothing.
    const std::string_view message = part.message();
    if (part.failed())
      record.messages.emplace_back(
          message.starts_with("Failed\n") ? message.substr(message.find('\n') + 1) : message);
    if (part.skipped() && !record.unsupported) record.skipped = part.message();
    // GoogleTest's way for a listener, the last one, to leave a test.
    if (part.failed() && observer.endsCaseAtFailure) throw testing::AssertionException(part);
  }

  void OnTestEnd(const testing::TestInfo& info) override {
    CaseRecord& record = session.currentCase();
    record.failed = info.result()->Failed();
    record.seconds = static_cast<double>(info.result()->elapsed_time()) / 1000;
    if (observer.end) observer.end(record);
  }

  Session& session;
  const std::vector<CaseName>& chosen;
  const Observer& observer;
  std::size_t started = 0;
};

struct KindName {
  Kind kind;
  std::string_view name, suite;
};
constexpr std::array<KindName, 5> kKinds = {{{Kind::kComparison, "comparison", ""},
                                             {Kind::kLaw, "law", "Laws"},
                                             {Kind::kTruth, "truth", "Model"},
                                             {Kind::kComposition, "composition", "Parts"},
                                             {Kind::kBound, "bound", "Bound"}}};

}  // namespace

std::vector<CaseName> selectCases(const Selection& selection) {
  refuseUnknownStages(selection.stages);
  std::vector<CaseName> chosen;
  std::size_t position = 0;
  for (CaseName& c : allCases()) {
    if (!belongs(c, selection.stages)) continue;
    if (!selection.filter.empty() && fnmatch(selection.filter.c_str(), c.name.c_str(), 0) != 0)
      continue;
    if (position++ % selection.shards + 1 == selection.shard) chosen.push_back(std::move(c));
  }
  if (position == 0)
    throw UsageError(fmt::format("no case matches '{}'.\n`gnomon list cases` prints the names",
                                 selection.filter));
  return chosen;
}

Kind kindOf(const CaseName& c) {
  const std::string_view suite = std::string_view(c.name).substr(0, c.name.find('.'));
  const auto named = std::ranges::find_if(
      kKinds, [&](const KindName& k) { return !k.suite.empty() && suite.ends_with(k.suite); });
  return named == kKinds.end() ? Kind::kComparison : named->kind;
}

std::string_view nameOf(Kind kind) {
  return std::ranges::find(kKinds, kind, &KindName::kind)->name;
}

bool runsKernel(Kind kind) { return kind == Kind::kComparison || kind == Kind::kLaw; }

bool judgesModel(Kind kind) { return kind == Kind::kTruth || kind == Kind::kComposition; }

void runCases(Session& session, const std::vector<CaseName>& cases, const Observer& observer) {
  delete Listener::listeners().Release(Listener::listeners().default_result_printer());
  const Listener listener(session, cases, observer);
  const std::size_t before = session.cases().size();
  // GoogleTest runs suites as the linker ordered them; ours build on each other, so kernel by
  // kernel.
  for (std::size_t begin = 0, end = 0; begin < cases.size(); begin = end) {
    std::vector<std::string> names;
    for (; end < cases.size() && cases[end].kernel == cases[begin].kernel; ++end)
      names.push_back(cases[end].name);
    testing::GTEST_FLAG(filter) = fmt::format("{}", fmt::join(names, ":"));
    // The records say more than GoogleTest's own status.
    [[maybe_unused]] const int status = RUN_ALL_TESTS();
  }
  if (session.cases().size() - before != cases.size())
    throw std::logic_error(
        fmt::format("{} of {} cases ran", session.cases().size() - before, cases.size()));
}

}  // namespace gnomon
