// The fixture of every case that runs a kernel: upload, run, read, judge, each one line in a test.
#pragma once

#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "harness/cases/generated.h"
#include "harness/cases/picture.h"
#include "harness/cases/session.h"
#include "harness/hygiene/levels.h"
#include "harness/hygiene/observe.h"
#include "harness/verdict/verdict.h"
#include "reference/bound/explore.h"
#include "reference/bound/vec.h"

namespace gnomon {

/// A suite for kernel "stage/entry" is a class StageEntry derived from this, so that the command
/// knows whose case it is; model-only cases go into a suite StageEntryModel without the fixture.
class KernelCase : public testing::Test {
 protected:
  explicit KernelCase(std::string kernel) : kernelName(std::move(kernel)) {}

  /// Skips the case as unsupported where the device lacks what the kernel needs.
  void SetUp() override;

  /// The same where only a dispatch tells: the device cannot filter a format, or store to it.
  void skipWhereUnsupported(const std::function<void()>& attempt);

  /// Skips a case that reads outputs directly where a foreign kernel does not give all of them.
  void skipUnlessEveryOutputIsGiven();

  /// Skips a case that judges the kernel's probes unless it is the project's own: another
  /// arrangement is as good as ours, and its intermediates are where it has them.
  void skipUnlessTheProbesAreOurs();

  /// Leaves a case out of the sweep over subgroup widths: what threads tell each other, other cases
  /// of the kernel are about.
  void widthDoesNotMatter();

  /// The same, and the order twin of its kernel does not run either: for a case of many images,
  /// since drivers compile all that runs anew for some sizes and formats.
  void threadsDoNotMatter();

  /// Whether the kernel takes these push constants: a foreign one may stand for one value of some,
  /// as its adapter's constants say. A case goes on to the next where it does not.
  bool applies(std::span<const std::byte> push);
  template <class Push>
  bool applies(const Push& push) {
    return applies(std::as_bytes(std::span(&push, 1)));
  }

  /// Makes an input what a kernel can know of it: there and back through the conventions of a
  /// foreign one, which may lose digits. Changes nothing for ours.
  void recover(Picture& picture, const std::string& meaning);

  /// A case in which nothing applied was skipped.
  void TearDown() override;

  /// Runs the kernel under every check of hygiene; the findings go to the verdict. Where it does
  /// not apply, nothing runs, and expectConforms says nothing of what is returned.
  Observation run(Stimulus stimulus);

  /// Fails the case where an intermediate that the kernel names is outside what the model records
  /// of it, under the rules that decide.
  void expectEveryProbeInside(const Observation& seen, const Expectation& expected);

  /// Fails the case unless the contract and the model of these expectations, together, name the
  /// same intermediates: a name that only one of them knows is never judged.
  void expectTheModelNamesEveryProbe(std::span<const Expectation> expected);

  /// For laws, which judge without a verdict: fails the case with what hygiene found.
  void expectClean(const Observation& seen);

  /// Judges one output and records the verdict; an image that a frame stores narrowly, also as it
  /// is read back from its format. A kernel of the project must conform; a verdict of wrong, or
  /// outside the device's measured errors, fails the case with an explanation.
  void expectConforms(const Observation& seen, const Expectation& expected);

  /// The same under the specification alone, for the stage that measures the device.
  void expectWithinSpecification(const Observation& seen, const Expectation& expected);

  /// The same for a generated input: `property(input)` runs the kernel on it and returns the
  /// Trial; it may change the input first, into what a kernel can know of it. An input that fails
  /// is shrunk, and written to a file that replays it. Needs `void parts(Parts&, Input&)`.
  template <class Input, class Property>
  void expectConformsOn(Input input, const Property& property) {
    GeneratedOf<Input, Property> generated(std::move(input), property);
    judgeGenerated(generated);
  }

  /// Elements that a law was checked on, for the tally.
  void checked(std::size_t elements) { Session::current().currentCase().elements += elements; }

  const std::string kernelName;

 private:
  /// What a message says of a verdict that fails.
  using Explain = std::function<std::string(const Verdict&, const Expectation&)>;

  Standard standard() const;
  void judgeGenerated(Generated& generated);
  void replay(Generated& generated, std::size_t judgement);
  void expectWithin(const Standard& standard, const Observation& seen, const Expectation& expected);
  /// With the first intermediate that is wrong.
  std::string explainProbed(const Standard& by, const Observation& seen, const Verdict& verdict,
                            const Expectation& expected) const;
  void expectWithin(const Standard& standard, const Policy& policy, const Observation& seen,
                    const Expectation& expected, const Explain& explained);
  std::size_t runs = 0, left = 0;  // of run(), and where the kernel did not apply
  std::size_t judgements = 0;      // of generated inputs
  bool threadsMatter = true;
};

/// A seed of its own for every case, from the run's seed and the case's name.
std::uint64_t caseSeed();

/// How many elements a generated case has: --cases, or the policy's number of that name.
std::size_t generated(const char* policyName);

/// The elements of an output.
template <class T>
std::vector<T> elementsOf(const std::vector<std::byte>& bytes) {
  std::vector<T> all(bytes.size() / sizeof(T));
  if (!all.empty()) std::memcpy(all.data(), bytes.data(), bytes.size());
  return all;
}

/// Calls f for every number of a model's result, in the order of its scalars(), or of an array.
template <class T, class F>
void forEachScalar(T& x, F& f) {
  if constexpr (requires { x.scalars(); })
    std::apply([&](auto&... members) { (forEachScalar(members, f), ...); }, x.scalars());
  else if constexpr (requires { x.begin(); })
    for (auto& element : x) forEachScalar(element, f);
  else
    f(x);
}

/// An expectation from a model that is one function template over the number type:
/// `model.template operator()<T>(i)` returns a struct whose scalars are those of the contract.
template <class Model, class Describe>
Expectation expectationOf(std::string output, std::size_t elements, Model model, Describe inputs) {
  Expectation e;
  e.output = std::move(output);
  e.elements = elements;
  e.plain = [model](std::size_t i, std::span<double> out) {
    auto store = [at = out.begin()](double x) mutable { *at++ = x; };
    auto result = model.template operator()<double>(i);
    forEachScalar(result, store);
  };
  e.bounded = [model](std::size_t i, std::span<Bounded> out) {
    auto store = [at = out.begin()](const Bounded& x) mutable { *at++ = x; };
    auto result = explore([&] { return model.template operator()<Bounded>(i); });
    forEachScalar(result, store);
  };
  e.inputs = inputs;
  return e;
}

/// The same for an image, pixel by pixel: the model returns what the record's format has channels.
template <class Model, class Describe>
Expectation pixelsOf(std::string image, const uvec2& size, Model model, Describe inputs) {
  Expectation e = expectationOf(std::move(image), std::size_t{size.x} * size.y, model, inputs);
  e.width = size.x;
  return e;
}

/// The same for an image with mip levels, one level after the other.
template <class Model, class Describe>
Expectation levelsOf(std::string image, const Levels& levels, Model model, Describe inputs) {
  Expectation e = expectationOf(std::move(image), pixelsOf(levels), model, inputs);
  e.width = levels.width;
  e.height = levels.height;
  e.mips = levels.count;
  return e;
}

}  // namespace gnomon
