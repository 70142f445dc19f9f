#include "harness/cases/case_input.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

namespace gnomon {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

bool sameBytes(std::span<const std::byte> a, std::span<const std::byte> b) {
  return std::ranges::equal(a, b);
}

bool same(const CaseInput::Block& a, const CaseInput::Block& b) {
  return a.name == b.name && sameBytes(a.bytes, b.bytes);
}

bool same(const CaseInput::Image& a, const CaseInput::Image& b) {
  return a.name == b.name && a.picture.size == b.picture.size &&
         sameBytes(std::as_bytes(std::span(a.picture.texels)),
                   std::as_bytes(std::span(b.picture.texels)));
}

class Gatherer : public Parts {
 public:
  explicit Gatherer(const KernelRecord& r) : record(r) {}
  CaseInput found{};

  void extent(uvec2&) override {}
  void count(uint&, const std::string&) override {}

 protected:
  void pushBytes(std::span<std::byte> constants) override {
    found.push = {"push", record.push, {constants.begin(), constants.end()}};
  }
  void bufferBytes(const std::string& buffer, std::size_t bytes,
                   const std::function<std::span<std::byte>(std::size_t)>& resized) override {
    const auto content = resized(bytes);
    found.buffers.push_back(
        {buffer, record.buffer(buffer).element, {content.begin(), content.end()}});
  }
  void anyImage(const std::string& name, Picture& picture, bool ofExtent) override {
    found.images.push_back({name, picture, ofExtent});
  }

 private:
  const KernelRecord& record;
};

class Scatterer : public Parts {
 public:
  explicit Scatterer(const CaseInput& i) : input(i) {}
  std::string misfit{};

  void extent(uvec2& size) override {
    for (const CaseInput::Image& i : input.images)
      if (i.ofExtent) size = i.picture.size;
  }
  void count(uint& elements, const std::string& buffer) override {
    const auto found = std::ranges::find(input.buffers, buffer, &CaseInput::Block::name);
    if (found != input.buffers.end()) elements = static_cast<uint>(found->elements());
  }

 protected:
  void pushBytes(std::span<std::byte> constants) override {
    if (!input.push) return note("it has no push constants");
    if (input.push->bytes.size() != constants.size()) return note("its push constants differ");
    std::ranges::copy(input.push->bytes, constants.begin());
  }
  void bufferBytes(const std::string& buffer, std::size_t,
                   const std::function<std::span<std::byte>(std::size_t)>& resized) override {
    const auto found = std::ranges::find(input.buffers, buffer, &CaseInput::Block::name);
    if (found == input.buffers.end()) return note(fmt::format("it has no buffer '{}'", buffer));
    std::ranges::copy(found->bytes, resized(found->bytes.size()).begin());
  }
  void anyImage(const std::string& name, Picture& picture, bool) override {
    const auto found = std::ranges::find(input.images, name, &CaseInput::Image::name);
    if (found == input.images.end()) return note(fmt::format("it has no image '{}'", name));
    picture = found->picture;
  }

 private:
  void note(std::string why) {
    if (misfit.empty()) misfit = std::move(why);
  }
  const CaseInput& input;
};

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, kWord);
  return word;
}

std::string scalarInWords(ScalarType type, std::uint32_t word) {
  if (type == ScalarType::kUint) return fmt::format("{}", word);
  if (type == ScalarType::kInt) return fmt::format("{}", static_cast<std::int32_t>(word));
  return exactly(std::bit_cast<float>(word));
}

std::string fieldInWords(const Field& f, std::span<const std::byte> element) {
  std::string text;
  for (unsigned s = 0; s < f.scalars; ++s)
    text += (s > 0 ? ", " : "") + scalarInWords(f.scalar, wordAt(element, f.offset + s * kWord));
  return f.scalars > 1 ? "(" + text + ")" : text;
}

std::string elementInWords(const Struct& layout, std::span<const std::byte> element) {
  std::string text;
  for (const Field& f : layout.fields)
    text += fmt::format("    {:<14} {}\n", f.name, fieldInWords(f, element));
  return text;
}

