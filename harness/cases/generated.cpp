#include "harness/cases/generated.h"

#include <algorithm>

#include <fmt/format.h>

#include "harness/cases/case_file.h"
#include "harness/cases/kernel_case.h"
#include "harness/cases/probes.h"
#include "harness/cases/shrink.h"
#include "harness/hygiene/levels.h"

namespace gnomon {
namespace {

/// One element of a buffer, as if it had run alone.
Observation elementSeen(const Observation& seen, const std::string& output, std::size_t size,
                        std::size_t i) {
  Observation one{.unmapped = seen.unmapped};
  const auto cut = [&](const Bytes& all) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(i * size);
    return Bytes(from, from + static_cast<std::ptrdiff_t>(size));
  };
  one.plain[output] = cut(seen.plain.at(output));
  one.twin[output] = cut(seen.twin.at(output));
  return one;
}

Expectation elementExpected(const Expectation& all, std::size_t i) {
  Expectation one = all;
  one.elements = 1;
  one.corners = 0;
  one.plain = [&all, i](std::size_t, std::span<double> out) { all.plain(i, out); };
  one.bounded = [&all, i](std::size_t, std::span<Bounded> out) { all.bounded(i, out); };
  return one;
}

/// Asks candidates for the failure of the original.
class Retrial {
 public:
  Retrial(Generated& g, const Subjected& s, Failure f)
      : generated(g),
        subject(s),
        failure(std::move(f)),
        policy(forFewElements(Session::current().policy())) {}

  /// Elements of a single buffer are independent of each other: many candidates of one element
  /// each are one dispatch. Findings of hygiene belong to the dispatch, not to an element.
  bool atOnce(const CaseInput& input) const {
    return together && failure.kind != Failure::Kind::kHygiene && !input.push &&
           input.images.empty() && input.buffers.size() == 1 && input.buffers[0].elements() == 1;
  }

  std::optional<CaseInput> fitted(const CaseInput& candidate) {
    if (generated.take(candidate)) return std::nullopt;
    CaseInput taken = generated.gathered(subject.record);
    taken.focus = candidate.focus;
    return taken;
  }

  std::optional<std::size_t> firstFailing(std::span<const CaseInput> candidates) {
    if (candidates.size() > 1) {
      bool clean = true;
      const auto found = firstOfMany(candidates, clean);
      if (clean) return found;
    }
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (failsAlone(candidates[i])) return i;
    return std::nullopt;
  }

  /// The verdict of the candidate by itself, if it fails in the same way.
  std::optional<Verdict> failsAlone(const CaseInput& candidate) {
    Session::current().cameFurther();
    if (generated.take(candidate)) return std::nullopt;
    const Trial trial = generated.run();
    if (!trial.seen.applies) return std::nullopt;
    for (const Expectation& e : judgedBy(subject.record, trial.expected)) {
      if (e.output != failure.output) continue;
      Verdict v = judged(trial, trial.seen, e);
      if (failsBy(failure, v, trial.seen, subject.standard)) return v;
    }
    return std::nullopt;
  }

  /// From now on one by one: what fails among many, and not alone, depends on its neighbours.
  void judgeApart() { together = false; }

 private:
  std::optional<std::size_t> firstOfMany(std::span<const CaseInput> candidates, bool& clean) {
    CaseInput all = candidates.front();
    for (const CaseInput& c : candidates.subspan(1))
      all.buffers[0].bytes.insert(all.buffers[0].bytes.end(), c.buffers[0].bytes.begin(),
                                  c.buffers[0].bytes.end());
    Session::current().cameFurther();
    clean = false;
    if (generated.take(all)) return std::nullopt;
    const Trial trial = generated.run();
    if (!trial.seen.applies || !trial.seen.findings.empty() ||
        trial.expected.elements != candidates.size())
      return std::nullopt;
    clean = true;
    const std::size_t size = subject.record.layoutOf(trial.expected.output).size;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Observation one = elementSeen(trial.seen, trial.expected.output, size, i);
      if (failsBy(failure, judged(trial, one, elementExpected(trial.expected, i)), one,
                  subject.standard))
        return i;
    }
    return std::nullopt;
  }

  Verdict judged(const Trial& trial, const Observation& seen, const Expectation& e) const {
    return judge(subject.record.layoutOf(trial.expected.output), seen, e, subject.standard.bounds,
                 policy, caseSeed());
  }

  Generated& generated;
  const Subjected& subject;
  Failure failure;
  Policy policy;
  bool together = true;
};

uvec2 focusOf(const Trial& trial, const Verdict& v) {
  const Offender* worst = worstOf(v);
  if (worst == nullptr) return {0, 0};
  const unsigned width = trial.expected.width;
  if (width == 0) return {worst->element, 0};
  if (trial.expected.mips == 1) return {worst->element % width, worst->element / width};
  const LevelPixel at =
      pixelAt({width, trial.expected.height, trial.expected.mips}, worst->element);
  return {at.x << at.level, at.y << at.level};  // the first of the pixels that it is made of
}

