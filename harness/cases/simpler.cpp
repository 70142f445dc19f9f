#include "harness/cases/simpler.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <rapidcheck/shrink/Shrink.h>

#include "harness/cases/random.h"

namespace gnomon {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

// ---- one number -----------------------------------------------------------------------------

/// x = +-digits * 10^exponent, as few digits as read back as x.
struct Decimal {
  std::uint32_t mantissa = 0;
  int digits = 0, exponent = 0;  // of the first digit

  explicit Decimal(float x) {
    std::string text = fmt::format("{:.8e}", std::abs(x));
    for (digits = 1; digits < 9; ++digits) {
      text = fmt::format("{:.{}e}", std::abs(x), digits - 1);
      if (std::strtof(text.c_str(), nullptr) == std::abs(x)) break;
    }
    if (digits == 9) text = fmt::format("{:.8e}", std::abs(x));
    const std::size_t e = text.find('e');
    exponent = std::stoi(text.substr(e + 1));
    std::string all = text.substr(0, e);
    std::erase(all, '.');
    mantissa = static_cast<std::uint32_t>(std::stoul(all));
  }
};

float composed(std::uint32_t mantissa, int digits, int exponent) {
  return std::strtof(fmt::format("{}e{}", mantissa, exponent - digits + 1).c_str(), nullptr);
}

float rounded(float x, int digits) {
  return std::strtof(fmt::format("{:.{}e}", x, digits - 1).c_str(), nullptr);
}

// Weights of an order: digits before the exponent before the leading digits. 30 bits hold nine
// digits, 6 bits the exponent of any float.
constexpr std::uint64_t kPerDigit = std::uint64_t{1} << 38, kPerExponent = std::uint64_t{1} << 32,
                        kNegative = std::uint64_t{1} << 31;
constexpr std::uint64_t kPerRank = 16 * kPerDigit;

std::uint64_t cost(float x) {
  if (std::isnan(x)) return 11 * kPerDigit;
  if (std::isinf(x)) return 10 * kPerDigit + (x < 0 ? kNegative : 0);
  if (x == 0) return std::signbit(x) ? 3 : 0;
  if (x == 1) return 1;
  if (x == 0.5f) return 2;
  if (x == -1) return 4;
  const Decimal d(x);
  return 8 + static_cast<std::uint64_t>(d.digits) * kPerDigit +
         static_cast<std::uint64_t>(std::abs(d.exponent)) * kPerExponent + (x < 0 ? kNegative : 0) +
         d.mantissa;
}

template <class T>
std::vector<T> all(rc::Seq<T> sequence) {
  std::vector<T> values;
  while (const auto next = sequence.next()) values.push_back(*next);
  return values;
}

bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

// ---- directions -----------------------------------------------------------------------------

int zeros(const vec3& v) { return (v.x == 0) + (v.y == 0) + (v.z == 0); }

/// Exact in few decimals: 3 4 5, 7 24 25, and 9 12 20 of 25.
constexpr std::array<std::array<float, 3>, 3> kExact = {
    {{0, 0.6f, 0.8f}, {0, 0.28f, 0.96f}, {0.36f, 0.48f, 0.8f}}};

bool isExact(const vec3& v) {
  std::array<float, 3> sorted = {std::abs(v.x), std::abs(v.y), std::abs(v.z)};
  std::ranges::sort(sorted);
  return std::ranges::find(kExact, sorted) != kExact.end();
}

std::uint64_t negatives(const vec3& v) {
  return (v.x < 0 ? 1u : 0u) + (v.y < 0 ? 1u : 0u) + (v.z < 0 ? 1u : 0u);
}

std::uint64_t directionCost(const vec3& v) {
  if (zeros(v) == 2) {
    const std::uint64_t axis = v.z != 0 ? 0 : v.x != 0 ? 1 : 2;
    return axis + 3 * negatives(v);
  }
  if (isExact(v))
    return kPerRank + static_cast<std::uint64_t>(3 - zeros(v)) * kPerDigit + negatives(v);
  std::uint64_t fewest = std::numeric_limits<std::uint64_t>::max(), nonZero = 0;
  for (int c = 0; c < 3; ++c)
    if (v[c] != 0) {
      fewest = std::min(fewest, cost(v[c]) & ~kNegative);
      ++nonZero;
    }
  return nonZero * kPerRank + fewest + negatives(v);
}

void addSigned(std::vector<vec3>& found, const vec3& v) {
  for (int signs = 0; signs < 8; ++signs) {
    vec3 s = v;
    bool doubled = false;
    for (int c = 0; c < 3; ++c)
      if ((signs >> c & 1) != 0) {
        doubled |= s[c] == 0;
        s[c] = -s[c];
      }
    if (!doubled) found.push_back(s);
  }
}

/// In the plane of axes a and b, the component along `a` rounded to so many digits.
void addPlanar(std::vector<vec3>& found, const vec3& v, int a, int b, int digits) {
  const float first = digits == 0 ? v[a] : rounded(v[a], digits);
  const double rest = 1 - double{first} * double{first};
  if (rest < 0) return;
  vec3 planar(0);
  planar[a] = first;
  planar[b] = static_cast<float>(std::copysign(std::sqrt(rest), v[b]));
  found.push_back(planar);
}

// ---- the words of an element ----------------------------------------------------------------

std::uint32_t word(std::span<const std::byte> bytes, std::size_t offset) {
  std::uint32_t w = 0;
  std::memcpy(&w, bytes.data() + offset, kWord);
  return w;
}

template <class T>
void put(std::span<std::byte> bytes, std::size_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

vec3 vectorAt(std::span<const std::byte> element, const Field& f) {
  vec3 v;
  std::memcpy(&v, element.data() + f.offset, sizeof v);
  return v;
}

/// Simpler values of a few floats: all of them at once, then one by one.
std::vector<std::vector<float>> simplerVectors(const std::vector<float>& x) {
  std::vector<std::vector<float>> found;
  if (x.size() > 1) {
    for (const float v : {0.0f, 1.0f, 0.5f}) found.emplace_back(x.size(), v);
    for (const float v : x) found.emplace_back(x.size(), v);
    for (const int digits : {1, 2, 3, 5}) {
      found.push_back(x);
      for (float& v : found.back())
        if (std::isfinite(v)) v = rounded(v, digits);
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    for (const float simpler : simplerThan(x[i])) {
      found.push_back(x);
      found.back()[i] = simpler;
    }
  return found;
}

std::vector<float> floatsAt(std::span<const std::byte> bytes, const Field& f) {
  std::vector<float> x(f.scalars);
  std::memcpy(x.data(), bytes.data() + f.offset, f.scalars * kWord);
  return x;
}

/// The element with simpler values in one field.
std::vector<Bytes> simplerElements(std::span<const std::byte> element, const Field& f,
                                   bool direction) {
  std::vector<Bytes> found;
  const auto with = [&](const auto& write) {
    found.emplace_back(element.begin(), element.end());
    write(std::span(found.back()));
  };
  if (direction) {
    for (const vec3& v : simplerDirections(vectorAt(element, f)))
      with([&](std::span<std::byte> e) { put(e, f.offset, v); });
  } else if (f.scalar == ScalarType::kFloat) {
    for (const std::vector<float>& v : simplerVectors(floatsAt(element, f)))
      with([&](std::span<std::byte> e) {
        std::memcpy(e.data() + f.offset, v.data(), v.size() * kWord);
      });
  } else {
    for (std::size_t s = 0; s < f.scalars; ++s)
      for (const std::uint32_t v : simplerThan(word(element, f.offset + s * kWord)))
        with([&](std::span<std::byte> e) { put(e, f.offset + s * kWord, v); });
  }
  return found;
}

using Shared = std::shared_ptr<const CaseInput>;
using Candidates = std::vector<Candidate>;

// ---- sizes ----------------------------------------------------------------------------------

/// Smaller than n, but for the last ones by halves.
std::vector<std::size_t> smallerCounts(std::size_t n, std::size_t least) {
  std::vector<std::size_t> counts;
  for (std::size_t k = 1; k < n; k *= 2)
    if (k >= least) counts.push_back(k);
  for (std::size_t off = n / 4; off > 0; off /= 2)
    if (n - off >= least) counts.push_back(n - off);
  std::ranges::sort(counts);
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  return counts;
}

CaseInput withElements(const CaseInput& input, std::size_t b, std::size_t begin, std::size_t n) {
  CaseInput smaller{.push = input.push, .images = input.images, .focus = input.focus};
  for (std::size_t i = 0; i < input.buffers.size(); ++i) {
    const CaseInput::Block& block = input.buffers[i];
    const std::size_t size = block.layout.size;
    smaller.buffers.push_back({block.name, block.layout, {}});
    const std::size_t from = i == b ? begin : 0, count = i == b ? n : block.elements();
    const auto bytes = std::span(block.bytes).subspan(from * size, count * size);
    smaller.buffers.back().bytes.assign(bytes.begin(), bytes.end());
  }
  const bool inside = input.focus.x >= begin && input.focus.x < begin + n;
  smaller.focus.x = inside ? static_cast<uint>(input.focus.x - begin) : 0u;
  return smaller;
}

Candidates fewerElements(const Shared& input, std::size_t b) {
  const std::size_t n = input->buffers[b].elements();
  Candidates found;
  const auto add = [&](std::size_t begin, std::size_t count) {
    found.emplace_back([=] { return withElements(*input, b, begin, count); });
  };
  if (n == 0) return found;
  add(0, 0);
  if (n == 1) return found;
  const std::size_t focus = std::min<std::size_t>(input->focus.x, n - 1);
  add(focus, 1);
  for (const std::size_t k : smallerCounts(n, 1)) {
    add(0, k);
    if (focus >= k) add(std::min(focus - k / 2, n - k), k);
    add(n - k, k);
  }
  return found;
}

Picture cropped(const Picture& p, const uvec2& at, const uvec2& size) {
  Picture small{.size = size, .texels = {}};
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x)
      small.texels.push_back(p.at(std::size_t{at.y + y} * p.size.x + at.x + x));
  return small;
}

/// The window of that size which holds the point, as far to the left and top as there is room.
uvec2 cornerFor(const uvec2& point, const uvec2& size, const uvec2& whole) {
  return glm::min(point - glm::min(point, size / 2u), whole - size);
}

uvec2 extentOf(const CaseInput& input) {
  for (const CaseInput::Image& i : input.images)
    if (i.ofExtent) return i.picture.size;
  return {0, 0};
}

/// Around the focus, or where that says nothing, the part that ends at the end.
CaseInput withExtent(const CaseInput& input, const uvec2& size, bool around = true) {
  CaseInput smaller = input;
  const uvec2 whole = extentOf(input), focus = glm::min(input.focus, whole - 1u);
  const uvec2 at = around ? cornerFor(focus, size, whole) : whole - size;
  for (CaseInput::Image& i : smaller.images)
    if (i.ofExtent) i.picture = cropped(i.picture, at, size);
  smaller.focus = focus - glm::min(focus, at);
  return smaller;
}

/// Of the others, the texel next to the focus.
CaseInput withoutSurroundings(const CaseInput& input) {
  const uvec2 whole = glm::max(extentOf(input), uvec2(1)),
              focus = glm::min(input.focus, whole - 1u);
  CaseInput smaller = input;
  for (CaseInput::Image& i : smaller.images)
    if (!i.ofExtent) i.picture = cropped(i.picture, focus * i.picture.size / whole, {1, 1});
  return smaller;
}

std::vector<uvec2> smallerSizes(const uvec2& size) {
  std::vector<uvec2> sizes;
  if (size != uvec2(1)) sizes.emplace_back(1, 1);
  for (const std::size_t w : smallerCounts(size.x, 1)) sizes.emplace_back(w, size.y);
  for (const std::size_t h : smallerCounts(size.y, 1)) sizes.emplace_back(size.x, h);
  return sizes;
}

Candidates smallerImages(const Shared& input) {
  Candidates found;
  const uvec2 extent = extentOf(*input);
  if (extent != uvec2(0)) {
    const std::vector<uvec2> sizes = smallerSizes(extent);
    for (const uvec2& size : sizes)
      found.emplace_back([=] { return withoutSurroundings(withExtent(*input, size)); });
    for (const bool around : {true, false})
      for (const uvec2& size : sizes)
        found.emplace_back([=] { return withExtent(*input, size, around); });
  }
  found.emplace_back([=] { return withoutSurroundings(*input); });
  for (std::size_t i = 0; i < input->images.size(); ++i) {
    if (input->images[i].ofExtent) continue;
    const uvec2 whole = input->images[i].picture.size;
    for (const uvec2& size : smallerSizes(whole))
      for (const uvec2& corner : {uvec2(0), (whole - size) / 2u, whole - size})
        found.emplace_back([=] {
          CaseInput smaller = *input;
          smaller.images[i].picture = cropped(input->images[i].picture, corner, size);
          return smaller;
        });
  }
  return found;
}

// ---- places ---------------------------------------------------------------------------------

/// With another value in one place of a copy.
template <class Values, class Write>
Candidates withEach(const Shared& input, const Values& values, const Write& write) {
  Candidates found;
  for (const auto& v : values)
    found.emplace_back([=] {
      CaseInput simpler = *input;
      write(simpler, v);
      return simpler;
    });
  return found;
}

// Of so many, each is made simple by itself; of more, all together.
constexpr std::size_t kFewElements = 4, kFewTexels = 16;

Site fieldOfPush(const Field& f) {
  return {f.name, [f](const Shared& input) {
            return withEach(input, simplerElements(input->push->bytes, f, false),
                            [](CaseInput& i, const Bytes& bytes) { i.push->bytes = bytes; });
          }};
}

void putElement(CaseInput& input, std::size_t b, std::size_t e, const Bytes& bytes) {
  std::ranges::copy(bytes, input.buffers[b].element(e).begin());
}

Site fieldOfElement(std::size_t b, std::size_t e, const CaseInput::Block& block, const Field& f,
                    bool direction) {
  return {
      fmt::format("{}[{}].{}", block.name, e, f.name), [b, e, f, direction](const Shared& input) {
        return withEach(input, simplerElements(input->buffers[b].element(e), f, direction),
                        [b, e](CaseInput& i, const Bytes& bytes) { putElement(i, b, e, bytes); });
      }};
}

/// Turned so that one direction is the z axis and another lies in the plane of x and z: angles
/// between them stay.
Bytes turned(std::span<const std::byte> element, const std::vector<Field>& directions,
             std::size_t up, std::size_t side) {
  Bytes found(element.begin(), element.end());
  const glm::dvec3 z = glm::normalize(glm::dvec3(vectorAt(element, directions[up])));
  const glm::dvec3 s = glm::dvec3(vectorAt(element, directions[side]));
  glm::dvec3 x = s - glm::dot(s, z) * z, y;
  if (glm::length(x) > 1e-6)  // else parallel to z: any frame will do
    y = glm::cross(z, x = glm::normalize(x));
  else
    frameAround(z, x, y);
  for (std::size_t d = 0; d < directions.size(); ++d) {
    const glm::dvec3 v = glm::normalize(glm::dvec3(vectorAt(element, directions[d])));
    vec3 w(glm::dot(v, x), glm::dot(v, y), glm::dot(v, z));
    if (d == up) w = {0, 0, 1};
    if (d == side) w.y = 0;
    put(std::span(found), directions[d].offset, w);
  }
  return found;
}

Site frameOf(std::size_t b, std::size_t e, const std::vector<Field>& directions) {
  return {"directions", [b, e, directions](const Shared& input) {
            std::vector<Bytes> elements;
            for (std::size_t up = 0; up < directions.size(); ++up)
              for (std::size_t side = 0; side < directions.size(); ++side)
                if (side != up || directions.size() == 1)
                  elements.push_back(turned(input->buffers[b].element(e), directions, up, side));
            return withEach(input, elements, [b, e](CaseInput& i, const Bytes& bytes) {
              putElement(i, b, e, bytes);
            });
          }};
}

Candidates uniformElements(const Shared& input, std::size_t b) {
  const CaseInput::Block& block = input->buffers[b];
  const auto focus = block.element(std::min<std::size_t>(input->focus.x, block.elements() - 1));
  const std::vector<Bytes> elements = {Bytes(block.layout.size), {focus.begin(), focus.end()}};
  return withEach(input, elements, [b](CaseInput& i, const Bytes& bytes) {
    for (std::size_t e = 0; e < i.buffers[b].elements(); ++e) putElement(i, b, e, bytes);
  });
}

Candidates uniformImage(const Shared& input, std::size_t i) {
  const Picture& p = input->images[i].picture;
  const uvec2 at = glm::min(input->focus, p.size - 1u);
  const std::vector<vec4> texels = {vec4(0), vec4(1), vec4(0.5f),
                                    p.at(std::size_t{at.y} * p.size.x + at.x)};
  return withEach(input, texels, [i](CaseInput& in, const vec4& texel) {
    std::ranges::fill(in.images[i].picture.texels, texel);
  });
}

Candidates simplerTexels(const Shared& input, std::size_t i, std::size_t t) {
  const vec4& texel = input->images[i].picture.at(t);
  return withEach(input, simplerVectors({texel.x, texel.y, texel.z, texel.w}),
                  [i, t](CaseInput& in, const std::vector<float>& v) {
                    in.images[i].picture.texels[t] = {v[0], v[1], v[2], v[3]};
                  });
}

}  // namespace

std::vector<float> simplerThan(float x) {
  std::vector<float> wanted = {0.0f, 1.0f, 0.5f, -1.0f};
  if (x >= 0) wanted.pop_back();
  if (std::isfinite(x) && x != 0) {
    wanted.push_back(-x);
    for (const int digits : {1, 2, 3, 4, 6, 8}) wanted.push_back(rounded(x, digits));
    const Decimal d(x);
    const float sign = x < 0 ? -1.0f : 1.0f;
    for (const int e : all(rc::shrink::towards<int>(d.exponent, 0)))
      wanted.push_back(sign * composed(d.mantissa, d.digits, e));
    if (d.digits <= 2)
      for (const std::uint32_t m :
           all(rc::shrink::towards<std::uint32_t>(d.mantissa, d.digits == 1 ? 1 : 10)))
        wanted.push_back(sign * composed(m, d.digits, d.exponent));
  }
  std::vector<float> found;
  for (const float w : wanted) {
    const bool known = std::ranges::any_of(found, [&](float f) { return sameBits(f, w); });
    if (!known && cost(w) < cost(x)) found.push_back(w);
  }
  return found;
}

std::vector<std::uint32_t> simplerThan(std::uint32_t x) {
  return all(rc::shrink::towards<std::uint32_t>(x, 0));
}

bool isUnit(const vec3& v) {
  // Each component is rounded by at most 2^-24 relatively, so the square of the length by 2^-23; a
  // normalisation in float may leave four such roundings.
  constexpr double kRoundings = 0x1p-21;
  return std::abs(glm::dot(glm::dvec3(v), glm::dvec3(v)) - 1) <= kRoundings;
}

std::vector<vec3> simplerDirections(const vec3& unit) {
  std::vector<vec3> wanted;
  for (const vec3& axis : {vec3(0, 0, 1), vec3(1, 0, 0), vec3(0, 1, 0)}) addSigned(wanted, axis);
  for (std::array<float, 3> e : kExact) {
    do addSigned(wanted, {e[0], e[1], e[2]});
    while (std::ranges::next_permutation(e).found);
  }
  const double across = std::hypot(double{unit.x}, double{unit.y});
  for (const int digits : {1, 2, 3, 0})
    for (const vec3& v :
         {unit, vec3(across, 0, unit.z), vec3(0, across, unit.z), vec3(-across, 0, unit.z)})
      for (const auto& [a, b] : {std::array{2, 0}, std::array{0, 2}, std::array{2, 1},
                                 std::array{1, 2}, std::array{0, 1}, std::array{1, 0}})
        if (v[b] != 0 || v[a] != 0) addPlanar(wanted, v, a, b, digits);
  std::vector<vec3> found;
  for (const vec3& w : wanted)
    if (directionCost(w) < directionCost(unit) && std::ranges::find(found, w) == found.end())
      found.push_back(w);
  std::ranges::stable_sort(found, {}, directionCost);
  return found;
}

Simplifier::Simplifier(const CaseInput& original) {
  // What only happens to be of length one is not so in many elements.
  constexpr std::size_t kLooked = 64;
  for (const CaseInput::Block& b : original.buffers)
    for (const Field& f : b.layout.fields) {
      if (f.type != "vec3" || b.elements() == 0) continue;
      bool unit = true;
      for (std::size_t i = 0; i < std::min(b.elements(), kLooked); ++i)
        unit &= isUnit(vectorAt(b.element(i), f));
      if (unit) directions.insert(b.name + "." + f.name);
    }
}

std::uint64_t Simplifier::digits(const CaseInput::Block& block) const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < block.elements(); ++i)
    for (const Field& f : block.layout.fields) {
      const auto element = block.element(i);
      if (isDirection(block.name, f)) {
        sum += directionCost(vectorAt(element, f));
        continue;
      }
      for (unsigned s = 0; s < f.scalars; ++s) {
        const std::uint32_t w = word(element, f.offset + s * kWord);
        sum += f.scalar == ScalarType::kFloat ? cost(std::bit_cast<float>(w)) : w;
      }
    }
  return sum;
}

