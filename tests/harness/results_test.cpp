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

std::vector<Turn> turnsOf(const std::string& kernel, int n, unsigned width = 0) {
  std::vector<Turn> all;
  for (int i = 0; i < n; ++i) all.push_back({{fmt::format("{}.{}", kernel, i), kernel}, width});
  return all;
}

std::vector<std::size_t> sizesOf(const std::vector<Batch>& batches) {
  std::vector<std::size_t> sizes;
  for (const Batch& b : batches) sizes.push_back(b.cases.size());
  return sizes;
}

TEST(Batches, HoldOneStageInOrder) {
  std::vector<Turn> turns = turnsOf("a/x", 3);
  for (const Turn& t : turnsOf("a/y", 2)) turns.push_back(t);
  for (const Turn& t : turnsOf("b/z", 1)) turns.push_back(t);
  const std::vector<Batch> batches = batchesOf(turns, {}, 1, 5);
  ASSERT_EQ(sizesOf(batches), (std::vector<std::size_t>{5, 1}));
  EXPECT_EQ(batches[0].cases.back().name, "a/y.1");
  EXPECT_EQ(batches[1].cases.front().name, "b/z.0");
  EXPECT_TRUE(batchesOf({}, {}, 1, 4).empty());
}

TEST(Batches, BecomeSmallerTowardsTheEnd) {
  EXPECT_EQ(sizesOf(batchesOf(turnsOf("a/x", 40), {}, 2, 2)),
            (std::vector<std::size_t>{10, 7, 5, 4, 3, 2, 2, 2, 2, 3}));
}

TEST(Batches, CutFewKernelsInTwo) {
  std::vector<Turn> turns = turnsOf("a/x", 5);
  for (const Turn& t : turnsOf("a/y", 2)) turns.push_back(t);
  for (const Turn& t : turnsOf("a/z", 9)) turns.push_back(t);
  EXPECT_EQ(sizesOf(batchesOf(turns, {}, 2, 3)), (std::vector<std::size_t>{5, 2, 3, 6}));
}

TEST(Batches, HoldOneWidth) {
  std::vector<Turn> turns = turnsOf("a/x", 2);
  for (const Turn& t : turnsOf("a/x", 1, 128)) turns.push_back(t);
  const std::vector<Batch> batches = batchesOf(turns, {}, 1, 4);
  ASSERT_EQ(sizesOf(batches), (std::vector<std::size_t>{2, 1}));
  EXPECT_EQ(batches[0].width, 0u);
  EXPECT_EQ(batches[1].width, 128u);
}

TEST(Batches, KeepForeignKernelsApart) {
  std::vector<Turn> turns = turnsOf("a/x", 1);
  for (const Turn& t : turnsOf("a/y", 1)) turns.push_back(t);
  EXPECT_EQ(batchesOf(turns, {.kernels = {{"a/y", "y.comp"}}}, 1, 4).size(), 2u);
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