// What fits a terminal: of more a person reads the file.
constexpr std::size_t kElementsShown = 4, kTexelsShown = 16;

std::string blockInWords(const CaseInput::Block& block) {
  std::string text;
  const std::size_t n = block.elements();
  for (std::size_t i = 0; i < std::min(n, kElementsShown); ++i) {
    if (n > 1) text += fmt::format("    {}[{}]\n", block.name, i);
    text += elementInWords(block.layout, block.element(i));
  }
  if (n > kElementsShown) text += fmt::format("    ... of {} elements of '{}'\n", n, block.name);
  return text;
}

std::string texelInWords(const vec4& t) {
  return fmt::format("({}, {}, {}, {})", exactly(t.x), exactly(t.y), exactly(t.z), exactly(t.w));
}

std::string imageInWords(const CaseInput::Image& image) {
  const Picture& p = image.picture;
  if (p.pixels() == 1) return fmt::format("    {:<14} {}\n", image.name, texelInWords(p.at(0)));
  std::string text = fmt::format("    {:<14} of {} x {}\n", image.name, p.size.x, p.size.y);
  for (std::size_t i = 0; i < std::min(p.pixels(), kTexelsShown); ++i)
    text += fmt::format("    {:<14} {}\n", fmt::format("  ({}, {})", i % p.size.x, i / p.size.x),
                        texelInWords(p.at(i)));
  if (p.pixels() > kTexelsShown) text += "      ...\n";
  return text;
}

}  // namespace

std::size_t CaseInput::numbers() const {
  std::size_t n = 0;
  for (const Block& b : buffers) n += b.bytes.size() / kWord;
  for (const Image& i : images) n += 4 * i.picture.pixels();
  return n;
}

bool operator==(const CaseInput& a, const CaseInput& b) {
  const auto sameBlock = [](const auto& x, const auto& y) { return same(x, y); };
  return a.push.has_value() == b.push.has_value() && (!a.push || same(*a.push, *b.push)) &&
         std::ranges::equal(a.buffers, b.buffers, sameBlock) &&
         std::ranges::equal(a.images, b.images, sameBlock);
}

CaseInput gather(const KernelRecord& record, const NameParts& named) {
  Gatherer gatherer(record);
  named(gatherer);
  return std::move(gatherer.found);
}

std::optional<std::string> scatter(const CaseInput& input, const NameParts& named) {
  const CaseInput::Image* first = nullptr;
  for (const CaseInput::Image& i : input.images) {
    if (!i.ofExtent) continue;
    if (first != nullptr && first->picture.size != i.picture.size)
      return fmt::format("'{}' and '{}' differ in size", first->name, i.name);
    first = &i;
  }
  Scatterer scatterer(input);
  named(scatterer);
  if (!scatterer.misfit.empty()) return scatterer.misfit;
  return std::nullopt;
}

std::string inWords(const CaseInput& input) {
  std::string text;
  if (input.push) text += elementInWords(input.push->layout, input.push->bytes);
  for (const CaseInput::Block& b : input.buffers) text += blockInWords(b);
  for (const CaseInput::Image& i : input.images) text += imageInWords(i);
  return text;
}

std::string sizeInWords(const CaseInput& input) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const CaseInput::Block& b : input.buffers)
    add(fmt::format("{} element{} of '{}'", b.elements(), b.elements() == 1 ? "" : "s", b.name));
  for (const CaseInput::Image& i : input.images)
    add(fmt::format("'{}' of {} x {}", i.name, i.picture.size.x, i.picture.size.y));
  return text;
}

std::string exactly(float x) {
  if (std::isnan(x)) return fmt::format("NaN {:#010x}", std::bit_cast<std::uint32_t>(x));
  if (std::isinf(x)) return x > 0 ? "Infinity" : "-Infinity";
  if (x == 0 && std::signbit(x)) return "-0.0";
  return fmt::format("{}", x);  // the shortest that reads back as the same float
}

}  // namespace gnomon
