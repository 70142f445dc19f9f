// A generated input with what is asked of it, whatever its type: how KernelCase::expectConformsOn
// hands both to the shrinker.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "harness/cases/case_input.h"
#include "harness/verdict/failure.h"

namespace gnomon {

/// What a kernel did on an input, and what it was to do there.
struct Trial {
  Observation seen;
  Expectation expected;
};

/// The expectations that one output is judged by: itself, and where a frame stores it narrowly, as
/// it is read back from there.
std::vector<Expectation> judgedBy(const KernelRecord& record, const Expectation& expected);

class Generated {
 public:
  virtual ~Generated() = default;

  virtual CaseInput gathered(const KernelRecord& record) = 0;
  /// Becomes that input, with what follows from its sizes; or why it cannot.
  virtual std::optional<std::string> take(const CaseInput& input) = 0;
  /// Valid until the next take().
  virtual Trial run() = 0;
};

/// Where a stage has `bool admits(const Input&)` beside `parts`, what it denies is outside the
/// kernel's contract.
template <class Input>
bool contractAdmits(const Input& input) {
  if constexpr (requires { admits(input); })
    return admits(input);
  else
    return true;
}

template <class Input, class Property>
class GeneratedOf : public Generated {
 public:
  GeneratedOf(Input i, const Property& p) : input(std::move(i)), property(p) {}

  CaseInput gathered(const KernelRecord& record) override { return gather(record, names()); }

  std::optional<std::string> take(const CaseInput& other) override {
    if (auto misfit = scatter(other, names())) return misfit;
    if (!contractAdmits(input)) return "the kernel's contract does not admit its numbers";
    return std::nullopt;
  }

  Trial run() override { return property(input); }

 private:
  NameParts names() {
    return [this](Parts& p) { parts(p, input); };
  }

  Input input;
  const Property& property;
};

/// What a failure was shrunk to.
struct ShrunkFailure {
  std::string text{};                 ///< for the message
  std::optional<std::string> file{};  ///< to replay it from, where it could be written
};

/// Whose failure it is.
struct Subjected {
  const KernelRecord& record;
  const Standard& standard;
  std::size_t judgement = 0;  ///< CaseFile::judgement
};

/// Shrinks the input that has just failed and writes it to the session's folder of failures.
/// Nothing where no single input is to blame.
std::optional<ShrunkFailure> shrinkFailure(Generated& generated, const Trial& trial,
                                           const Verdict& verdict, const Subjected& subject);

/// The input that fails with its numbers, as it is shown, and the first intermediate that is wrong.
std::string explainInput(Generated& generated, const Verdict& verdict, const Subjected& subject);

}  // namespace gnomon
