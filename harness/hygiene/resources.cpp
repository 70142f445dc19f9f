#include "harness/hygiene/resources.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace {

// Wide enough for a whole group of 1,024 threads to overrun by one 64-byte element each.
constexpr std::size_t kGuardBytes = 64 * 1024;

constexpr std::size_t kWord = sizeof(std::uint32_t);

// A NaN, so that reading past the end of an input poisons a result.
constexpr std::uint32_t kGuardPattern = 0xffffdeadu;

}  // namespace

Resources::Resources(const Subject& subject, const Stimulus& s, Target target)
    : gpu(subject.gpu()),
      record(subject.record()),
      interface(subject.interface()),
      conventions(subject.conventions()),
      stimulus(s),
      origin(subject.origin()),
      memories(interface.buffers.size()),
      ownSampler(gpu.makeSampler({.linear = true})) {
  for (const ImageSpec& i : record.images)
    if (i.kind() == BindingSlot::Kind::kSampler || i.kind() == BindingSlot::Kind::kCombined)
      samplers.emplace(i.name, gpu.makeSampler(i.sampler));
  layOut();
  packInputs();
  packParameters();
  allocate();
  markSharedWords();
  for (const InputImage& i : s.inputImages) addInputImage(i);
  for (const OutputImage& o : s.outputImages) addOutputImage(o, target);
  bind();
  bindImages();
  const Grid grid = record.grid ? record.grid : coveringGrid(interface.covered);
  dispatch.groups = grid(s.extent);
}

/// How many elements each of the module's buffers holds, and what the contract's outputs are.
void Resources::layOut() {
  for (std::size_t i = 0; i < memories.size(); ++i) memories[i].spec = &interface.buffers[i];
  const auto hold = [&](const std::string& name, std::size_t elements) {
    for (const auto& place : interface.placesOf(name))
      if (place) {
        const ModuleBuffer& buffer = interface.buffers[place->buffer];
        if (elements > 1 && (buffer.stride == 0 || place->offset < buffer.bytes))
          throw UsageError(fmt::format("{}: '{}' keeps one {}.{}, of which this case has {}",
                                       origin, buffer.name, name, place->field.name, elements));
        std::size_t& held = memories[place->buffer].elements;
        held = std::max(held, elements);
      }
  };
  for (const InputBytes& i : stimulus.inputs) {
    hold(i.buffer, i.bytes.size() / record.buffer(i.buffer).element.size);
    traffic += i.bytes.size();
  }
  for (const OutputCount& o : stimulus.outputs) {
    hold(o.buffer, o.elements);
    Output output{.name = o.buffer,
                  .layout = record.buffer(o.buffer).element,
                  .elements = o.elements,
                  .given = {},
                  .list = o.list};
    output.given.assign(output.layout.size / kWord, false);
    for (const auto& place : interface.placesOf(o.buffer))
      for (unsigned s = 0; place && s < place->field.scalars; ++s)
        output.given[place->field.offset / kWord + s] = true;
    traffic += output.dataBytes();
    out.push_back(std::move(output));
  }
  layOutScratch();
  for (Memory& m : memories) m.size = m.spec->bytes + m.elements * m.spec->stride;
}

void Resources::layOutScratch() {
  for (const auto& [name, index] : interface.scratch) memories[index].scratch = true;
  for (const OutputCount& s : stimulus.scratch) {
    if (record.buffer(s.buffer).access != Access::kScratch)
      throw std::logic_error(fmt::format("'{}' is no scratch of {}", s.buffer, record.name()));
    if (const auto found = interface.scratch.find(s.buffer); found != interface.scratch.end())
      memories[found->second].elements = s.elements;
  }
}

void Resources::packInputs() {
  for (const InputBytes& i : stimulus.inputs) {
    const unsigned size = record.buffer(i.buffer).element.size;
    for (const auto& place : interface.placesOf(i.buffer)) {
      if (!place) continue;
      Memory& m = memories[place->buffer];
      m.content.resize(m.size);
      for (std::size_t e = 0; e < i.bytes.size() / size; ++e)
        pack(*place, i.bytes.subspan(e * size, size),
             std::span(m.content).subspan(e * m.spec->stride), conventions);
    }
  }
}