Complexity Simplifier::complexity(const CaseInput& input) const {
  // Of more the digits are not worth counting: they become simpler only when all are alike.
  constexpr std::size_t kCounted = 65536;
  Complexity c{.numbers = input.numbers()};
  if (input.push) c.digits += digits(*input.push);
  if (c.numbers > kCounted) return c;
  for (const CaseInput::Block& b : input.buffers) c.digits += digits(b);
  for (const CaseInput::Image& i : input.images)
    for (const vec4& t : i.picture.texels)
      c.digits += cost(t.x) + cost(t.y) + cost(t.z) + cost(t.w);
  return c;
}

std::vector<Site> Simplifier::sites(const CaseInput& input) const {
  std::vector<Site> found;
  for (std::size_t b = 0; b < input.buffers.size(); ++b)
    found.push_back({"size", [b](const Shared& i) { return fewerElements(i, b); }});
  if (!input.images.empty()) found.push_back({"size", smallerImages});
  for (std::size_t b = 0; b < input.buffers.size(); ++b) {
    const CaseInput::Block& block = input.buffers[b];
    if (block.elements() > 1)
      found.push_back({"alike", [b](const Shared& i) { return uniformElements(i, b); }});
    std::vector<Field> together;
    std::ranges::copy_if(block.layout.fields, std::back_inserter(together),
                         [&](const Field& f) { return isDirection(block.name, f); });
    if (block.elements() > kFewElements) continue;
    for (std::size_t e = 0; e < block.elements(); ++e) {
      if (!together.empty()) found.push_back(frameOf(b, e, together));
      for (const Field& f : block.layout.fields)
        found.push_back(fieldOfElement(b, e, block, f, isDirection(block.name, f)));
    }
  }
  if (input.push)
    for (const Field& f : input.push->layout.fields) found.push_back(fieldOfPush(f));
  for (std::size_t i = 0; i < input.images.size(); ++i) {
    const std::size_t texels = input.images[i].picture.pixels();
    if (texels > 1)
      found.push_back({"alike", [i](const Shared& in) { return uniformImage(in, i); }});
    if (texels <= kFewTexels)
      for (std::size_t t = 0; t < texels; ++t)
        found.push_back({fmt::format("{}[{}]", input.images[i].name, t),
                         [i, t](const Shared& in) { return simplerTexels(in, i, t); }});
  }
  return found;
}

}  // namespace gnomon
