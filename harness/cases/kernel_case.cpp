#include "harness/cases/kernel_case.h"

#include "harness/cases/hash.h"
#include "harness/error.h"

namespace gnomon {

void KernelCase::SetUp() {
  skipWhereUnsupported([&] {
    const Subject& subject = Session::current().subject(kernelName);
    CaseRecord& found = Session::current().currentCase();
    found.threadsCommunicate = subject.threadsCommunicate();
    found.usesSubgroups = subject.usesSubgroups();
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

Observation KernelCase::run(Stimulus stimulus) {
  Session& session = Session::current();
  stimulus.limit = session.limit();
  Observation seen = observe(session.subject(kernelName), stimulus);
  return seen;
}

void KernelCase::expectClean(const Observation& seen) {
  for (const std::string& finding : seen.findings) ADD_FAILURE() << "- " << finding;
}

void KernelCase::expectConforms(const Observation& seen, const Expectation& expected) {
  expectWithin(Session::current().bounds(), seen, expected);
}

void KernelCase::expectWithinSpecification(const Observation& seen, const Expectation& expected) {
  Bounds bounds = Session::current().bounds();
  bounds.device.reset();
  expectWithin(bounds, seen, expected);
}

void KernelCase::expectWithin(const Bounds& bounds, const Observation& seen,
                              const Expectation& expected) {
  const KernelRecord& contract = Session::current().subject(kernelName).record();
  const Struct layout = contract.layoutOf(expected.output);
  record(bounds, seen, expected, layout);
  if (expected.width == 0) return;
  const ImageSpec& image = contract.image(expected.output);
  if (!isNarrow(image.format)) return;
  Expectation narrow = expected;
  narrow.output = narrowName(image);
  narrow.storage = storageOf(image.format);
  record(bounds, seen, narrow, layout);
}

void KernelCase::record(const Bounds& bounds, const Observation& seen, const Expectation& expected,
                        const Struct& layout) {
  Session& session = Session::current();
  Verdict verdict = judge(layout, seen, expected, bounds, session.policy(), caseSeed());
  checked(verdict.elements);
  // Another arrangement of a user's is as good as ours; ours has to be the model's own.
  const bool foreign = session.options().kernels.contains(kernelName);
  if (!verdict.ok() ||
      (!foreign && (verdict.outsideDevice > 0 || verdict.verdict != Class::kConforms)))
    ADD_FAILURE() << session.subject(kernelName).origin() << " is " << nameOf(verdict.verdict)
                  << "\n"
                  << explain(verdict, expected);
  session.currentCase().verdicts.push_back(std::move(verdict));
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
