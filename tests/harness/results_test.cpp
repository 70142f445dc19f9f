// What a run leaves on disk, how it is divided, and what a worker's record is after the journey.
#include "harness/isolate/results.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/error.h"
#include "harness/isolate/messages.h"
#include "harness/isolate/schedule.h"

namespace gnomon {
namespace {

struct ResultsFile : testing::Test {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("gnomon_results_{}.jsonl", getpid());
  ~ResultsFile() override { std::filesystem::remove(file); }
  ResultsFile() { std::filesystem::remove(file); }
  void truncateBy(std::uintmax_t bytes) const {
    std::filesystem::resize_file(file, std::filesystem::file_size(file) - bytes);
  }
};

CaseRecord recordNamed(const std::string& name) {
  return {.name = name, .kernel = "brdf/evaluate", .failed = true, .messages = {"a\nb \"c\""}};
}

TEST_F(ResultsFile, HoldsWhatARunHadFoundWhenItDied) {
  {
    Results results(file, "one");
    EXPECT_TRUE(results.found().empty());
    results.append({0, recordNamed("A.A")});
    results.append({128, recordNamed("A.B")});
  }
  const Results next(file, "one");
  ASSERT_EQ(next.found().size(), 2u);
  EXPECT_EQ(next.found()[0].record.name, "A.A");
  EXPECT_EQ(next.found()[0].record.messages, std::vector<std::string>{"a\nb \"c\""});
  EXPECT_EQ(next.found()[1].width, 128u);
  EXPECT_FALSE(next.replacesAnother());
}

TEST_F(ResultsFile, IsReadAsFarAsItGoes) {
  {
    Results results(file, "one");
    results.append({0, recordNamed("A.A")});
    results.append({0, recordNamed("A.B")});
  }
  truncateBy(1);  // whole but for its newline: who knows
  {
    Results next(file, "one");
    EXPECT_EQ(next.found().size(), 1u);
    next.append({0, recordNamed("A.C")});
  }
  EXPECT_EQ(Results(file, "one").found().size(), 2u) << "the torn line took the next one along";
}

TEST_F(ResultsFile, BeginsAfreshForAnotherRunAndAfterTheEnd) {
  Results(file, "one").append({0, recordNamed("A.A")});
  const Results other(file, "two");
  EXPECT_TRUE(other.found().empty());
  EXPECT_TRUE(other.replacesAnother());
  {
    Results results(file, "two");
    results.append({0, recordNamed("A.A")});
    results.finish();
  }
  const Results after(file, "two");
  EXPECT_TRUE(after.found().empty());
  EXPECT_FALSE(after.replacesAnother());
}

TEST_F(ResultsFile, ThatIsNoneIsReplaced) {
  std::ofstream(file) << "not JSON\n[1,2]\n";
  EXPECT_TRUE(Results(file, "one").found().empty());
}

TEST(ResultsFileNowhere, IsAUsageError) {
  EXPECT_THROW(Results("/no/such/folder/results.jsonl", "one"), UsageError);
}

std::vector<CaseName> casesOf(const std::string& kernel, int n) {
  std::vector<CaseName> all;
  for (int i = 0; i < n; ++i) all.push_back({fmt::format("{}.{}", kernel, i), kernel});
  return all;
}

TEST(Batches, HoldOneStageAndSoManyCasesInOrder) {
  std::vector<CaseName> cases = casesOf("a/x", 3);
  for (const CaseName& c : casesOf("a/y", 2)) cases.push_back(c);
  for (const CaseName& c : casesOf("b/z", 1)) cases.push_back(c);
  const std::vector<Batch> batches = batchesOf(cases, {}, 4);
  ASSERT_EQ(batches.size(), 3u);
  EXPECT_EQ(batches[0].cases.size(), 4u);
  EXPECT_EQ(batches[0].cases.back().name, "a/y.0");
  EXPECT_EQ(batches[1].cases.size(), 1u);
  EXPECT_EQ(batches[2].cases.front().name, "b/z.0");
  EXPECT_TRUE(batchesOf({}, {}, 4).empty());
}

TEST(Batches, KeepForeignKernelsApart) {
  std::vector<CaseName> cases = casesOf("a/x", 1);
  for (const CaseName& c : casesOf("a/y", 1)) cases.push_back(c);
  EXPECT_EQ(batchesOf(cases, {.kernels = {{"a/y", "y.comp"}}}, 4).size(), 2u);
}

TEST(Messages, ARecordSurvivesTheJourney) {
  CaseRecord record = recordNamed("A.A");
  record.threadsCommunicate = true;
  record.measured[Operation::log] = {
      .worst = {3.344, INFINITY}, .worstAt = 0.38842532f, .arguments = 7, .exhaustive = true};
  const CaseRecord there = caseRecord(toJson(record));
  EXPECT_EQ(there.name, "A.A");
  EXPECT_TRUE(there.failed);
  EXPECT_TRUE(there.threadsCommunicate);
  EXPECT_FALSE(there.usesSubgroups);
  const MeasuredError& log = there.measured.at(Operation::log);
  EXPECT_EQ(log.worst.ulp, 3.344);
  EXPECT_EQ(log.worst.absolute, INFINITY);
  EXPECT_EQ(log.worstAt, 0.38842532f);
  EXPECT_EQ(log.arguments, 7u);
  EXPECT_TRUE(log.exhaustive);
  EXPECT_THROW(caseRecord("{}"), UsageError);
  EXPECT_THROW(caseRecord("junk"), UsageError);
}

TEST(Messages, ATaskTakesMeasuredErrorsAlong) {
  WorkerTask task{.session = {.seed = 9}, .cases = {"A.A"}};
  EXPECT_FALSE(workerTask(toJson(task)).errors);
  task.errors = DeviceErrors{{Operation::sin, {.worst = {1, 2}}}};
  EXPECT_EQ(workerTask(toJson(task)).errors->at(Operation::sin).worst.absolute, 2);
}

}  // namespace
}  // namespace gnomon
