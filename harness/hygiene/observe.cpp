#include "harness/hygiene/observe.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace gnomon {
namespace {

// The first is a NaN, so arithmetic on it shows; the second a finite number, so that a comparison
// that NaN would decide goes the other way.
constexpr std::uint32_t kPoison[2] = {0xffffdeadu, 0x4b1d4b1du};

// Wide enough for a whole group of 1,024 threads to overrun by one 64-byte element each.
constexpr std::size_t kGuardBytes = 64 * 1024;

constexpr std::size_t kWord = sizeof(std::uint32_t);

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t index) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + index * kWord, kWord);
  return word;
}

/// One output buffer: guard, elements, guard.
struct Output {
  const BufferSpec* spec;
  std::size_t elements;
  std::size_t before;  // bytes of the leading guard, aligned for binding
  GpuBuffer buffer;

  std::size_t dataBytes() const { return elements * spec->element.size; }
};

/// One input buffer: elements, guard.
struct Input {
  const BufferSpec* spec;
  std::span<const std::byte> bytes;
  GpuBuffer buffer;
};

/// The stimulus as device buffers.
struct Setup {
  std::vector<Input> inputs;
  std::vector<Output> outputs;
  Dispatch dispatch;
};

void addInput(Setup& setup, Gpu& gpu, const BufferSpec& spec, std::span<const std::byte> bytes) {
  setup.inputs.push_back({&spec, bytes, gpu.allocate(bytes.size() + kGuardBytes)});
  setup.dispatch.buffers.push_back(
      {.slot = {.set = 0, .binding = spec.binding}, .range = bytes.size() + kGuardBytes});
}

void addOutput(Setup& setup, Gpu& gpu, const BufferSpec& spec, std::size_t elements) {
  const std::size_t align = std::max<std::size_t>(gpu.offsetAlignment(), kWord);
  Output out{&spec, elements, (kGuardBytes + align - 1) / align * align, {}};
  out.buffer = gpu.allocate(out.before + out.dataBytes() + kGuardBytes);
  setup.dispatch.buffers.push_back({.slot = {.set = 0, .binding = spec.binding},
                                    .offset = out.before,
                                    .range = out.dataBytes() + kGuardBytes});
  setup.outputs.push_back(std::move(out));
}

// Buffers move while the lists grow, so the dispatch learns their addresses last.
void bindAddresses(Setup& setup) {
  std::size_t slot = 0;
  for (const Input& in : setup.inputs) setup.dispatch.buffers[slot++].buffer = &in.buffer;
  for (const Output& o : setup.outputs) setup.dispatch.buffers[slot++].buffer = &o.buffer;
}

Setup prepare(const Subject& subject, const Stimulus& stimulus) {
  Setup setup;
  const KernelRecord& record = subject.record();
  for (const InputBytes& in : stimulus.inputs)
    addInput(setup, subject.gpu(), record.buffer(in.buffer), in.bytes);
  for (const OutputCount& out : stimulus.outputs)
    addOutput(setup, subject.gpu(), record.buffer(out.buffer), out.elements);
  bindAddresses(setup);
  setup.dispatch.push.assign(stimulus.push.begin(), stimulus.push.end());
  setup.dispatch.groups = record.grid(stimulus.items);
  return setup;
}

using Bytes = std::vector<std::byte>;

void uploadInputs(Gpu& gpu, const Setup& setup) {
  for (const Input& in : setup.inputs) {
    gpu.fill(in.buffer, kPoison[0]);
    gpu.upload(in.buffer, 0, in.bytes);
  }
}

/// One run: whole buffers, guards included, in the order of setup.outputs.
std::vector<Bytes> runOnce(const Subject& subject, Setup& setup, const GpuProgram& program,
                           std::uint32_t poison, std::chrono::milliseconds limit) {
  Gpu& gpu = subject.gpu();
  for (const Output& o : setup.outputs) gpu.fill(o.buffer, poison);
  setup.dispatch.program = &program;
  gpu.run({&setup.dispatch, 1}, limit);
  std::vector<Bytes> all;
  for (const Output& o : setup.outputs) {
    all.emplace_back(o.buffer.size());
    gpu.download(o.buffer, 0, all.back());
  }
  return all;
}

std::string where(const BufferSpec& spec, std::size_t byteInData) {
  const unsigned stride = spec.element.size;
  const std::size_t element = byteInData / stride;
  const auto offset = static_cast<unsigned>(byteInData % stride);
  for (const Field& f : spec.element.fields)
    if (offset >= f.offset && offset < f.offset + f.scalars * kWord)
      return fmt::format("{}[{}].{}", spec.name, element, f.name);
  return fmt::format("{}[{}] + {} bytes", spec.name, element, offset);
}

/// An input is nobody's to write, its guard included: the twin would judge what the module left.
void checkInput(std::vector<std::string>& findings, Gpu& gpu, const Input& in, const char* module) {
  Bytes now(in.buffer.size());
  gpu.download(in.buffer, 0, now);
  const auto changed = std::ranges::mismatch(in.bytes, now).in1;
  if (changed != in.bytes.end()) {
    const auto byte = static_cast<std::size_t>(changed - in.bytes.begin());
    findings.push_back(
        fmt::format("the {} wrote into its input, at {}", module, where(*in.spec, byte)));
    return;
  }
  for (std::size_t at = (in.bytes.size() + kWord - 1) / kWord; at < now.size() / kWord; ++at)
    if (wordAt(now, at) != kPoison[0])
      return findings.push_back(
          fmt::format("the {} wrote past the end of its input '{}'", module, in.spec->name));
}