/// Push constants and whatever else the module takes once.
void Resources::packParameters() {
  dispatch.push.resize(interface.pushBytes);
  const auto target = [&](unsigned buffer) {
    if (buffer == Place::kPush) return std::span(dispatch.push);
    memories[buffer].content.resize(memories[buffer].size);
    return std::span(memories[buffer].content);
  };
  for (const Place& place : interface.push)
    pack(place, stimulus.push, target(place.buffer), conventions);
  for (const Preset& preset : interface.presets)
    std::memcpy(target(preset.buffer).data() + preset.offset, &preset.bits, kWord);
}

void Resources::allocate() {
  const std::size_t align = std::max<std::size_t>(gpu.offsetAlignment(), kWord);
  for (Memory& m : memories) {
    const bool uniform = m.spec->slot.kind == BindingSlot::Kind::kUniformBuffer;
    if (m.spec->bytes > 0 || m.scratch) m.content.resize(m.size);  // a header starts as 0
    m.before = m.spec->written ? (kGuardBytes + align - 1) / align * align : 0;
    m.after = uniform ? 0 : kGuardBytes;
    m.buffer = gpu.allocate(m.before + m.size + m.after);
  }
}

/// In a buffer that holds more than outputs, what stands where before a run, and after it.
void Resources::markSharedWords() {
  std::vector<Bytes> given(memories.size()), output(memories.size());
  const auto mark = [&](std::vector<Bytes>& marks, const Place& place, std::size_t elements) {
    if (place.buffer == Place::kPush) return;
    const Memory& m = memories[place.buffer];
    if (!m.spec->written || m.content.empty()) return;
    marks[place.buffer].resize(m.size);
    const Bytes ones(place.field.offset + place.field.scalars * kWord, std::byte{0xff});
    for (std::size_t e = 0; e < elements; ++e)
      pack(place, ones, std::span(marks[place.buffer]).subspan(e * m.spec->stride), {});
  };
  for (const InputBytes& i : stimulus.inputs)
    for (const auto& place : interface.placesOf(i.buffer))
      if (place) mark(given, *place, i.bytes.size() / record.buffer(i.buffer).element.size);
  for (const Place& place : interface.push) mark(given, place, 1);
  for (const OutputCount& o : stimulus.outputs)
    for (const auto& place : interface.placesOf(o.buffer))
      if (place) mark(output, *place, o.elements);
  const auto marked = [](const Bytes& marks, std::size_t at) {
    return at < marks.size() && marks[at] != std::byte{};
  };
  for (std::size_t i = 0; i < memories.size(); ++i)
    for (std::size_t at = 0; at < std::max(given[i].size(), output[i].size()); at += kWord) {
      const bool isGiven = marked(given[i], at), isOutput = marked(output[i], at);
      if (isOutput && !isGiven) memories[i].open.push_back(at);
      if (isGiven && !isOutput) memories[i].kept.push_back(at);
    }
}

// Buffers and images move while the lists grow, so the dispatch learns their addresses last.
void Resources::bind() {
  for (const Memory& m : memories)
    dispatch.buffers.push_back(
        {.slot = m.spec->slot, .buffer = &m.buffer, .offset = m.before, .range = m.size + m.after});
}

void Resources::upload() {
  for (const Memory& m : memories) {
    if (m.spec->written && !m.scratch) continue;
    gpu.fill(m.buffer, kGuardPattern);
    gpu.upload(m.buffer, m.before, m.content);
  }
}

void Resources::poisonOutputs(std::uint32_t poison) {
  for (const Memory& m : memories) {
    if (!m.spec->written) continue;
    gpu.fill(m.buffer, poison);
    // A header, or inputs that share the buffer, stand there before the run.
    if (m.content.empty()) continue;
    Bytes start = m.content;
    for (const std::size_t at : m.open) std::memcpy(start.data() + at, &poison, kWord);
    gpu.upload(m.buffer, m.before, start);
  }
  poisonImages(poison);
}

Aftermath Resources::run(const GpuProgram& program, std::uint32_t poison) {
  poisonOutputs(poison);
  time(program);
  Aftermath after;
  std::vector<Bytes> contents(memories.size());
  for (std::size_t i = 0; i < memories.size(); ++i) {
    if (!memories[i].spec->written) continue;
    contents[i].resize(memories[i].buffer.size());
    gpu.download(memories[i].buffer, 0, contents[i]);
    checkGuards(memories[i], contents[i], poison, after.strays);
    checkKept(memories[i], contents[i], after.strays);
    checkScratch(memories[i], contents[i], after.strays);
  }
  for (const Output& o : out)
    after.outputs.push_back(o.isImage() ? cropped(o, downloadImage(o), poison, after.strays)
                                        : unpacked(o, contents));
  return after;
}

