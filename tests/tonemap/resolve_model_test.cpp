// The model of tonemap/resolve as a whole against truth that does not come from it. No GPU.
//
// Covered: bilinear bloom against what it must reproduce; the order of the steps; bad input; the
// width of the intervals. Curves and transfer functions have a file of their own.
// Not covered: how the target's format rounds.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/modelled.h"
#include "harness/cases/random.h"
#include "reference/bound/float.h"
#include "reference/tonemap/resolve.h"

namespace gnomon::tonemap {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kQuiet = std::numeric_limits<float>::quiet_NaN();

// Some roundings of double, for what would be exact in real numbers.
constexpr double kDouble = 4 * std::numeric_limits<double>::epsilon();

// The model's constants are floats (0.59f, not 0.59): each is off by half an ULP at most.
constexpr double kHalfUlp = 0x1p-24;

constexpr std::array kCurves = {kLinear, kReinhard, kNarkowicz, kHill};
constexpr std::array kTransfers = {kNone, kGamma, kSrgb};

double hillGrey(double x) { return hill(Vec3<double>(x)).x; }

// What these tests are about (modelled.h). Curves and transfer functions are parts that have been
// tested, so they stay as they are.
Vec3<double> bloomAt(const Pixels& bloom, const uvec2& size, const uvec2& pixel) {
  return modelled("bloomAt", [&]<class T>() { return tonemap::bloomAt<T>(bloom, size, pixel); });
}
// Each curve without a transfer function and each transfer function without a curve: that is every
// operation. What both do together stays as it is.
Vec4<double> resolve(const Resolve& push, const Pixels& hdr, const Pixels& bloom,
                     const uvec2& pixel) {
  constexpr std::array kCurveEntries = {"resolve", "resolve.reinhard", "resolve.narkowicz",
                                        "resolve.hill"};
  constexpr std::array kTransferEntries = {"resolve", "resolve.gamma", "resolve.srgb"};
  const uint bent = push.curve <= kHill ? push.curve : kLinear;
  const uint encoded = push.transfer <= kSrgb ? push.transfer : kNone;
  if (bent != kLinear && encoded != kNone) return tonemap::resolve<double>(push, hdr, bloom, pixel);
  return modelled(bent != kLinear ? kCurveEntries.at(bent) : kTransferEntries.at(encoded),
                  [&]<class T>() { return tonemap::resolve<T>(push, hdr, bloom, pixel); });
}

// An image whose texel (x, y) is colour(x, y).
struct Painted {
  template <class Colour>
  Painted(const uvec2& size_, const Colour& colour) : size(size_) {
    for (uint y = 0; y < size.y; ++y)
      for (uint x = 0; x < size.x; ++x) texels.push_back(vec4(colour(x, y), 1));
  }
  explicit Painted(const vec3& all) : Painted(uvec2(1), [&](uint, uint) { return all; }) {}
  operator Pixels() const { return {size, texels}; }

