#include "harness/cases/probes.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/cases/session.h"
#include "harness/error.h"
#include "harness/hygiene/levels.h"

namespace gnomon {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, kWord);
  return word;
}

double numberOf(std::uint32_t word, ScalarType type) {
  if (type == ScalarType::kUint) return word;
  if (type == ScalarType::kInt) return static_cast<std::int32_t>(word);
  return static_cast<double>(std::bit_cast<float>(word));
}

std::optional<Bounded> allowedOf(const Recording::Names& model, const Field& field, unsigned c) {
  const auto found = model.find(field.name);
  if (found == model.end() || !found->second.certain) return std::nullopt;
  if (c >= found->second.components.size()) return std::nullopt;
  const Bounded& x = found->second.components[c];
  return x.notJudged() || x.unspecified() ? std::nullopt : std::optional(x);
}

bool diverges(const ProbedScalar& s) {
  return s.allowed && (!s.written || !(budgetUsed(s.got, *s.allowed, false) <= 1));
}

/// Fields in order, each once, as far as the model judges them.
std::vector<std::string> judgedBefore(const std::vector<ProbedScalar>& element,
                                      const ProbedScalar* end) {
  std::vector<std::string> names;
  for (const ProbedScalar& s : element) {
    if (end != nullptr && s.field == end->field) break;
    if (s.allowed && (names.empty() || names.back() != s.field)) names.push_back(s.field);
  }
  return names;
}

/// In lines that a terminal shows whole, broken at spaces; ends in a line's end.
std::string inLines(const std::string& text) {
  constexpr std::size_t kColumns = 100;
  std::string lines;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (column > 0) {
      const bool fits = column + 1 + (end - begin) <= kColumns;
      lines += fits ? ' ' : '\n';
      column = fits ? column + 1 : 0;
    }
    lines.append(text, begin, end - begin);
    column += end - begin;
    begin = end + 1;
  }
  return lines + '\n';
}

std::string number(double x) { return fmt::format("{:.9g}", x); }

/// An image whose rows a foreign kernel counts from below has its probes there too.
std::size_t probeIndex(const Subject& subject, const Expectation& expected,
                       const Stimulus& stimulus, std::size_t element) {
  const auto y = subject.conventions().find("y");
  if (expected.width == 0 || y == subject.conventions().end() || y->second != "up") return element;
  if (expected.mips > 1) {
    const Levels image{expected.width, expected.height, expected.mips};
    const LevelPixel at = pixelAt(image, element);
    const auto [width, rows] = mipSize({.width = image.width, .height = image.height}, at.level);
    return element - std::size_t{at.y} * width + std::size_t{rows - 1 - at.y} * width;
  }
  const std::size_t height = stimulus.outputImages.front().height;
  const std::size_t x = element % expected.width, row = element / expected.width;
  const std::size_t layer = row / height;
  return (layer * height + height - 1 - row % height) * expected.width + x;
}

/// Both runs of a probed kernel over a stimulus.
class ProbedRuns {
 public:
  ProbedRuns(const Subject& s, const Observation& seen, const Expectation& e)
      : subject(s), expected(e), stimulus(seen.stimulus->get()) {
    stimulus.outputs.push_back({kProbesOutput, e.elements});
    first = runTwinOnce(subject, stimulus, 0);
    second = runTwinOnce(subject, stimulus, 1);
    const std::vector<std::string> messages = subject.gpu().takeMessages();
    if (!messages.empty()) throw UsageError("validation layer: " + messages.front());
  }

  std::vector<ProbedScalar> at(std::size_t element, const Recording::Names& model) const {
    const Struct& layout = subject.record().probes;
    const std::size_t begin =
        probeIndex(subject, expected, stimulus, element) * std::size_t{layout.size};
    const auto of = [&](const std::map<std::string, Bytes>& run) {
      return std::span(run.at(kProbesOutput)).subspan(begin, layout.size);
    };
    return probedElement(layout, of(first), of(second), model);
  }

  /// Whether the result is the one that was judged; another says that probes changed it.
  bool repeats(const Observation& seen, std::size_t element) const {
    const auto now = first.find(expected.output);
    const auto then = seen.twin.find(expected.output);
    if (now == first.end() || then == seen.twin.end() || expected.elements == 0) return true;
    const std::size_t size = then->second.size() / expected.elements;
    return std::memcmp(now->second.data() + element * size, then->second.data() + element * size,
                       size) == 0;
  }

 private:
  const Subject& subject;
  const Expectation& expected;
  Stimulus stimulus;
  std::map<std::string, Bytes> first, second;
};

std::string firstDivergenceOrThrow(const std::string& kernel, const Observation& seen,
                                   const Expectation& expected, const Rules& rules,
                                   std::size_t element) {
  Session& session = Session::current();
  session.cameFurther();  // the run that failed had its time
  const Subject* subject = session.probed(kernel);
  if (subject == nullptr) return {};
  const ProbedRuns runs(*subject, seen, expected);
  session.cameFurther();
  std::string text = describeDivergence(runs.at(element, recorded(expected, rules, element)),
                                        expected.place(element));
  if (!runs.repeats(seen, element))
    text += inLines(
        "(With probes its results differ from those that were judged: what the compiler makes of "
        "it depends on them.)");
  return text;
}

}  // namespace

