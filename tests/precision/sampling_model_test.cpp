// The device model of sampling (reference/bound/sampling) against truth, without a GPU.
//
// Covered: indices of every address mode; texels at their centres; constants; ramps; levels; the
// interval against a filter written out a second time, with every weight that a device may round
// to; the nearest at and next to a boundary; comparisons; coordinates that are intervals.
// Not covered: what devices do (sampling_test.cpp).
#include <array>
#include <cmath>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "reference/bound/sampling.h"

namespace gnomon::precision {
namespace {

constexpr Sampling kLinear{.linear = true, .linearMips = true};

/// A level of floats: red is f(x, y), the others 0.
template <class F>
TexelLevel levelOf(int width, int height, F f) {
  TexelLevel level{.width = width, .height = height};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      level.texels.push_back({Bounded(static_cast<float>(f(x, y))), 0.0f, 0.0f, 0.0f});
  return level;
}

TexelImage anyImage(int width, int height, Random& random) {
  return {.levels = {levelOf(width, height, [&](int, int) { return random.uniform(-1, 1); })}};
}

double red(const TexelImage& image, const Sampling& by, double u, double v, double lod = 0) {
  return sampled(image, by, Vec2<double>(u, v), lod).x;
}

Bounded redBounds(const TexelImage& image, const Sampling& by, float u, float v, float lod = 0) {
  return sampled(image, by, Vec2<Bounded>(u, v), Bounded(lod)).x;
}

TEST(PrecisionSampleRgba8Model, AddressModesFollowTheirTable) {
  constexpr std::array kClamped = {0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2};  // indices -4 to 6 of 3
  constexpr std::array kRepeated = {2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0};
  constexpr std::array kMirrored = {2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0};
  for (std::size_t i = 0; i < kClamped.size(); ++i) {
    const auto index = static_cast<std::int64_t>(i) - 4;
    EXPECT_EQ(addressed(index, 3, AddressMode::clamp), kClamped[i]) << index;
    EXPECT_EQ(addressed(index, 3, AddressMode::repeat), kRepeated[i]) << index;
    EXPECT_EQ(addressed(index, 3, AddressMode::mirror), kMirrored[i]) << index;
  }
}

// (x + 1/2) / size is a texel's centre; 16 x 8, so that it is exact.
TEST(PrecisionSampleRgba8Model, ATexelIsReadAtItsCentre) {
  const TexelImage image{.levels = {levelOf(16, 8, [](int x, int y) { return x + 16 * y; })}};
  for (const bool linear : {false, true})
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 16; ++x) {
        const double u = (x + 0.5) / 16, v = (y + 0.5) / 8;
        EXPECT_EQ(red(image, {.linear = linear}, u, v), x + 16 * y);
        EXPECT_TRUE(admits(
            redBounds(image, {.linear = linear}, static_cast<float>(u), static_cast<float>(v)),
            static_cast<float>(x + 16 * y)));
      }
}

// Half a texel from the edges on, a ramp of slope 1 is u * size - 1/2; another axis has no part.
TEST(PrecisionSampleRgba8Model, ARampIsReproduced) {
  const TexelImage across{.levels = {levelOf(13, 7, [](int x, int) { return x; })}};
  const TexelImage down{.levels = {levelOf(13, 7, [](int, int y) { return y; })}};
  for (double t = 0; t <= 1; t += 1.0 / 64) {
    EXPECT_NEAR(red(across, kLinear, t, 0.3), std::clamp(13 * t - 0.5, 0.0, 12.0), 1e-14) << t;
    EXPECT_NEAR(red(down, kLinear, 0.3, t), std::clamp(7 * t - 0.5, 0.0, 6.0), 1e-14) << t;
  }
}

// Any weights of equal texels give the texel: the interval is that of the arithmetic alone.
TEST(PrecisionSampleRgba8Model, AConstantImageStaysConstant) {
  Random random(caseSeed());
  TexelImage image{.storage = Storage::unorm8};
  const Bounded texel = loaded(100, Storage::unorm8);
  for (const int side : {5, 2, 1}) {
    image.levels.push_back({.width = side, .height = side});
    image.levels.back().texels.assign(static_cast<std::size_t>(side * side),
                                      {texel, texel, texel, texel});
  }
  for (int i = 0; i < 1000; ++i) {
    const Bounded got = redBounds(image, kLinear, static_cast<float>(random.uniform(-2, 3)),
                                  static_cast<float>(random.uniform(-2, 3)),
                                  static_cast<float>(random.uniform(-1, 3)));
    EXPECT_TRUE(got.lo <= texel.lo && got.hi >= texel.hi);
    // Two ULP to each side as the texel is read, and 16 roundings of three interpolations.
    EXPECT_LE(got.hi - got.lo, 4 * ulp(texel.value) + 2.1 * 16 * 0x1p-23 * texel.hi);
  }
}

TEST(PrecisionSampleRgba8Model, LevelsAreWeightedByTheFractionOfTheLod) {
  const auto constant = [](int side, int value) {
    return levelOf(side, side, [=](int, int) { return value; });
  };
  const TexelImage image{.levels = {constant(4, 0), constant(2, 1), constant(1, 2)}};
  const Sampling nearestMips{.linear = true};
  for (double lod = -1; lod <= 3; lod += 1.0 / 16) {
    const double inside = std::clamp(lod, 0.0, 2.0);
    EXPECT_EQ(red(image, kLinear, 0.3, 0.6, lod), inside);
    // Half-way between levels the specification prefers the larger image.
    EXPECT_EQ(red(image, nearestMips, 0.3, 0.6, lod), std::max(std::ceil(inside + 0.5) - 1, 0.0));
  }
}

/// The filter of the specification once more, its fractions handed in.
double written(const TexelLevel& level, AddressMode mode, double i, double j, double a, double b) {
  const auto at = [&](double x, double y) {
    const int column = addressed(static_cast<std::int64_t>(x), level.width, mode);
    const int row = addressed(static_cast<std::int64_t>(y), level.height, mode);
    return level.texels[static_cast<std::size_t>(row * level.width + column)].x.value;
  };
  return (at(i, j) * (1 - a) + at(i + 1, j) * a) * (1 - b) +
         (at(i, j + 1) * (1 - a) + at(i + 1, j + 1) * a) * b;
}

TEST(PrecisionSampleRgba8Model, TheIntervalHoldsEveryWeightThatIsRounded) {
  constexpr double kQuantum = 0x1p-8;
  Random random(caseSeed());
  for (const AddressMode mode : {AddressMode::clamp, AddressMode::repeat, AddressMode::mirror}) {
    const Sampling by{.linear = true, .address = mode};
    const TexelImage image = anyImage(13, 7, random);
    for (int n = 0; n < 2000; ++n) {
      const auto u = static_cast<float>(random.uniform(-2, 3));
      const auto v = static_cast<float>(random.uniform(-2, 3));
      const double x = double{u} * 13 - 0.5, y = double{v} * 7 - 0.5;
      const double i = std::floor(x), j = std::floor(y);
      EXPECT_NEAR(red(image, by, u, v), written(image.levels[0], mode, i, j, x - i, y - j), 1e-13);
      const Bounded allowed = redBounds(image, by, u, v);
      for (const auto& across : {std::floor((x - i) / kQuantum), std::ceil((x - i) / kQuantum)})
        for (const auto& down : {std::floor((y - j) / kQuantum), std::ceil((y - j) / kQuantum)}) {
          const double got =
              written(image.levels[0], mode, i, j, across * kQuantum, down * kQuantum);
          EXPECT_TRUE(admits(allowed, static_cast<float>(got))) << u << " " << v;
        }
    }
  }
}

// A product rounded up reaches the boundary from below, where the exact one does not.
TEST(PrecisionSampleRgba8Model, TheNearestIsUndecidedNextToABoundaryOnly) {
  const TexelImage image{.levels = {levelOf(10, 1, [](int x, int) { return x; })}};
  int undecided = 0;
  for (int x = 1; x < 10; ++x) {
    const float boundary = static_cast<float>(x) / 10;
    for (const float u :
         {std::nextafter(boundary, 0.0f), boundary, std::nextafter(boundary, 1.0f)}) {
      const Bounded got = redBounds(image, {}, u, 0.5f);
      EXPECT_TRUE(admits(got, static_cast<float>(std::floor(10 * double{u})))) << u;
      undecided += got.isPoint() ? 0 : 1;
    }
    for (const float away : {-0x1p-20f, 0x1p-20f})
      EXPECT_TRUE(redBounds(image, {}, boundary + away, 0.5f).isPoint()) << x;
  }
  EXPECT_GT(undecided, 0);
}

TEST(PrecisionSampleRgba8Model, AnIntervalOfCoordinatesHoldsWhatItsPlacesHold) {
  Random random(caseSeed());
  const TexelImage image = anyImage(13, 7, random);
  for (int n = 0; n < 1000; ++n) {
    const double u = random.uniform(), wide = random.logUniform(1e-4, 1), v = random.uniform();
    const Vec2<Bounded> place(Bounded::between(u, u + wide), Bounded::between(v, v + wide));
    const Bounded all = sampled(image, kLinear, place, Bounded(0.0f)).x;
    const double got =
        red(image, kLinear, u + wide * random.uniform(), v + wide * random.uniform());
    EXPECT_TRUE(all.lo <= got && got <= all.hi);
  }
}

// Texels 0.25 and 0.75: between their centres a linear comparison with 0.5 is anything.
TEST(PrecisionSampleCompareModel, AComparisonPassesFromTheTexelOn) {
  const TexelImage image{
      .levels = {levelOf(2, 1, [](int x, int) { return x == 0 ? 0.25 : 0.75; })}};
  const auto at = [&](bool linear, float u, float reference) {
    return compared(image, {.linear = linear}, Vec2<Bounded>(u, 0.5f), Bounded(0.0f),
                    Bounded(reference));
  };
  EXPECT_TRUE(at(false, 0.25f, 0.25f).isPoint() && at(false, 0.25f, 0.25f).value == 1);
  EXPECT_TRUE(at(false, 0.25f, 0.2499f).isPoint() && at(false, 0.25f, 0.2499f).value == 0);
  EXPECT_TRUE(at(false, 0.75f, 0.5f).isPoint() && at(false, 0.75f, 0.5f).value == 0);
  const Bounded between = at(true, 0.5f, 0.5f);
  EXPECT_TRUE(between.lo == 0 && between.hi == 1 && between.value == 0.5);
  EXPECT_TRUE(at(true, 0.5f, 0.9f).isPoint() && at(true, 0.5f, 0.9f).value == 1);
}

}  // namespace
}  // namespace gnomon::precision