  uvec2 size;
  std::vector<vec4> texels;
};

// Calls f(bloom's size, image's size, pixel) for all pixels of pairs of sizes: half, whole, double,
// odd, one.
template <class F>
void forEachPixel(const F& f) {
  constexpr std::array<std::array<uint, 4>, 7> kSizes = {{{4, 3, 8, 6},
                                                          {5, 4, 5, 4},
                                                          {8, 6, 4, 3},
                                                          {3, 4, 7, 9},
                                                          {7, 9, 3, 4},
                                                          {1, 1, 5, 3},
                                                          {6, 1, 1, 5}}};
  for (const auto& [bw, bh, w, h] : kSizes)
    for (uint y = 0; y < h; ++y)
      for (uint x = 0; x < w; ++x) f(uvec2(bw, bh), uvec2(w, h), uvec2(x, y));
}

std::string describe(const uvec2& bloom, const uvec2& size, const uvec2& at) {
  return fmt::format("{} x {} bloom, pixel ({}, {}) of {} x {}", bloom.x, bloom.y, at.x, at.y,
                     size.x, size.y);
}

void expectThatConstantBloomStaysConstant() {
  const vec3 colour(0.1f, 3, 700);
  forEachPixel([&](const uvec2& bloom, const uvec2& size, const uvec2& at) {
    const Painted image(bloom, [&](uint, uint) { return colour; });
    const Vec3<double> got = bloomAt(image, size, at);
    for (int c = 0; c < 3; ++c)
      EXPECT_LE(std::abs(got[static_cast<std::size_t>(c)] / colour[c] - 1), kDouble)
          << describe(bloom, size, at);
  });
}

void expectThatBloomOfTheImagesSizeIsTakenTexelByTexel() {
  const uvec2 size(5, 4);
  const Painted image(size, [](uint x, uint y) { return vec3(x, y, 7 * y + x); });
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x) {
      const Vec3<double> got = bloomAt(image, size, {x, y});
      EXPECT_EQ(got.x, x);
      EXPECT_EQ(got.y, y);
      EXPECT_EQ(got.z, 7 * y + x);
    }
}

// Where pixel x of w stands among n texels, counted from the first centre and held at the outer
// ones: texel i has its centre at i + 1/2 texels, and pixel x at (x + 1/2) n / w of them.
double ramp(double x, double w, double n) {
  return std::clamp((x + 0.5) * n / w - 0.5, 0.0, n - 1);
}

// Bilinear reproduces a ramp along x, one along y and their product between the outer centres.
void expectThatRampsAreReproducedAndTheEdgeIsHeld() {
  forEachPixel([&](const uvec2& bloom, const uvec2& size, const uvec2& at) {
    const Painted image(bloom, [](uint x, uint y) { return vec3(x, y, x * y); });
    const double u = ramp(at.x, size.x, bloom.x), v = ramp(at.y, size.y, bloom.y);
    const Vec3<double> got = bloomAt(image, size, at);
    // Weights are exact to a rounding; values are up to bloom's size.
    const double rounding = kDouble * bloom.x * bloom.y;
    EXPECT_LE(std::abs(got.x - u), rounding) << describe(bloom, size, at);
    EXPECT_LE(std::abs(got.y - v), rounding) << describe(bloom, size, at);
    EXPECT_LE(std::abs(got.z - u * v), rounding) << describe(bloom, size, at);
  });
}

// At half size a pixel is a quarter of a texel from its own texel's centre: 3/4 and 1/4, exactly.
void expectThatHalfSizeIsMixedOneToThree() {
  const Painted image({2, 2}, [](uint x, uint y) { return vec3(x + 2 * y == 0); });
  const std::array<double, 4> weight = {1, 0.75, 0.25, 0};
  for (uint y = 0; y < 4; ++y)
    for (uint x = 0; x < 4; ++x)
      EXPECT_EQ(bloomAt(image, {4, 4}, {x, y}).x, weight[x] * weight[y]) << x << " " << y;
}

void expectThatWeightsAreNotNegativeAndSumToOne() {
  forEachPixel([&](const uvec2& bloom, const uvec2& size, const uvec2& at) {
    double sum = 0;
    for (uint i = 0; i < bloom.x * bloom.y; ++i) {
      const Painted impulse(bloom, [&](uint x, uint y) { return vec3(x + bloom.x * y == i); });
      const double weight = bloomAt(impulse, size, at).x;
      EXPECT_GE(weight, 0) << describe(bloom, size, at);
      sum += weight;
    }
    EXPECT_LE(std::abs(sum - 1), kDouble) << describe(bloom, size, at);
  });
}

TEST(TonemapResolveModel, BloomIsFilteredBilinearlyBetweenItsCentres) {
  expectThatConstantBloomStaysConstant();
  expectThatBloomOfTheImagesSizeIsTakenTexelByTexel();
  expectThatRampsAreReproducedAndTheEdgeIsHeld();
  expectThatHalfSizeIsMixedOneToThree();
  expectThatWeightsAreNotNegativeAndSumToOne();
}

