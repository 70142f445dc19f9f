#include "harness/hygiene/observe.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace gnomon {
namespace {

// The first is a NaN, so arithmetic on it shows; the second a finite number, so that a comparison
// that NaN would decide goes the other way.
constexpr std::uint32_t kPoison[2] = {0xffffdeadu, 0x4b1d4b1du};

constexpr std::size_t kWord = sizeof(std::uint32_t);

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t index) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + index * kWord, kWord);
  return word;
}

std::string where(const std::string& place, const Struct& layout, std::size_t byte) {
  const auto offset = static_cast<unsigned>(byte % layout.size);
  for (const Field& f : layout.fields)
    if (offset >= f.offset && offset < f.offset + f.scalars * kWord)
      return fmt::format("{}.{}", place, f.name);
  return fmt::format("{} + {} bytes", place, offset);
}

std::string where(const Input& in, std::size_t byte) {
  const Struct& layout = in.spec->element;
  return where(fmt::format("{}[{}]", in.spec->name, byte / layout.size), layout, byte);
}

std::string where(const Output& out, std::size_t byte) {
  return where(out.place(byte / out.layout.size), out.layout, byte);
}

/// An input is nobody's to write, its guard included: the twin would judge what the module left.
void checkInput(std::vector<std::string>& findings, const Input& in, const Bytes& now,
                const std::string& module) {
  const auto changed = std::ranges::mismatch(in.bytes, now).in1;
  if (changed != in.bytes.end()) {
    const auto byte = static_cast<std::size_t>(changed - in.bytes.begin());
    findings.push_back(fmt::format("the {} wrote into its input, at {}", module, where(in, byte)));
    return;
  }
  for (std::size_t at = (in.bytes.size() + kWord - 1) / kWord; at < now.size() / kWord; ++at)
    if (wordAt(now, at) != kPoison[0])
      return findings.push_back(
          fmt::format("the {} wrote past the end of its input '{}'", module, in.spec->name));
}

void checkGuards(std::vector<std::string>& findings, const Output& out,
                 std::span<const std::byte> bytes, std::uint32_t poison,
                 const std::string& module) {
  const std::size_t end = out.before + out.dataBytes();
  for (std::size_t at = 0; at < out.before; at += kWord)
    if (wordAt(bytes, at / kWord) != poison)
      return findings.push_back(
          fmt::format("the {} wrote before the start of '{}': byte {} ahead of it", module,
                      out.name, out.before - at));
  for (std::size_t at = end; at + kWord <= bytes.size(); at += kWord)
    if (wordAt(bytes, at / kWord) != poison)
      return findings.push_back(
          fmt::format("the {} wrote past the end of '{}': byte {} after its {} elements", module,
                      out.name, at - end, out.elements));
}

/// Words that differ, how many and the first; two results have the same length.
struct Difference {
  std::size_t words = 0, first = 0;

  void note(std::size_t word) {
    if (words++ == 0) first = word;
  }
};

/// Words that keep their poison in both runs, and words that differ for another reason.
void checkWords(std::vector<std::string>& findings, const Output& out,
                std::span<const std::byte> first, std::span<const std::byte> second,
                bool deterministic, const std::string& module) {
  if (std::memcmp(first.data(), second.data(), first.size()) == 0) return;
  Difference unwritten, differing;
  const std::size_t perElement = out.layout.size / kWord;
  for (std::size_t i = 0; i < first.size() / kWord; ++i) {
    const std::uint32_t a = wordAt(first, i), b = wordAt(second, i);
    if (a == b) continue;
    const bool poisoned = a == out.poisoned(kPoison[0], i % perElement) &&
                          b == out.poisoned(kPoison[1], i % perElement);
    (poisoned ? unwritten : differing).note(i);
  }
  if (unwritten.words > 0)
    findings.push_back(fmt::format("the {} left {} of {} words of '{}' unwritten, first {}", module,
                                   unwritten.words, first.size() / kWord, out.name,
                                   where(out, unwritten.first * kWord)));
  if (differing.words > 0 && deterministic)
    findings.push_back(fmt::format(
        "two runs of the {} on the same input differ in {} words of '{}', first {}: it reads "
        "memory that nobody wrote, or its threads race",
        module, differing.words, out.name, where(out, differing.first * kWord)));
}