std::string whatItDoes(const Failure& f) {
  switch (f.kind) {
    case Failure::Kind::kHygiene:
      return "with the same finding";
    case Failure::Kind::kOutside:
      return fmt::format("whose {} is outside", f.field);
    case Failure::Kind::kRearranged:
      return fmt::format("whose {} is rearranged too far", f.field);
  }
  return "";
}

std::string story(const Shrunk& s, const Failure& f) {
  const std::string tried = fmt::format("{} input{} tried", s.trials, s.trials == 1 ? "" : "s");
  if (s.steps == 0)
    return fmt::format("No simpler input {} was found ({}) than:\n", whatItDoes(f), tried);
  return fmt::format("Shrunk in {} step{} ({}) to {} {}:\n", s.steps, s.steps == 1 ? "" : "s",
                     tried, s.finished ? "the simplest" : "what there was time for, an input",
                     whatItDoes(f));
}

std::optional<std::string> written(const CaseInput& input, const Failure& f,
                                   const Subjected& subject) {
  Session& session = Session::current();
  const SessionOptions& options = session.options();
  const CaseRecord& record = session.currentCase();
  if (options.failures.empty() || input.numbers() > kMostNumbers) return std::nullopt;
  const std::filesystem::path file = caseFileIn(options.failures, record.name);
  const bool done = writeCaseFile(file, {.name = record.name,
                                         .kernel = record.kernel,
                                         .seed = options.seed,
                                         .device = session.gpu().info().name,
                                         .output = f.output,
                                         .field = f.field,
                                         .judgement = subject.judgement,
                                         .input = input});
  return done ? std::optional(file.string()) : std::nullopt;
}

/// The first intermediate that is wrong with the input as it is now.
std::string intermediates(Generated& generated, const Verdict& verdict, const Subjected& subject) {
  const Trial trial = generated.run();
  for (const Expectation& e : judgedBy(subject.record, trial.expected))
    if (e.output == verdict.output)
      return firstDivergence(subject.record.name(), trial.seen, e, subject.standard.bounds,
                             verdict);
  return {};
}

}  // namespace

std::vector<Expectation> judgedBy(const KernelRecord& record, const Expectation& expected) {
  std::vector<Expectation> all = {expected};
  if (expected.width == 0) return all;
  const ImageSpec& image = record.image(expected.output);
  if (!isNarrow(image.format)) return all;
  all.push_back(expected);
  all.back().output = narrowName(image);
  all.back().storage = storageOf(image.format);
  return all;
}

std::string explainInput(Generated& generated, const Verdict& verdict, const Subjected& subject) {
  const CaseInput input = generated.gathered(subject.record);
  std::string text = fmt::format("  {}\n", sizeInWords(input)) + inWords(input);
  for (const std::string& p : verdict.problems) text += "  - " + p + "\n";
  // What was not written, or written twice, has no numbers of its own.
  const Offender* worst = worstOf(verdict);
  if (worst != nullptr && (verdict.problems.empty() || verdict.rearranged))
    text += fmt::format("  {}.{}\n", verdict.output, worst->field) + explainNumbers(*worst);
  return text + intermediates(generated, verdict, subject);
}

std::optional<ShrunkFailure> shrinkFailure(Generated& generated, const Trial& trial,
                                           const Verdict& verdict, const Subjected& subject) {
  const auto failure = failureOf(verdict, trial.seen, subject.standard);
  if (!failure) return std::nullopt;
  const Policy& policy = Session::current().policy();
  CaseInput original = generated.gathered(subject.record);
  original.focus = focusOf(trial, verdict);
  const struct Restore {  // the trial still refers to the input
    ~Restore() { generated.take(input); }
    Generated& generated;
    const CaseInput& input;
  } restore{generated, original};
  Retrial retrial(generated, subject, *failure);
  const Trials trials{
      .fitted = [&](const CaseInput& c) { return retrial.fitted(c); },
      .firstFailing = [&](auto candidates) { return retrial.firstFailing(candidates); },
      .atOnce = [&](const CaseInput& c) { return retrial.atOnce(c); }};
  const ShrinkLimits limits{.time = std::chrono::duration<double>(policy["shrinkSeconds"]),
                            .trials = static_cast<std::size_t>(policy["shrinkTrials"])};
  Shrunk shrunk = shrink(original, trials, limits);
  std::optional<Verdict> alone;
  try {
    alone = retrial.failsAlone(shrunk.input);
    if (!alone && shrunk.steps > 0) {
      retrial.judgeApart();
      shrunk = shrink(original, trials, limits);
      alone = retrial.failsAlone(shrunk.input);
    }
  } catch (const std::exception&) {  // the device went: the message of the original has to do
  }
  if (!alone) return std::nullopt;
  return ShrunkFailure{.text = story(shrunk, *failure) + explainInput(generated, *alone, subject),
                       .file = written(shrunk.input, *failure, subject)};
}

}  // namespace gnomon