Resolve settings(uint curve, uint transfer, float exposure = 1, float intensity = 0) {
  return {.size = uvec2(1),
          .exposure = exposure,
          .bloomIntensity = intensity,
          .curve = curve,
          .transfer = transfer};
}

/// One pixel of one texel of bloom.
Vec4<double> pixel(const Resolve& push, const vec3& hdr, const vec3& bloom = vec3(0)) {
  return resolve(push, Painted(hdr), Painted(bloom), uvec2(0));
}

void expectSame(const Vec4<double>& got, const Vec4<double>& expected, const std::string& what) {
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_EQ(got[c], expected[c]) << what << ", "
                                   << "rgba"[c];
}

vec3 colour(Random& random, double lo, double hi) {
  return vec3(random.logUniform(lo, hi), random.logUniform(lo, hi), random.logUniform(lo, hi));
}

// Doubling is exact, so the two sides meet bit by bit.
void expectThatDoubledLightIsOneMoreStop() {
  Random random(caseSeed());
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers)
      for (int i = 0; i < 100; ++i) {
        const float exposure = std::exp2(static_cast<float>(random.below(9)) - 4);
        const vec3 hdr = colour(random, 0x1p-8, 0x1p4), bloom = colour(random, 0x1p-8, 0x1p4);
        expectSame(pixel(settings(curve, transfer, exposure, 0.25f), hdr * 2.0f, bloom * 2.0f),
                   pixel(settings(curve, transfer, exposure * 2, 0.25f), hdr, bloom),
                   fmt::format("curve {}, transfer {}", curve, transfer));
      }
}

// Ramps again, this time through the whole of resolve: multiples of 2^-6 that stay below 1.
TEST(TonemapResolveModel, EveryPixelIsItsOwnTexelAndTheBloomAroundIt) {
  forEachPixel([&](const uvec2& bloomSize, const uvec2& size, const uvec2& at) {
    const Painted hdr(size, [](uint x, uint y) { return vec3(x, y, 0) / 64.0f; });
    const Painted bloom(bloomSize, [](uint x, uint y) { return vec3(x, y, x + y) / 64.0f; });
    Resolve push = settings(kLinear, kNone, 2, 0.5f);
    push.size = size;
    const Vec4<double> got = resolve(push, hdr, bloom, at);
    const double u = ramp(at.x, size.x, bloomSize.x), v = ramp(at.y, size.y, bloomSize.y);
    EXPECT_LE(std::abs(got.x - (2 * at.x + u) / 64), kDouble) << describe(bloomSize, size, at);
    EXPECT_LE(std::abs(got.y - (2 * at.y + v) / 64), kDouble) << describe(bloomSize, size, at);
    EXPECT_LE(std::abs(got.z - (u + v) / 64), kDouble) << describe(bloomSize, size, at);
  });
}

// What the contract says of a pixel, of parts that have tests of their own.
Vec4<double> madeOfItsParts(const Resolve& push, const Painted& hdr, const Painted& bloom,
                            const uvec2& at) {
  const vec4& texel = hdr.texels[at.y * hdr.size.x + at.x];
  const Vec3<double> around = tonemap::bloomAt<double>(bloom, push.size, at);
  Vec3<double> exposed;
  for (std::size_t c = 0; c < 3; ++c) {
    const double scene = std::clamp(texel[static_cast<int>(c)], -kMaxScene, kMaxScene) +
                         around[c] * push.bloomIntensity;
    exposed[c] = std::clamp<double>(scene * push.exposure, 0, kMaxScene);
  }
  const Vec3<double> bent = curve(push.curve, exposed);
  Vec4<double> shown(1);
  for (std::size_t c = 0; c < 3; ++c)
    shown[c] = transfer(push.transfer, std::clamp(bent[c], 0.0, 1.0));
  return shown;
}

