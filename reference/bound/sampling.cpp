#include "reference/bound/sampling.h"

#include <cassert>

namespace gnomon {
namespace {

struct Ends {
  double lo, hi;
};

constexpr Ends kNothing{kInfinity, -kInfinity};

Ends hull(const Ends& a, const Ends& b) { return {least(a.lo, b.lo), most(a.hi, b.hi)}; }

// What a filter can return, and the texels that it looks at.
struct Filtered {
  Ends result = kNothing, texels = kNothing;

  void add(const Filtered& other) {
    result = hull(result, other.result);
    texels = hull(texels, other.texels);
  }
};

// Where a function that is linear between integers can have its extremes over an interval.
std::vector<double> vertices(const Ends& over) {
  std::vector<double> all{over.lo};
  for (double at = std::floor(over.lo) + 1; at < over.hi; ++at) all.push_back(at);
  if (over.hi > over.lo) all.push_back(over.hi);
  return all;
}

// The specification's linear filter at one place. `texel(i, j)` takes any index.
template <class Texel>
Filtered bilinear(const Texel& texel, double x, double y) {
  const double i = std::floor(x), j = std::floor(y), a = x - i, b = y - j;
  Filtered all{.result = {0, 0}};
  for (const int row : {0, 1})
    for (const int column : {0, 1}) {
      const Ends t =
          texel(static_cast<std::int64_t>(i) + column, static_cast<std::int64_t>(j) + row);
      all.texels = hull(all.texels, t);
      const double weight = (column == 0 ? 1 - a : a) * (row == 0 ? 1 - b : b);
      if (weight == 0) continue;
      all.result.lo += weight * t.lo;
      all.result.hi += weight * t.hi;
    }
  return all;
}

template <class Texel>
Filtered filtered(const Texel& texel, bool linear, const Ends& x, const Ends& y) {
  Filtered all;
  if (linear) {
    for (const double v : vertices(y))
      for (const double u : vertices(x)) all.add(bilinear(texel, u, v));
    return all;
  }
  for (double j = std::floor(y.lo); j <= std::floor(y.hi); ++j)
    for (double i = std::floor(x.lo); i <= std::floor(x.hi); ++i) {
      const Ends t = texel(static_cast<std::int64_t>(i), static_cast<std::int64_t>(j));
      all.add({t, t});
    }
  return all;
}

// Positions along one axis, in texels: integers are their centres for a linear filter, their lower
// edges for the nearest.
Ends positions(const Bounded& u, int size, const Sampling& by) {
  const Ends everything{0, static_cast<double>(size)};
  if (u.mayBeNan()) return everything;
  const Bounded scaled = u * Bounded(size);
  const Bounded at = by.linear ? scaled - Bounded(0.5f) : scaled;
  const double slack = kCoordinateError * size +
                       (by.linear ? std::ldexp(1.0, -static_cast<int>(by.subTexelBits)) : 0);
  Ends over{at.lo - slack, at.hi + slack};
  if (by.address == AddressMode::clamp) {
    over = {std::clamp(over.lo, -1.0, size + 1.0), std::clamp(over.hi, -1.0, size + 1.0)};
  } else if (!(over.hi - over.lo < 2 * size)) {
    return everything;
  }
  return over;
}
Ends positions(double u, int size, const Sampling& by) {
  double at = u * size - (by.linear ? 0.5 : 0.0);
  at = by.address == AddressMode::clamp ? std::clamp(at, -1.0, size + 1.0)
                                        : std::fmod(at, 2.0 * size);
  return {at, at};
}

// A LOD in levels, clamped to those there are.
Ends lods(const Bounded& lod, std::size_t levels, const Sampling& by) {
  const auto last = static_cast<double>(levels - 1);
  if (lod.mayBeNan()) return {0, last};
  const double slack = std::ldexp(1.0, -static_cast<int>(by.mipmapBits));
  return {std::clamp(lod.lo - slack, 0.0, last), std::clamp(lod.hi + slack, 0.0, last)};
}
Ends lods(double lod, std::size_t levels, const Sampling&) {
  const double at = std::clamp(lod, 0.0, static_cast<double>(levels - 1));
  return {at, at};
}

// `texel(level, i, j)`: what texel of the image, whose indices are inside.
template <class T, class Texel>
Filtered acrossLevels(const Texel& texel, const TexelImage& image, const Sampling& by,
                      const Vec2<T>& uv, const T& lod) {
  const auto ofLevel = [&](double which) {
    const auto index = static_cast<std::size_t>(which);
    const TexelLevel& level = image.levels[index];
    const auto inside = [&](std::int64_t i, std::int64_t j) {
      return texel(level, addressed(i, level.width, by.address),
                   addressed(j, level.height, by.address));
    };
    return filtered(inside, by.linear, positions(uv.x, level.width, by),
                    positions(uv.y, level.height, by));
  };
  const Ends over = lods(lod, image.levels.size(), by);
  Filtered all;
  if (!by.linearMips) {
    const double first = std::max(std::ceil(over.lo + 0.5) - 1, 0.0);
    const double last = over.hi > over.lo ? std::floor(over.hi + 0.5) : first;
    for (double level = first; level <= last; ++level) all.add(ofLevel(level));
    return all;
  }
  for (const double at : vertices(over)) {
    const double level = std::floor(at), part = at - level;
    Filtered mixed = ofLevel(level);
    if (part > 0) {
      const Filtered next = ofLevel(level + 1);
      mixed.result = {(1 - part) * mixed.result.lo + part * next.result.lo,
                      (1 - part) * mixed.result.hi + part * next.result.hi};
      mixed.texels = hull(mixed.texels, next.texels);
    }
    all.add(mixed);
  }
  return all;
}

double largestCode(Storage format) {
  return format == Storage::unorm16 ? 65535 : format == Storage::unorm8 ? 255 : 127;
}

bool isNormalised(Storage format) {
  return format == Storage::unorm8 || format == Storage::snorm8 || format == Storage::unorm16;
}

// Linear interpolations in a row: along two axes and between levels.
int interpolations(const TexelImage& image, const Sampling& by) {
  return (by.linear ? 2 : 0) + (by.linearMips && image.levels.size() > 1 ? 1 : 0);
}

// The arithmetic of so many interpolations on top of their weights.
Bounded rounded(double value, const Filtered& f, Storage storage, const Sampling& by, int count) {
  const double magnitude = most(std::abs(f.texels.lo), std::abs(f.texels.hi));
  if (count > 0 && !std::isfinite(magnitude)) {
    Bounded any = Bounded::input(std::numeric_limits<float>::quiet_NaN());
    any.value = value;
    return any;
  }
  Ends ends = f.result;
  if (count > 0) {
    // Each a + t (b - a) has five roundings of at most the largest texel: two in b - a, which
    // reaches twice a texel, two of them again in its product, one last.
    const double room = rules().gamma(5 * count) * magnitude;
    const double steps = isNormalised(storage) ? kCodeError * count / largestCode(storage) : 0;
    // 2^count products of weights, each off by half a step; their errors sum to 0, so what counts
    // of a texel is its distance from the middle of all, at most half of their range.
    const double products = by.linear ? std::ldexp(f.texels.hi - f.texels.lo,
                                                   count - 2 - static_cast<int>(by.subTexelBits))
                                      : 0;
    ends = {std::max(ends.lo - steps - products, f.texels.lo) - room,
            std::min(ends.hi + steps + products, f.texels.hi) + room};
  }
  Bounded result = Bounded::between(ends.lo, ends.hi);
  if (storage == Storage::half && count > 0) result = stored(result, storage);
  result.value = value;
  return result;
}

}  // namespace

Bounded loaded(std::uint32_t code, Storage storage) noexcept {
  const double x = decode(code, storage);
  if (!isNormalised(storage) || x == 0 || std::abs(x) == 1) return {static_cast<float>(x)};
  Bounded result = Bounded::between(x - 2 * ulp(x), x + 2 * ulp(x));
  result.value = x;
  return result;
}

int addressed(std::int64_t index, int size, AddressMode mode) noexcept {
  const auto modulo = [](std::int64_t i, std::int64_t n) { return (i % n + n) % n; };
  if (mode == AddressMode::clamp)
    return static_cast<int>(std::clamp<std::int64_t>(index, 0, size - 1));
  if (mode == AddressMode::repeat) return static_cast<int>(modulo(index, size));
  const std::int64_t n = modulo(index, 2 * std::int64_t{size}) - size;
  return static_cast<int>(size - 1 - (n >= 0 ? n : -(1 + n)));
}

Vec4<Bounded> sampled(const TexelImage& image, const Sampling& by, const Vec2<Bounded>& uv,
                      const Bounded& lod) {
  const Vec4<double> value = sampled(image, by, {uv.x.value, uv.y.value}, lod.value);
  Vec4<Bounded> result;
  for (std::size_t c = 0; c < 4; ++c) {
    const auto texel = [c](const TexelLevel& level, int i, int j) {
      const Bounded& t = level.texels[static_cast<std::size_t>(j * level.width + i)][c];
      // A NaN's ends are infinite.
      return Ends{t.lo, t.hi};
    };
    result[c] = rounded(value[c], acrossLevels(texel, image, by, uv, lod), image.storage, by,
                        interpolations(image, by));
  }
  return result;
}

Vec4<double> sampled(const TexelImage& image, const Sampling& by, const Vec2<double>& uv,
                     double lod) {
  Vec4<double> result;
  for (std::size_t c = 0; c < 4; ++c) {
    const auto texel = [c](const TexelLevel& level, int i, int j) {
      const double t = level.texels[static_cast<std::size_t>(j * level.width + i)][c].value;
      return Ends{t, t};
    };
    result[c] = acrossLevels(texel, image, by, uv, lod).result.lo;
  }
  return result;
}

Bounded compared(const TexelImage& image, const Sampling& by, const Vec2<Bounded>& uv,
                 const Bounded& lod, const Bounded& reference) {
  const auto outcome = [&](const TexelLevel& level, int i, int j) {
    const Bounded& t = level.texels[static_cast<std::size_t>(j * level.width + i)].x;
    const Decision passes = reference >= t;
    return Ends{passes.canBeFalse ? 0.0 : 1.0, passes.canBeTrue ? 1.0 : 0.0};
  };
  const Ends outcomes = acrossLevels(outcome, image, by, uv, lod).texels;
  Bounded result = Bounded::between(outcomes.lo, outcomes.hi);
  result.value = compared(image, by, {uv.x.value, uv.y.value}, lod.value, reference.value);
  return result;
}

double compared(const TexelImage& image, const Sampling& by, const Vec2<double>& uv, double lod,
                double reference) {
  const auto outcome = [&](const TexelLevel& level, int i, int j) {
    const double t = level.texels[static_cast<std::size_t>(j * level.width + i)].x.value;
    return reference >= t ? Ends{1, 1} : Ends{0, 0};
  };
  return acrossLevels(outcome, image, by, uv, lod).result.lo;
}

}  // namespace gnomon