double Resources::time(const GpuProgram& program, std::span<const Dispatch> before) {
  dispatch.program = &program;
  std::vector<Dispatch> list(before.begin(), before.end());
  list.push_back(dispatch);
  return gpu.run(list, stimulus.limit).back() * 1e-9;
}

void Resources::checkGuards(const Memory& m, const Bytes& whole, std::uint32_t poison,
                            std::vector<std::string>& strays) const {
  const auto wordAt = [&](std::size_t byte) {
    std::uint32_t word = 0;
    std::memcpy(&word, whole.data() + byte, kWord);
    return word;
  };
  for (std::size_t at = 0; at < m.before; at += kWord)
    if (wordAt(at) != poison)
      return strays.push_back(fmt::format("wrote before the start of '{}': byte {} ahead of it",
                                          m.spec->name, m.before - at));
  const std::size_t end = m.before + m.size;
  for (std::size_t at = end; at + kWord <= whole.size(); at += kWord)
    if (wordAt(at) != poison)
      return strays.push_back(
          fmt::format("wrote past the end of '{}': byte {} after its {} elements", m.spec->name,
                      at - end, m.elements));
}

void Resources::checkKept(const Memory& m, const Bytes& whole,
                          std::vector<std::string>& strays) const {
  for (const std::size_t at : m.kept)
    if (std::memcmp(whole.data() + m.before + at, m.content.data() + at, kWord) != 0)
      return strays.push_back("wrote into its input, at " + wordPlace(m, at));
}

void Resources::checkScratch(const Memory& m, const Bytes& whole,
                             std::vector<std::string>& strays) const {
  if (!m.scratch) return;
  for (std::size_t at = 0; at + kWord <= m.size; at += kWord) {
    std::uint32_t word = 0;
    std::memcpy(&word, whole.data() + m.before + at, kWord);
    if (word != 0)
      return strays.push_back(fmt::format(
          "left '{}' other than zero, first at {}: {}; the next dispatch starts from it",
          m.spec->name, wordPlace(m, at), word));
  }
}

std::string Resources::wordPlace(const Memory& m, std::size_t byte) const {
  if (m.spec->stride == 0 || byte < m.spec->bytes)
    return fmt::format("byte {} of '{}'", byte, m.spec->name);
  const std::size_t element = (byte - m.spec->bytes) / m.spec->stride;
  const std::size_t start = element * m.spec->stride;
  for (const auto& [buffer, places] : interface.places)
    for (const auto& place : places)
      if (place && &interface.buffers[place->buffer] == m.spec && byte >= start + place->offset &&
          byte < start + place->offset + place->field.scalars * kWord)
        return fmt::format("{}[{}].{}", buffer, element, place->field.name);
  return fmt::format("{}[{}]", m.spec->name, element);
}

std::vector<std::string> Resources::changedInputs() const {
  std::vector<std::string> found;
  for (const Memory& m : memories) {
    if (m.spec->written) continue;
    Bytes now(m.buffer.size());
    gpu.download(m.buffer, 0, now);
    const auto changed = std::ranges::mismatch(m.content, now).in1;
    if (changed != m.content.end()) {
      const auto byte = static_cast<std::size_t>(changed - m.content.begin());
      found.push_back("wrote into its input, at " + wordPlace(m, byte));
      continue;
    }
    for (std::size_t at = (m.content.size() + kWord - 1) / kWord * kWord; at + kWord <= now.size();
         at += kWord)
      if (std::memcmp(now.data() + at, &kGuardPattern, kWord) != 0) {
        found.push_back(fmt::format("wrote past the end of its input '{}'", m.spec->name));
        break;
      }
  }
  return found;
}

Bytes Resources::unpacked(const Output& output, const std::vector<Bytes>& contents) const {
  Bytes elements(output.dataBytes());
  const unsigned size = output.layout.size;
  for (const auto& place : interface.placesOf(output.name)) {
    if (!place) continue;
    const Memory& m = memories[place->buffer];
    const auto content = std::span(contents[place->buffer]).subspan(m.before);
    for (std::size_t e = 0; e < output.elements; ++e)
      unpack(*place, content.subspan(e * m.spec->stride),
             std::span(elements).subspan(e * size, size), conventions);
  }
  return elements;
}

}  // namespace gnomon
