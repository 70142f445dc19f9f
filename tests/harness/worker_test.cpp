// What a worker and its parent tell each other survives the way there, and nothing else is taken
// for it. How a child ends is process_test.cpp's; a sweep through workers
// tests/command/sweep_test.cpp's.
#include "harness/isolate/messages.h"

#include <limits>

#include <gtest/gtest.h>

#include "harness/error.h"

namespace gnomon {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

WorkerTask someTask() {
  WorkerTask task;
  task.session.root = "/a folder/with \"quotes\"";
  task.session.device = "llvmpipe";
  task.session.seed = 0xfedcba9876543210;  // more than a double holds
  task.session.cases = 512;
  task.session.timeout = std::chrono::seconds(7);
  task.session.kernels = {{"brdf/evaluate", "mine/x.comp"}, {"post/bloom", "y\\z.spv"}};
  task.session.validation = false;
  task.cases = {"BrdfEvaluate.B", "BrdfEvaluate.A"};
  return task;
}

void expectSame(const WorkerTask& got, const WorkerTask& sent) {
  EXPECT_EQ(got.session.root, sent.session.root);
  EXPECT_EQ(got.session.device, sent.session.device);
  EXPECT_EQ(got.session.seed, sent.session.seed);
  EXPECT_EQ(got.session.cases, sent.session.cases);
  EXPECT_EQ(got.session.timeout, sent.session.timeout);
  EXPECT_EQ(got.session.kernels, sent.session.kernels);
  EXPECT_EQ(got.session.validation, sent.session.validation);
  EXPECT_EQ(got.cases, sent.cases);
}

TEST(WorkerMessages, ATaskArrivesWhole) { expectSame(workerTask(toJson(someTask())), someTask()); }

TEST(WorkerMessages, ATaskWithNothingButDefaultsArrivesWhole) {
  expectSame(workerTask(toJson(WorkerTask{})), WorkerTask{});
}

FieldVerdict someField() {
  return {.name = "specular",
          .outside = 3,
          .budget = kInfinity,
          .specBudget = 1.25,
          .specWidth = 1e-7,
          .deviceWidth = 0,
          .worst = {}};
}

Verdict someVerdict() {
  Verdict v;
  v.verdict = Class::kEquivalent;
  v.widening = 2;
  v.output = "target as RGBA8";
  v.storage = Storage::unorm8;
  v.elements = 1000;
  v.bounded = 900;
  v.truncated = true;
  v.outside = 30;
  v.outsideDevice = 31;
  v.ambiguous = 4;
  v.reassociated = 5;
  v.plainBudget = kInfinity;
  v.fields = {someField(), {.name = "radiance", .budget = 0.5, .worst = {}}};
  v.problems = {"first", "second"};
  return v;
}

CaseRecord someRecord() {
  CaseRecord r;
  r.name = "BrdfEvaluate.LobeStaysInsideTheBound";
  r.kernel = "brdf/evaluate";
  r.failed = true;
  r.skipped = "why";
  r.elements = std::size_t{1} << 40;
  r.seconds = 0.1;
  r.verdicts = {someVerdict(), Verdict{}};
  r.messages = {"two\nlines", "", "\"quoted\"\t\\ \x01 \x7f µ 😀"};
  return r;
}

void expectSame(const FieldVerdict& got, const FieldVerdict& sent) {
  EXPECT_EQ(got.name, sent.name);
  EXPECT_EQ(got.outside, sent.outside);
  EXPECT_EQ(got.budget, sent.budget);
  EXPECT_EQ(got.specBudget, sent.specBudget);
  EXPECT_EQ(got.specWidth, sent.specWidth);
  EXPECT_EQ(got.deviceWidth, sent.deviceWidth);
}

void expectSame(const Verdict& got, const Verdict& sent) {
  EXPECT_EQ(got.verdict, sent.verdict);
  EXPECT_EQ(got.widening, sent.widening);
  EXPECT_EQ(got.output, sent.output);
  EXPECT_EQ(got.storage, sent.storage);
  EXPECT_EQ(got.elements, sent.elements);
  EXPECT_EQ(got.bounded, sent.bounded);
  EXPECT_EQ(got.truncated, sent.truncated);
  EXPECT_EQ(got.outside, sent.outside);
  EXPECT_EQ(got.outsideDevice, sent.outsideDevice);
  EXPECT_EQ(got.ambiguous, sent.ambiguous);
  EXPECT_EQ(got.reassociated, sent.reassociated);
  EXPECT_EQ(got.plainBudget, sent.plainBudget);
  EXPECT_EQ(got.problems, sent.problems);
  ASSERT_EQ(got.fields.size(), sent.fields.size());
  for (std::size_t f = 0; f < sent.fields.size(); ++f) expectSame(got.fields[f], sent.fields[f]);
}

void expectSame(const CaseRecord& got, const CaseRecord& sent) {
  EXPECT_EQ(got.name, sent.name);
  EXPECT_EQ(got.kernel, sent.kernel);
  EXPECT_EQ(got.failed, sent.failed);
  EXPECT_EQ(got.skipped, sent.skipped);
  EXPECT_EQ(got.unsupported, sent.unsupported);
  EXPECT_EQ(got.elements, sent.elements);
  EXPECT_EQ(got.seconds, sent.seconds);
  EXPECT_EQ(got.messages, sent.messages);
  ASSERT_EQ(got.verdicts.size(), sent.verdicts.size());
  for (std::size_t v = 0; v < sent.verdicts.size(); ++v)
    expectSame(got.verdicts[v], sent.verdicts[v]);
}

TEST(WorkerMessages, ARecordArrivesWhole) {
  expectSame(caseRecord(toJson(someRecord())), someRecord());
  CaseRecord unsupported;
  unsupported.unsupported = "the device lacks subgroupAdd";
  expectSame(caseRecord(toJson(unsupported)), unsupported);
}

// A line is one message.
TEST(WorkerMessages, AreOneLineEach) {
  EXPECT_EQ(toJson(someTask()).find('\n'), std::string::npos);
  EXPECT_EQ(toJson(someRecord()).find('\n'), std::string::npos);
}

TEST(WorkerMessages, BytesThatAreNoTextAreReplacedAndTheRestStays) {
  CaseRecord record;
  record.messages = {std::string("before \xff\xc3 after"), std::string("nul \0 byte", 10)};
  const CaseRecord got = caseRecord(toJson(record));
  ASSERT_EQ(got.messages.size(), 2u);
  EXPECT_EQ(got.messages[0], "before \ufffd\ufffd after");
  EXPECT_EQ(got.messages[1], record.messages[1]);
}

/// Why the text is refused; "" where it is accepted.
template <class F>
std::string refusal(F parse, const std::string& text) {
  try {
    parse(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

const auto kParseTask = [](const std::string& text) { workerTask(text); };
const auto kParseRecord = [](const std::string& text) { caseRecord(text); };

TEST(WorkerMessages, WhatIsNoMessageIsRefused) {
  for (const char* text : {"", " ", "garbage", "{}", "[]", "[1, 2]", "null", "7", "\"text\"", "{",
                           "{\"root\": 5}", "{\"name\": null}", "\xff\xfe", "{} {}"}) {
    EXPECT_NE(refusal(kParseTask, text).find("this is no task of a worker"), std::string::npos)
        << text;
    EXPECT_NE(refusal(kParseRecord, text).find("this is no record of a worker"), std::string::npos)
        << text;
  }
  EXPECT_NE(refusal(kParseTask, toJson(someRecord())), "");
  EXPECT_NE(refusal(kParseRecord, toJson(someTask())), "");
}

TEST(WorkerMessages, TruncatedOnesAreRefused) {
  const std::string task = toJson(someTask()), record = toJson(someRecord());
  for (std::size_t size = 0; size < task.size(); ++size)
    ASSERT_NE(refusal(kParseTask, task.substr(0, size)), "") << size;
  for (std::size_t size = 0; size < record.size(); ++size)
    ASSERT_NE(refusal(kParseRecord, record.substr(0, size)), "") << size;
}

/// The text with the first `from` in it replaced.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no " << from << " in " << text;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// As a worker of another build might send them.
TEST(WorkerMessages, AMemberThatIsMissingOrOfAnotherTypeIsRefused) {
  const std::string task = toJson(someTask()), record = toJson(someRecord());
  for (const char* member :
       {"root", "device", "seed", "generated", "timeout", "kernels", "validation", "cases"}) {
    const std::string quoted = "\"" + std::string(member) + "\":";
    EXPECT_NE(refusal(kParseTask, with(task, quoted, "\"other\":")), "") << member;
    EXPECT_NE(refusal(kParseTask, with(task, quoted, quoted + "{\"x\":[[]]},\"other\":")), "")
        << member;
  }
  for (const char* member :
       {"name",         "kernel",      "failed",    "skipped",  "unsupported",   "elements",
        "seconds",      "verdicts",    "messages",  "class",    "widening",      "output",
        "storage",      "bounded",     "truncated", "outside",  "outsideDevice", "ambiguous",
        "reassociated", "plainBudget", "fields",    "problems", "budget",        "specBudget",
        "specWidth",    "deviceWidth"}) {
    const std::string quoted = "\"" + std::string(member) + "\":";
    EXPECT_NE(refusal(kParseRecord, with(record, quoted, "\"other\":")), "") << member;
    EXPECT_NE(refusal(kParseRecord, with(record, quoted, quoted + "{\"x\":[[]]},\"other\":")), "")
        << member;
  }
}

}  // namespace
}  // namespace gnomon