// From black over what shows every digit to beyond the largest scene, either sign.
TEST(TonemapResolveParts, APixelIsMadeOfItsParts) {
  Random random(caseSeed());
  const auto any = [&](uint, uint) {
    const auto light = [&] {
      const float x =
          random.chance(0.1) ? 0 : static_cast<float>(random.logUniform(0x1p-20, 0x1p2));
      return x * (random.chance(0.2) ? -1.0f : 1.0f) * (random.chance(0.1) ? 0x1p31f : 1.0f);
    };
    return vec3(light(), light(), light());
  };
  const uvec2 size(7, 5), bloomSize(4, 3);
  for (int i = 0; i < 20; ++i) {
    const Painted hdr(size, any), bloom(bloomSize, any);
    for (const uint which : kCurves)
      for (const uint code : kTransfers) {
        Resolve push = settings(which, code, 1.5f, 0.125f);
        push.size = size;
        for (uint y = 0; y < size.y; ++y)
          for (uint x = 0; x < size.x; ++x) {
            const Vec4<double> got = resolve(push, hdr, bloom, {x, y});
            const Vec4<double> expected = madeOfItsParts(push, hdr, bloom, {x, y});
            for (std::size_t c = 0; c < 4; ++c)
              EXPECT_EQ(got[c], expected[c]) << "curve " << which << ", transfer " << code << ", "
                                             << describe(bloomSize, size, {x, y});
          }
      }
  }
}

// Where a transfer function has two pieces, each colour takes its own: at the last x of one and the
// first of the other.
TEST(TonemapResolveModel, EveryColourTakesItsOwnPieceOfTheTransferFunction) {
  const float gamma = std::numeric_limits<float>::min(), srgb = 0.0031308f;
  for (const auto& [code, at] : {std::pair{kGamma, gamma}, std::pair{kSrgb, srgb}})
    for (const float x : {std::nextafter(at, 0.0f), at, std::nextafter(at, 1.0f)})
      for (int c = 0; c < 3; ++c) {
        vec3 colour(0.5f);
        colour[c] = x;
        const Vec4<double> got = pixel(settings(kLinear, code), colour);
        for (int k = 0; k < 3; ++k)
          EXPECT_EQ(got[static_cast<std::size_t>(k)], transfer<double>(code, double{colour[k]}))
              << code << ", component " << k << " of " << x;
      }
}

// 2 bends to more than 1 without a curve, and to less with any: saturation stands behind the curve.
TEST(TonemapResolveModel, OnlyWhatTheCurveReturnsIsSaturated) {
  EXPECT_EQ(pixel(settings(kLinear, kNone), vec3(2)).x, 1);
  for (const uint which : {kReinhard, kNarkowicz, kHill})
    EXPECT_EQ(pixel(settings(which, kNone), vec3(2)).x, curve(which, Vec3<double>(2)).x) << which;
  EXPECT_EQ(pixel(settings(kNarkowicz, kNone), vec3(10)).x, 1);  // 1.009 before
  EXPECT_EQ(pixel(settings(kHill, kNone), vec3(1, 0, 0)).y, 0);  // negative before
}

void expectThatTheDisplayValueIsEncodedOnce() {
  // The exponent's half ULP, |ln 0.2| / 2.2 < 1, and those of sRGB's three constants.
  constexpr double kConstants = 4 * kHalfUlp;
  for (const float x : {0.2f, 0.5f, 0.9f}) {
    EXPECT_EQ(pixel(settings(kLinear, kNone), vec3(x)).x, x);
    EXPECT_LE(std::abs(pixel(settings(kLinear, kGamma), vec3(x)).x - std::pow(x, 1 / 2.2)),
              kConstants);
    EXPECT_LE(std::abs(pixel(settings(kLinear, kSrgb), vec3(x)).x -
                       (1.055 * std::pow(x, 1 / 2.4) - 0.055)),
              kConstants);
  }
}

