#include "harness/cases/kernel_case.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/cases/hash.h"
#include "harness/error.h"
#include "harness/hygiene/pack.h"

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

void KernelCase::skipUnlessEveryOutputIsGiven() {
  if (IsSkipped()) return;
  const Interface& interface = Session::current().subject(kernelName).interface();
  if (interface.unmapped.empty()) return;
  GTEST_SKIP() << fmt::format("the kernel does not give {}", fmt::join(interface.unmapped, ", "));
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
  return observe(session.subject(kernelName), stimulus, session.watch());
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
  if (!seen.applies) return;
  const KernelRecord& contract = Session::current().subject(kernelName).record();
  const Struct layout = contract.layoutOf(expected.output);
  record(bounds, seen, expected, layout);
  if (expected.width == 0) return;
  const ImageSpec& image = contract.image(expected.output);
  if (!isNarrow(image.format) || !seen.twin.contains(narrowName(image))) return;
  Expectation narrow = expected;
  narrow.output = narrowName(image);
  narrow.storage = storageOf(image.format);
  record(bounds, seen, narrow, layout);
}

void KernelCase::record(const Bounds& bounds, const Observation& seen, const Expectation& expected,
                        const Struct& layout) {
  Session& session = Session::current();
  // Another arrangement of a user's is as good as ours; ours has to be the model's own, and as
  // exact as this device is.
  const bool foreign = session.options().kernels.contains(kernelName);
  Bounds deciding = bounds;
  if (foreign) deciding.device.reset();
  Verdict verdict = judge(layout, seen, expected, deciding, session.policy(), caseSeed());
  checked(verdict.elements);
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
