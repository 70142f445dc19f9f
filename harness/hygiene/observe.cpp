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

std::string where(const Output& out, std::size_t byte) {
  return where(out.place(byte / out.layout.size), out.layout, byte);
}

/// Whether the contract has a word of an element depend on timing.
bool varies(const Struct& layout, std::size_t word) {
  return std::ranges::any_of(layout.fields, [&](const Field& f) {
    return f.varies && word * kWord >= f.offset && word * kWord < f.offset + f.scalars * kWord;
  });
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
  if (std::ranges::equal(first, second)) return;
  Difference unwritten, differing;
  const std::size_t perElement = out.layout.size / kWord;
  for (std::size_t i = 0; i < first.size() / kWord; ++i) {
    const std::uint32_t a = wordAt(first, i), b = wordAt(second, i);
    if (a == b) continue;
    const bool poisoned = a == out.poisoned(kPoison[0], i % perElement) &&
                          b == out.poisoned(kPoison[1], i % perElement);
    if (poisoned || !varies(out.layout, i % perElement)) (poisoned ? unwritten : differing).note(i);
  }
  if (unwritten.words > 0 && !out.list)
    findings.push_back(fmt::format("the {} left {} of {} words of '{}' unwritten, first {}", module,
                                   unwritten.words, first.size() / kWord, out.name,
                                   where(out, unwritten.first * kWord)));
  if (differing.words > 0 && deterministic)
    findings.push_back(fmt::format(
        "two runs of the {} on the same input differ in {} words of '{}', first {}: it reads "
        "memory that nobody wrote, or its threads race",
        module, differing.words, out.name, where(out, differing.first * kWord)));
}

/// Everything that is watched while one subject runs.
class Observer {
 public:
  Observer(const Subject& s, Resources& r, Observation& o) : subject(s), resources(r), seen(o) {}

  /// Both runs of one module; keeps the outputs of the first.
  void watch(const GpuProgram& program, const std::string& module,
             std::map<std::string, Bytes>& outputs) {
    resources.upload();
    Aftermath first = resources.run(program, kPoison[0]);
    const Aftermath second = resources.run(program, kPoison[1]);
    // The same again in the second run would be no news.
    const auto& strays = first.strays.empty() ? second.strays : first.strays;
    strayed = strayed || !strays.empty();
    for (const auto& found : {strays, resources.changedInputs()})
      for (const std::string& what : found)
        seen.findings.push_back(fmt::format("the {} {}", module, what));
    for (std::size_t o = 0; o < resources.outputs().size(); ++o) {
      const Output& out = resources.outputs()[o];
      checkWords(seen.findings, out, first.outputs[o], second.outputs[o],
                 subject.record().deterministic, module);
      outputs.try_emplace(out.name, std::move(first.outputs[o]));
    }
  }

  /// What communicating threads must not depend on, against what the strict twin gave.
  void compareArrangements() {
    if (!subject.threadsCommunicate() || !subject.record().deterministic) return;
    compare(subject.orderTwin(),
            "with the order of its groups and of the subgroups in a group turned round",
            "a barrier is missing, or its groups race");
    for (const auto& [size, program] : subject.resizedTwins())
      compare(program, fmt::format("in subgroups of {}", size),
              "it depends on the size of a subgroup");
  }

 private:
  void compare(const GpuProgram& program, const std::string& arrangement, const char* why) {
    resources.upload();
    const Aftermath other = resources.run(program, kPoison[0]);
    if (!strayed)
      for (const std::string& what : other.strays)
        seen.findings.push_back(fmt::format("{}, it {}: {}", arrangement, what, why));
    for (std::size_t o = 0; o < other.outputs.size(); ++o) {
      const Output& out = resources.outputs()[o];
      const Bytes& first = seen.twin.at(out.name);
      Difference differing;
      for (std::size_t i = 0; i < first.size() / kWord; ++i)
        if (wordAt(first, i) != wordAt(other.outputs[o], i) &&
            !varies(out.layout, i % (out.layout.size / kWord)))
          differing.note(i);
      if (differing.words > 0)
        seen.findings.push_back(fmt::format("{}, {} of {} words of '{}' differ, first {}: {}",
                                            arrangement, differing.words, first.size() / kWord,
                                            out.name, where(out, differing.first * kWord), why));
    }
  }

  const Subject& subject;
  Resources& resources;
  Observation& seen;
  bool strayed = false;  // already in the usual order
};

bool writesNarrow(const Subject& subject, const Stimulus& stimulus) {
  return std::ranges::any_of(stimulus.outputImages, [&](const OutputImage& o) {
    return isNarrow(subject.record().image(o.image).format);
  });
}

}  // namespace

Observation observe(const Subject& subject, const Stimulus& stimulus, Watch watch) {
  const bool asItIs = watch == Watch::kAll || watch == Watch::kInOrder;
  const bool reordered = watch == Watch::kAll || watch == Watch::kTwins;
  const bool twinAlone = watch == Watch::kTwinAlone;
  Observation seen;
  seen.unmapped = {subject.interface().unmapped.begin(), subject.interface().unmapped.end()};
  {
    Resources resources(subject, stimulus, Target::kFloat);
    Observer observer(subject, resources, seen);
    if (asItIs) observer.watch(subject.plain(), "kernel", seen.plain);
    observer.watch(subject.twin(), "strict twin", seen.twin);
    if (reordered) observer.compareArrangements();
  }
  if (!twinAlone && writesNarrow(subject, stimulus)) {
    Resources resources(subject, stimulus, Target::kContract);
    Observer observer(subject, resources, seen);
    if (asItIs) observer.watch(subject.plain(), "kernel", seen.plain);
    observer.watch(subject.twin(), "strict twin", seen.twin);
  }
  if (!asItIs) seen.plain = seen.twin;
  for (const std::string& message : subject.gpu().takeMessages())
    seen.findings.push_back("validation layer: " + message);
  return seen;
}

std::uint32_t poisonOf(unsigned run) { return kPoison[run]; }

std::map<std::string, Bytes> runTwinOnce(const Subject& subject, const Stimulus& stimulus,
                                         unsigned poison) {
  Resources resources(subject, stimulus, Target::kFloat);
  resources.upload();
  Aftermath after = resources.run(subject.twin(), kPoison[poison]);
  std::map<std::string, Bytes> outputs;
  for (std::size_t o = 0; o < after.outputs.size(); ++o)
    outputs.try_emplace(resources.outputs()[o].name, std::move(after.outputs[o]));
  return outputs;
}

}  // namespace gnomon
