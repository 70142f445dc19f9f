#include "harness/cases/kernel_case.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/cases/case_file.h"
#include "harness/cases/hash.h"
#include "harness/cases/probes.h"
#include "harness/cases/runner.h"
#include "harness/error.h"
#include "harness/hygiene/pack.h"

namespace gnomon {

void KernelCase::SetUp() {
  skipWhereUnsupported([&] {
    const Subject& subject = Session::current().subject(kernelName);
    Session::current().currentCase().threadsCommunicate = subject.threadsCommunicate();
  });
}

void KernelCase::skipWhereUnsupported(const std::function<void()>& attempt) {
  try {
    attempt();
  } catch (const Unsupported& why) {
    Session::current().currentCase().unsupported = why.what();
    GTEST_SKIP() << why.what();
  }
}

void KernelCase::widthDoesNotMatter() {
  Session::current().currentCase().threadsCommunicate = false;
}

void KernelCase::threadsDoNotMatter() {
  widthDoesNotMatter();
  threadsMatter = false;
}

void KernelCase::skipUnlessEveryOutputIsGiven() {
  if (IsSkipped()) return;
  const Interface& interface = Session::current().subject(kernelName).interface();
  if (interface.unmapped.empty()) return;
  GTEST_SKIP() << fmt::format("the kernel does not give {}", fmt::join(interface.unmapped, ", "));
}

void KernelCase::skipUnlessTheProbesAreOurs() {
  if (IsSkipped()) return;
  const SessionOptions& options = Session::current().options();
  if (options.kernels.contains(kernelName))
    GTEST_SKIP() << "another arrangement may have other intermediates than ours";
  if (!options.probes) GTEST_SKIP() << "nobody asks for probes";
}

bool KernelCase::applies(std::span<const std::byte> push) {
  const Subject& subject = Session::current().subject(kernelName);
  const bool all = std::ranges::all_of(subject.interface().fixed, [&](const auto& fixed) {
    const Field& f = *std::ranges::find(subject.record().push.fields, fixed.first, &Field::name);
    std::uint32_t word = 0;
    std::memcpy(&word, push.data() + f.offset, sizeof word);
    const double value = f.scalar == ScalarType::kFloat
                             ? static_cast<double>(std::bit_cast<float>(word))
                             : static_cast<double>(word);
    return value == fixed.second;
  });
  if (!all) ++left;
  return all;
}

void KernelCase::recover(Picture& picture, const std::string& meaning) {
  const Conventions& conventions = Session::current().subject(kernelName).conventions();
  for (vec4& texel : picture.texels)
    texel.x = converted(converted(texel.x, meaning, conventions, Way::kIn), meaning, conventions,
                        Way::kOut);
}

void KernelCase::TearDown() {
  if (left == 0 || runs > 0 || IsSkipped()) return;
  std::string only;
  for (const auto& [name, value] : Session::current().subject(kernelName).interface().fixed)
    only += fmt::format("{}{} = {}", only.empty() ? "" : ", ", name, value);
  Session::current().currentCase().skipped = "the kernel stands for " + only + " alone";
}

Observation KernelCase::run(Stimulus stimulus) {
  Session& session = Session::current();
  if (!applies(stimulus.push)) return {.applies = false};
  ++runs;
  stimulus.limit = session.limit();
  session.currentCase().observed = true;
  const Subject& subject = session.subject(kernelName);
  const bool inOrder = !threadsMatter && session.watch() == Watch::kAll;
  Observation seen = observe(subject, stimulus, inOrder ? Watch::kInOrder : session.watch());
  if (session.options().probes && !subject.record().probes.fields.empty())
    seen.stimulus = std::make_shared<const KeptStimulus>(stimulus);
  return seen;
}

void KernelCase::expectEveryProbeInside(const Observation& seen, const Expectation& expected) {
  const Bounds& by = Session::current().bounds();
  constexpr std::size_t kShown = 3;  // more of the same say nothing new
  for (const std::string& divergence :
       divergences(kernelName, seen, expected, by.device ? *by.device : by.spec, kShown))
    ADD_FAILURE() << divergence;
  checked(expected.elements);
}

void KernelCase::expectTheModelNamesEveryProbe(std::span<const Expectation> expected) {
  const Struct& probes = Session::current().subject(kernelName).record().probes;
  for (const std::string& disagreement : disagreements(probes, expected))
    ADD_FAILURE() << disagreement;
}

void KernelCase::expectClean(const Observation& seen) {
  for (const std::string& finding : seen.findings) ADD_FAILURE() << "- " << finding;
}

void KernelCase::expectConforms(const Observation& seen, const Expectation& expected) {
  if (Session::current().options().replay.empty()) expectWithin(standard(), seen, expected);
}

void KernelCase::expectWithinSpecification(const Observation& seen, const Expectation& expected) {
  Standard specification = standard();
  specification.bounds.device.reset();
  expectWithin(specification, seen, expected);
}

void KernelCase::expectWithin(const Standard& by, const Observation& seen,
                              const Expectation& expected) {
  expectWithin(by, Session::current().policy(), seen, expected,
               [&](const Verdict& verdict, const Expectation& e) {
                 return explainProbed(by, seen, verdict, e);
               });
}

std::string KernelCase::explainProbed(const Standard& by, const Observation& seen,
                                      const Verdict& verdict, const Expectation& expected) const {
  return explain(verdict, expected,
                 firstDivergence(kernelName, seen, expected, by.bounds, verdict));
}

// Another arrangement of a user's is as good as ours; ours has to be the model's own, and as exact
// as this device is.
Standard KernelCase::standard() const {
  Session& session = Session::current();
  Standard s{.bounds = session.bounds(), .foreign = session.options().kernels.contains(kernelName)};
  if (s.foreign) s.bounds.device.reset();
  return s;
}

void KernelCase::expectWithin(const Standard& by, const Policy& policy, const Observation& seen,
                              const Expectation& expected, const Explain& explained) {
  if (!seen.applies) return;
  Session& session = Session::current();
  const CaseRecord& running = session.currentCase();
  if (kindOf({running.name, running.kernel}) == Kind::kLaw)
    throw std::logic_error(running.name + " judges by the model, so it is no law");
  const Subject& subject = session.subject(kernelName);
  const Struct layout = subject.record().layoutOf(expected.output);
  for (const Expectation& e : judgedBy(subject.record(), expected)) {
    if (!seen.twin.contains(e.output)) continue;  // watched in part
    Verdict verdict = judge(layout, seen, e, by.bounds, policy, caseSeed());
    checked(verdict.elements);
    if (by.fails(verdict))
      ADD_FAILURE() << subject.origin() << " is " << nameOf(verdict.verdict) << "\n"
                    << explained(verdict, e);
    session.currentCase().verdicts.push_back(std::move(verdict));
  }
}

void KernelCase::judgeGenerated(Generated& generated) {
  Session& session = Session::current();
  const std::size_t judgement = judgements++;
  if (!session.options().replay.empty()) return replay(generated, judgement);
  const Trial trial = generated.run();
  if (!trial.seen.applies) return;
  const KernelRecord& contract = session.subject(kernelName).record();
  const Standard by = standard();
  expectWithin(by, session.policy(), trial.seen, trial.expected,
               [&](const Verdict& verdict, const Expectation& expected) {
                 // The first failure of a case says most: one is enough to shrink.
                 CaseRecord& found = session.currentCase();
                 const auto asItWas = [&] {
                   return explainProbed(by, trial.seen, verdict, expected);
                 };
                 if (!session.options().shrinks || !found.messages.empty()) return asItWas();
                 const auto shrunk =
                     shrinkFailure(generated, trial, verdict,
                                   {.record = contract, .standard = by, .judgement = judgement});
                 if (!shrunk) return asItWas();
                 found.shrunk = shrunk->file;
                 return explainFields(verdict) + shrunk->text;
               });
}

void KernelCase::replay(Generated& generated, std::size_t judgement) {
  Session& session = Session::current();
  const CaseFile file = readCaseFile(session.options().replay);
  CaseRecord& found = session.currentCase();
  if (file.judgement != judgement || found.replayed || found.unusable) return;
  const KernelRecord& contract = session.subject(kernelName).record();
  found.unusable = generated.take(file.input);
  if (!found.unusable && !(generated.gathered(contract) == file.input))
    found.unusable = "it has more than the case takes, or its sizes contradict each other";
  if (found.unusable) return;
  found.replayed = true;
  const Trial trial = generated.run();
  const Standard by = standard();
  expectWithin(by, forFewElements(session.policy()), trial.seen, trial.expected,
               [&](const Verdict& verdict, const Expectation&) {
                 return explainFields(verdict) + "It was replayed with the input:\n" +
                        explainInput(generated, verdict, {.record = contract, .standard = by});
               });
}

std::uint64_t caseSeed() {
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  return hashOf(std::string(info->test_suite_name()) + "." + info->name(),
                kHashBasis ^ Session::current().options().seed);
}

std::size_t generated(const char* policyName) {
  const Session& session = Session::current();
  return session.options().cases.value_or(static_cast<std::size_t>(session.policy()[policyName]));
}

}  // namespace gnomon