std::span<const std::byte> elementsIn(const Output& out, const Bytes& whole) {
  return std::span(whole).subspan(out.before, out.dataBytes());
}

/// Everything that is watched while one subject runs.
class Observer {
 public:
  Observer(const Subject& s, Resources& r, Observation& o) : subject(s), resources(r), seen(o) {}

  /// Both runs of one module; keeps the elements of the first.
  void watch(const GpuProgram& program, const std::string& module,
             std::map<std::string, Bytes>& outputs) {
    resources.upload(kPoison[0]);
    const std::vector<Bytes> runs[2] = {resources.run(program, kPoison[0]),
                                        resources.run(program, kPoison[1])};
    for (const Input& in : resources.inputs())
      checkInput(seen.findings, in, resources.download(in), module);
    for (std::size_t o = 0; o < resources.outputs().size(); ++o) {
      const Output& out = resources.outputs()[o];
      checkGuards(seen.findings, out, runs[0][o], kPoison[0], module);
      const auto data = elementsIn(out, runs[0][o]);
      checkWords(seen.findings, out, data, elementsIn(out, runs[1][o]),
                 subject.record().deterministic, module);
      outputs.try_emplace(out.name, data.begin(), data.end());
    }
  }

  /// What communicating threads must not depend on, against what the strict twin gave.
  void compareArrangements() {
    if (!subject.threadsCommunicate() || !subject.record().deterministic) return;
    compare(*subject.orderTwin(),
            "with the order of its groups and of the subgroups in a group turned round",
            "a barrier is missing, or its groups race");
    for (const auto& [size, program] : subject.resizedTwins())
      compare(program, fmt::format("in subgroups of {}", size),
              "it depends on the size of a subgroup");
  }

 private:
  void compare(const GpuProgram& program, const std::string& arrangement, const char* why) {
    resources.upload(kPoison[0]);
    const std::vector<Bytes> runs = resources.run(program, kPoison[0]);
    for (std::size_t o = 0; o < runs.size(); ++o) {
      const Output& out = resources.outputs()[o];
      const auto other = elementsIn(out, runs[o]);
      const Bytes& first = seen.twin.at(out.name);
      Difference differing;
      for (std::size_t i = 0; i < first.size() / kWord; ++i)
        if (wordAt(first, i) != wordAt(other, i)) differing.note(i);
      if (differing.words > 0)
        seen.findings.push_back(fmt::format("{}, {} of {} words of '{}' differ, first {}: {}",
                                            arrangement, differing.words, first.size() / kWord,
                                            out.name, where(out, differing.first * kWord), why));
    }
  }

  const Subject& subject;
  Resources& resources;
  Observation& seen;
};

bool writesNarrow(const Subject& subject, const Stimulus& stimulus) {
  return std::ranges::any_of(stimulus.outputImages, [&](const OutputImage& o) {
    return isNarrow(subject.record().image(o.image).format);
  });
}

}  // namespace

Observation observe(const Subject& subject, const Stimulus& stimulus) {
  Observation seen;
  {
    Resources resources(subject, stimulus, Target::kFloat);
    Observer observer(subject, resources, seen);
    observer.watch(subject.plain(), "kernel", seen.plain);
    observer.watch(subject.twin(), "strict twin", seen.twin);
    observer.compareArrangements();
  }
  if (writesNarrow(subject, stimulus)) {
    Resources resources(subject, stimulus, Target::kContract);
    Observer observer(subject, resources, seen);
    observer.watch(subject.plain(), "kernel", seen.plain);
    observer.watch(subject.twin(), "strict twin", seen.twin);
  }
  for (const std::string& message : subject.gpu().takeMessages())
    seen.findings.push_back("validation layer: " + message);
  return seen;
}

std::map<std::string, Bytes> runTwinOnce(const Subject& subject, const Stimulus& stimulus) {
  Resources resources(subject, stimulus, Target::kFloat);
  resources.upload(kPoison[0]);
  const std::vector<Bytes> whole = resources.run(subject.twin(), kPoison[0]);
  std::map<std::string, Bytes> outputs;
  for (std::size_t o = 0; o < whole.size(); ++o) {
    const Output& out = resources.outputs()[o];
    const auto data = elementsIn(out, whole[o]);
    outputs.try_emplace(out.name, data.begin(), data.end());
  }
  return outputs;
}

}  // namespace gnomon