void checkGuards(std::vector<std::string>& findings, const Output& out,
                 std::span<const std::byte> bytes, std::uint32_t poison, const char* module) {
  const std::size_t end = out.before + out.dataBytes();
  for (std::size_t at = 0; at + kWord <= bytes.size(); at += kWord) {
    if (at == out.before) at = end;
    if (wordAt(bytes.subspan(at), 0) == poison) continue;
    const auto distance = static_cast<std::ptrdiff_t>(at) - static_cast<std::ptrdiff_t>(end);
    findings.push_back(
        distance >= 0
            ? fmt::format("the {} wrote past the end of '{}': byte {} after its {} elements",
                          module, out.spec->name, distance, out.elements)
            : fmt::format("the {} wrote before the start of '{}': byte {} ahead of it", module,
                          out.spec->name, out.before - at));
    return;
  }
}

/// Words that keep their poison in both runs, and words that differ for another reason.
void checkWords(std::vector<std::string>& findings, const Output& out,
                std::span<const std::byte> first, std::span<const std::byte> second,
                bool deterministic, const char* module) {
  std::size_t unwritten = 0, differing = 0, firstUnwritten = 0, firstDiffering = 0;
  if (std::memcmp(first.data(), second.data(), first.size()) == 0) return;
  for (std::size_t i = 0; i < first.size() / kWord; ++i) {
    const std::uint32_t a = wordAt(first, i), b = wordAt(second, i);
    if (a == b) continue;
    const bool poisoned = a == kPoison[0] && b == kPoison[1];
    std::size_t& count = poisoned ? unwritten : differing;
    if (count++ == 0) (poisoned ? firstUnwritten : firstDiffering) = i * kWord;
  }
  if (unwritten > 0)
    findings.push_back(fmt::format("the {} left {} of {} words of '{}' unwritten, first {}", module,
                                   unwritten, first.size() / kWord, out.spec->name,
                                   where(*out.spec, firstUnwritten)));
  if (differing > 0 && deterministic)
    findings.push_back(
        fmt::format("two runs of the {} on the same input differ in {} words of '{}', first {}: it "
                    "reads memory "
                    "that nobody wrote, or its threads race",
                    module, differing, out.spec->name, where(*out.spec, firstDiffering)));
}

Bytes elementsIn(const Output& out, const Bytes& whole) {
  const auto begin = whole.begin() + static_cast<std::ptrdiff_t>(out.before);
  return {begin, begin + static_cast<std::ptrdiff_t>(out.dataBytes())};
}

/// Both runs of one module; returns the elements of the first.
std::map<std::string, Bytes> observeModule(const Subject& subject, Setup& setup,
                                           const GpuProgram& program, const Stimulus& stimulus,
                                           const char* module, std::vector<std::string>& findings) {
  std::vector<Bytes> runs[2];
  uploadInputs(subject.gpu(), setup);
  for (int i : {0, 1}) runs[i] = runOnce(subject, setup, program, kPoison[i], stimulus.limit);
  for (const Input& in : setup.inputs) checkInput(findings, subject.gpu(), in, module);
  std::map<std::string, Bytes> data;
  for (std::size_t o = 0; o < setup.outputs.size(); ++o) {
    const Output& out = setup.outputs[o];
    for (int i : {0, 1}) checkGuards(findings, out, runs[i][o], kPoison[i], module);
    const auto elements = [&](int i) {
      return std::span<const std::byte>(runs[i][o]).subspan(out.before, out.dataBytes());
    };
    checkWords(findings, out, elements(0), elements(1), subject.record().deterministic, module);
    data[out.spec->name] = elementsIn(out, runs[0][o]);
  }
  return data;
}

}  // namespace

Observation observe(const Subject& subject, const Stimulus& stimulus) {
  Observation seen;
  Setup setup = prepare(subject, stimulus);
  seen.plain = observeModule(subject, setup, subject.plain(), stimulus, "kernel", seen.findings);
  seen.twin = observeModule(subject, setup, subject.twin(), stimulus, "strict twin", seen.findings);
  for (const std::string& message : subject.gpu().takeMessages())
    seen.findings.push_back("validation layer: " + message);
  return seen;
}

std::map<std::string, Bytes> runTwinOnce(const Subject& subject, const Stimulus& stimulus) {
  Setup setup = prepare(subject, stimulus);
  uploadInputs(subject.gpu(), setup);
  const std::vector<Bytes> whole =
      runOnce(subject, setup, subject.twin(), kPoison[0], stimulus.limit);
  std::map<std::string, Bytes> data;
  for (std::size_t o = 0; o < whole.size(); ++o)
    data[setup.outputs[o].spec->name] = elementsIn(setup.outputs[o], whole[o]);
  return data;
}

}  // namespace gnomon