// (1/8 + 1/2 * 1/4) * 2 = 1/2 in each step's own place: of the curve 1/2 comes out as the curve of
// 1/2, which no other order gives.
void expectThatEveryStepHasItsPlace() {
  for (const uint which : kCurves) {
    const Vec3<double> bent = curve(which, Vec3<double>(0.5));
    for (const uint code : kTransfers) {
      const Vec4<double> got = pixel(settings(which, code, 2, 0.25f), vec3(0.125f), vec3(0.5f));
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(got[c], transfer(code, bent[c])) << which << " " << code;
    }
  }
}

TEST(TonemapResolveModel, BloomIsAddedThenExposedThenBentThenSaturatedThenEncoded) {
  expectThatEveryStepHasItsPlace();
  expectThatTheDisplayValueIsEncodedOnce();
}

TEST(TonemapResolveModel, ResultsLieInZeroToOneAndAlphaIsOne) {
  Random random(caseSeed());
  for (int i = 0; i < 1000; ++i) {
    const auto signedColour = [&] {
      return colour(random, 0x1p-30, 0x1p30) * (random.chance(0.3) ? -1.0f : 1.0f);
    };
    const Resolve push =
        settings(kCurves[random.below(4)], kTransfers[random.below(3)], 0.5f, 0.125f);
    const Vec4<double> got = pixel(push, signedColour(), signedColour());
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_GE(got[c], 0);
      EXPECT_LE(got[c], 1 + 2 * kHalfUlp);  // 1.055f - 0.055f
    }
    EXPECT_EQ(got.w, 1);
  }
}

// Curves of a negative x are meaningless (Narkowicz's is positive again below -0.012); but light is
// clamped after bloom is added: -1/4 + 1/2 * 1 is the light 1/4.
void expectThatNegativeLightIsBlackUnlessBloomMakesUpForIt() {
  for (const uint which : kCurves) {
    for (const float x : {-0.01f, -1.0f, -1e30f})
      EXPECT_EQ(pixel(settings(which, kSrgb), vec3(x)).x, 0) << which << " of " << x;
    EXPECT_EQ(pixel(settings(which, kNone, 1, 0.5f), vec3(-0.25f), vec3(1)).x,
              curve(which, Vec3<double>(0.25)).x)
        << which;
  }
}

void expectThatUnknownCodesAreLinearAndNone() {
  const vec3 hdr(0.1f, 0.5f, 0.9f);
  expectSame(pixel(settings(kHill + 1, kSrgb + 1), hdr), pixel(settings(kLinear, kNone), hdr),
             "+1");
  expectSame(pixel(settings(~0u, ~0u), hdr), pixel(settings(kLinear, kNone), hdr), "~0");
}

void expectThatNanAndInfinitiesCountAsNumbers() {
  const float bads[] = {kQuiet, -kInf, kInf}, goods[] = {0, 0, kMaxScene};
  for (const uint curve : kCurves)
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) {
        vec3 bad(0.25f, 0.5f, 1), good = bad;
        bad[c] = bads[k], good[c] = goods[k];
        // 2^-32 brings the largest scene just below 1: there nothing saturates.
        for (const float exposure : {1.0f, 0x1p-32f}) {
          const Resolve push = settings(curve, kNone, exposure, 0.5f);
          const auto what = fmt::format("curve {}, component {} is {}", curve, c, bads[k]);
          expectSame(pixel(push, bad), pixel(push, good), what + " in hdr");
          expectSame(pixel(push, vec3(0.5f), bad), pixel(push, vec3(0.5f), good),
                     what + " in bloom");
        }
      }
}

void expectThatInfiniteLightIsWhiteAndNanBlack() {
  for (const uint which : kCurves) {
    for (std::size_t c = 0; c < 3; ++c) {
      // Reinhard's 1 - 1 / (1 + kMaxScene) is 1 in float.
      EXPECT_EQ(static_cast<float>(pixel(settings(which, kNone), vec3(kInf))[c]), 1) << which;
      EXPECT_EQ(pixel(settings(which, kSrgb), vec3(-kInf))[c], 0) << which;
      EXPECT_EQ(pixel(settings(which, kSrgb), vec3(kQuiet))[c], 0) << which;
    }
  }
}