std::vector<ProbedScalar> probedElement(const Struct& probes, std::span<const std::byte> first,
                                        std::span<const std::byte> second,
                                        const Recording::Names& model) {
  std::vector<ProbedScalar> all;
  for (const Field& f : probes.fields)
    for (unsigned c = 0; c < f.scalars; ++c) {
      const std::uint32_t a = wordAt(first, f.offset + kWord * c);
      const std::uint32_t b = wordAt(second, f.offset + kWord * c);
      all.push_back({.name = f.scalarName(c),
                     .field = f.name,
                     .got = numberOf(a, f.scalar),
                     .written = a != poisonOf(0) || b != poisonOf(1),
                     .allowed = allowedOf(model, f, c)});
    }
  return all;
}

const ProbedScalar* firstDiverging(const std::vector<ProbedScalar>& element) {
  const auto found = std::ranges::find_if(element, diverges);
  return found == element.end() ? nullptr : &*found;
}

std::string describeDivergence(const std::vector<ProbedScalar>& element, const std::string& place) {
  const ProbedScalar* first = firstDiverging(element);
  const std::vector<std::string> before = judgedBefore(element, first);
  if (first == nullptr && before.empty()) {
    const bool any = std::ranges::any_of(element, &ProbedScalar::written);
    return inLines(fmt::format("Of {} the model ends before any intermediate that has a name{}.",
                               place, any ? "; the kernel goes on" : ""));
  }
  if (first == nullptr)
    return inLines(
        fmt::format("At {} every intermediate that the kernel names is inside: the fault comes "
                    "after them ({}).",
                    place, fmt::join(before, ", ")));
  std::string text = fmt::format("At {} it first diverges at {}: ", place, first->name);
  text += first->written ? fmt::format("got {} (strict twin), ", number(first->got))
                         : std::string("never computed, ");
  text += fmt::format("allowed [{}, {}]", number(first->allowed->lo), number(first->allowed->hi));
  if (first->written) text += fmt::format(", model {}", number(first->allowed->value));
  if (!before.empty())
    text += fmt::format("; {} before it {} inside ({})", before.size() == 1 ? "the one" : "all",
                        before.size() == 1 ? "is" : "are", fmt::join(before, ", "));
  return inLines(text + ".");
}

Recording::Names recorded(const Expectation& expected, const Rules& rules, std::size_t element) {
  const UseRules scope(rules);
  // More scalars than any contract's element has: an array in one is a buffer of its own.
  constexpr std::size_t kMostScalars = 1024;
  std::vector<Bounded> ignored(kMostScalars);
  const Recording recording;
  expected.bounded(element, ignored);
  return recording.names();
}

std::vector<std::string> disagreements(const Struct& probes,
                                       std::span<const Expectation> expected) {
  std::map<std::string, std::size_t> said;
  for (const Expectation& e : expected)
    for (std::size_t i = 0; i < e.elements; ++i)
      for (const auto& [name, intermediate] : recorded(e, rules(), i))
        said[name] = intermediate.components.size();
  std::vector<std::string> wrong;
  for (const Field& f : probes.fields)
    if (!said.contains(f.name))
      wrong.push_back(fmt::format("the model does not name the probe '{}'", f.name));
  for (const auto& [name, scalars] : said) {
    const auto f = std::ranges::find(probes.fields, name, &Field::name);
    if (f == probes.fields.end())
      wrong.push_back(fmt::format("the contract has no probe '{}', which the model names", name));
    else if (f->scalars != scalars)
      wrong.push_back(fmt::format("'{}' has {} scalars in the contract and {} in the model", name,
                                  f->scalars, scalars));
  }
  return wrong;
}

std::string firstDivergence(const std::string& kernel, const Observation& seen,
                            const Expectation& expected, const Bounds& deciding,
                            const Verdict& verdict) noexcept try {
  const Offender* worst = worstOf(verdict);
  if (worst == nullptr || seen.stimulus == nullptr) return {};
  try {
    return firstDivergenceOrThrow(
        kernel, seen, expected, deciding.device ? *deciding.device : deciding.spec, worst->element);
  } catch (const std::exception& error) {
    const std::string why = error.what();
    return inLines("Its intermediates are not known, since the run with probes failed: " +
                   why.substr(0, why.find('\n')));
  }
} catch (...) {
  return {};
}

std::vector<std::string> divergences(const std::string& kernel, const Observation& seen,
                                     const Expectation& expected, const Rules& rules,
                                     std::size_t most) {
  const Subject* subject = Session::current().probed(kernel);
  if (subject == nullptr) return {"the kernel names no intermediates"};
  const ProbedRuns runs(*subject, seen, expected);
  std::vector<std::string> found;
  for (std::size_t i = 0; i < expected.elements && found.size() < most; ++i) {
    const std::vector<ProbedScalar> element = runs.at(i, recorded(expected, rules, i));
    if (firstDiverging(element) != nullptr)
      found.push_back(describeDivergence(element, expected.place(i)));
  }
  return found;
}

}  // namespace gnomon