// A bad texel is replaced before it is filtered, and only where it has weight.
void expectThatABadTexelOfBloomDoesNotSpreadAsNan() {
  const auto image = [](float corner) {
    return Painted({2, 2}, [=](uint x, uint y) { return vec3(x + y == 0 ? corner : 1.0f); });
  };
  for (uint x = 0; x < 4; ++x)
    EXPECT_EQ(bloomAt(image(kQuiet), {4, 4}, {x, 1}).x, bloomAt(image(0), {4, 4}, {x, 1}).x);
}

void expectThatAlphaIsNotLookedAt() {
  const std::vector<vec4> hdr = {{0.1f, 0.2f, 0.3f, kQuiet}}, bloom = {{1, 2, 3, kInf}};
  const Resolve push = settings(kHill, kSrgb, 1, 0.5f);
  expectSame(resolve(push, {uvec2(1), hdr}, {uvec2(1), bloom}, uvec2(0)),
             pixel(push, vec3(0.1f, 0.2f, 0.3f), vec3(1, 2, 3)), "alpha NaN and Inf");
}

TEST(TonemapResolveModel, BadInputCountsAsTheContractSays) {
  expectThatNegativeLightIsBlackUnlessBloomMakesUpForIt();
  expectThatUnknownCodesAreLinearAndNone();
  expectThatNanAndInfinitiesCountAsNumbers();
  expectThatInfiniteLightIsWhiteAndNanBlack();
  expectThatABadTexelOfBloomDoesNotSpreadAsNan();
  expectThatAlphaIsNotLookedAt();
}

// The scene's largest value is the clamp itself, at any exposure and with bloom on top.
void expectThatExposedLightIsClampedToTheLargestScene() {
  const float huge = std::numeric_limits<float>::max();
  for (const uint which : kCurves) {
    const Vec3<double> top = clamp(curve(which, Vec3<double>(kMaxScene)), 0.0, 1.0);
    EXPECT_EQ(pixel(settings(which, kNone, 0x1p32f, 1), vec3(huge), vec3(huge)).x, top.x) << which;
  }
  // Mixed colours show it: without the clamp red would be 2^32 of the others in Hill's matrices.
  expectSame(pixel(settings(kHill, kNone, 0x1p32f), vec3(huge, 1, 1)),
             pixel(settings(kHill, kNone), vec3(kMaxScene)), "saturated by exposure");
}

TEST(TonemapResolveModel, ExposureScalesLightUpToTheLargestScene) {
  expectThatDoubledLightIsOneMoreStop();
  expectThatExposedLightIsClampedToTheLargestScene();
}

// Random pixels under 4 x 3 of bloom for 7 x 5: colours around middle grey, EV -4 to 4.
template <class F>
void forEachBound(uint curve, uint transfer, int stops, const F& f) {
  Random random(caseSeed());
  for (int i = 0; i < 2000; ++i) {
    const uvec2 size(7, 5), at(random.below(7), random.below(5));
    const auto any = [&](uint, uint) { return colour(random, 0x1p-8, 0x1p3); };
    const Painted hdr(size, any), bloom({4, 3}, any);
    Resolve push = settings(curve, transfer, std::exp2(static_cast<float>(stops)), 0.0625f);
    push.size = size;
    f(tonemap::resolve<double>(push, hdr, bloom, at), resolve<Bounded>(push, hdr, bloom, at));
  }
}

// The bound's ends are floats, and the plain value skips the roundings that lead there: it may lie
// a step of float outside.
TEST(TonemapResolveBound, TheValueLiesInTheBoundOrAFloatBesideIt) {
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers)
      for (const int stops : {-4, 0, 4})
        forEachBound(curve, transfer, stops, [&](Vec4<double> plain, Vec4<Bounded> allowed) {
          for (std::size_t c = 0; c < 4; ++c) {
            const Bounded& a = allowed[c];
            ASSERT_FALSE(a.unspecified() || a.mayBeNan() || a.notJudged()) << a;
            ASSERT_EQ(a.value, plain[c]);
            const double step = spacing(std::max(std::abs(a.lo), std::abs(a.hi)));
            ASSERT_GE(plain[c], a.lo - step) << a << " curve " << curve << " code " << transfer;
            ASSERT_LE(plain[c], a.hi + step) << a << " curve " << curve << " code " << transfer;
          }
        });
}

// Whatever half floats and bad input can hold, at the ends of exposure: no operation leaves its
// specified domain and no NaN comes about.
TEST(TonemapResolveBound, BadInputAndTheEndsOfExposureStayInsideEveryDomain) {
  constexpr std::array kHard = {kQuiet, -kInf, kInf, -65504.0f, 0.0f, 0x1p-24f, 65504.0f};
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers)
      for (const float exposure : {0x1p-32f, 1.0f, 0x1p32f})
        for (const float a : kHard)
          for (const float b : kHard) {
            const Painted hdr({3, 1}, [=](uint, uint) { return vec3(a, b, 1); });
            const Painted bloom({2, 1}, [=](uint x, uint) { return x == 0 ? vec3(a) : vec3(b); });
            Resolve push = settings(curve, transfer, exposure, 1);
            push.size = hdr.size;
            const Vec4<Bounded> got = resolve<Bounded>(push, hdr, bloom, {1, 0});
            for (std::size_t c = 0; c < 4; ++c) {
              ASSERT_FALSE(got[c].unspecified() || got[c].mayBeNan())
                  << got[c] << " of " << a << ", " << b << ", curve " << curve;
              ASSERT_GE(got[c].lo, 0) << got[c];
            }
          }
}

double median(std::vector<double> all) {
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

// An RGBA8 target resolves half a step of 1 / 255, 2e-3: an interval of 1e-4 is a twentieth of it,
// so that whatever changes a pixel of the frame leaves the interval. Measured: 0.8e-6 (linear, no
// encoding) to 6.7e-6 (Hill), 2.6e-6 for Narkowicz with gamma.
TEST(TonemapResolveBound, HalfOfTheBoundsAreFarNarrowerThanAStepOfTheTarget) {
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers) {
      std::vector<double> widths;
      forEachBound(curve, transfer, 0, [&](const Vec4<double>&, const Vec4<Bounded>& allowed) {
        for (std::size_t c = 0; c < 3; ++c)
          if (allowed[c].lo > 0 && allowed[c].hi < 1)
            widths.push_back((allowed[c].hi - allowed[c].lo) / allowed[c].hi);
      });
      ASSERT_GT(widths.size(), 1000u);  // of 6000: the others saturate
      const double width = median(widths);
      EXPECT_LT(width, 1e-4) << "curve " << curve << ", transfer " << transfer;
      RecordProperty(fmt::format("width_{}_{}", curve, transfer), fmt::format("{:.2e}", width));
    }
}

// Each pair of curves and of transfer functions is told apart wherever it differs by more than the
// bound is wide, which is nearly everywhere.
TEST(TonemapResolveBound, TheBoundTellsCurvesAndTransfersApart) {
  std::size_t seen = 0, apart = 0;
  const auto count = [&](double other, const Bounded& allowed) {
    ++seen;
    apart += other < allowed.lo || other > allowed.hi;
  };
  Random random(caseSeed());
  for (int i = 0; i < 2000; ++i) {
    const double x = random.logUniform(0x1p-6, 1);
    const Bounded b(static_cast<float>(x));
    count(encodeSrgb(x), encodeGamma(b));
    count(narkowicz(x), reinhard(b));
    count(hillGrey(x), narkowicz(b));
    count(hill(Vec3<double>{x, x / 2, x / 4}).x, hill(Vec3<Bounded>(b)).x);
  }
  EXPECT_GE(apart * 100, seen * 99);
}

}  // namespace
}  // namespace gnomon::tonemap
