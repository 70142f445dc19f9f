// tonemap/resolve: the kernel against the model over its domains, laws on the kernel, bad input.
//
// Covered: every curve with every transfer function in bulk, shadows and highlights; bloom smaller,
// larger, as large and of one texel; sizes around a group; a 1920x1080 frame of sky, sun and specks
// in a frame's own formats; every probe inside its own; bad input; exposure against scaled input;
// monotone ramps; range.
// Not covered: bloom or exposure outside the contract's ranges.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "reference/bound/storage.h"
#include "reference/tonemap/resolve.h"
#include "tests/tonemap/frames.h"

namespace gnomon::tonemap {
namespace {

constexpr std::array kCurves = {kLinear, kReinhard, kNarkowicz, kHill};
constexpr std::array kTransfers = {kNone, kGamma, kSrgb};

Pixels pixelsOfPicture(const Picture& picture) { return {picture.size, picture.texels}; }

class TonemapResolve : public KernelCase {
 protected:
  TonemapResolve() : KernelCase("tonemap/resolve") {}

  Observation dispatch(const Frame& frame, unsigned beyond = 0) {
    return dispatch(frame.push, floatImage("hdr", frame.hdr), floatImage("bloom", frame.bloom),
                    beyond);
  }

  Observation dispatch(const Resolve& push, const InputImage& hdr, const InputImage& bloom,
                       unsigned beyond = 0) {
    return run(
        {.inputImages = {hdr, bloom},
         .outputImages =
             {{.image = "target", .width = push.size.x, .height = push.size.y, .beyond = beyond}},
         .push = std::as_bytes(std::span(&push, 1)),
         .extent = {push.size.x, push.size.y}});
  }

  static Expectation modelOf(const Frame& frame) {
    return pixelsOf(
        "target", frame.push.size,
        [&frame]<class T>(std::size_t i) {
          const auto pixel = static_cast<uint>(i);
          return resolve<T>(frame.push, pixelsOfPicture(frame.hdr), pixelsOfPicture(frame.bloom),
                            {pixel % frame.push.size.x, pixel / frame.push.size.x});
        },
        [&frame](std::size_t i) { return describe(frame, i); });
  }

  void expectInsideTheBound(const Frame& frame) {
    expectConformsOn(frame, [this](const Frame& f) { return Trial{dispatch(f), modelOf(f)}; });
  }

  void expectEveryCombinationInsideTheBound(Frame frame) {
    for (const uint curve : kCurves)
      for (const uint transfer : kTransfers) {
        frame.push.curve = curve;
        frame.push.transfer = transfer;
        expectInsideTheBound(frame);
      }
  }

  /// What the strict twin wrote into a float image, checked for hygiene.
  std::vector<vec4> shown(const Frame& frame) {
    const Observation seen = dispatch(frame);
    expectClean(seen);
    checked(frame.hdr.pixels());
    return elementsOf<vec4>(seen.twin.at("target"));
  }
};

/// Cases that judge without the model.
class TonemapResolveLaws : public TonemapResolve {};

/// Cases that judge the intermediates.
class TonemapResolveProbes : public TonemapResolve {
 protected:
  void SetUp() override {
    TonemapResolve::SetUp();
    skipUnlessTheProbesAreOurs();
  }
};

const uvec2 kSize(251, 127);

// A few groups, the last ones in part, under every curve; the transfer function has no probe.
TEST_F(TonemapResolveProbes, EveryProbeStaysInsideItsBound) {
  const uvec2 size(2 * kGroupSide + 5, kGroupSide + 3);
  for (Frame frame : {bulk(size, caseSeed()), shadows(size, caseSeed()),
                      highlights(size, caseSeed()), degenerate()})
    for (const uint curve : kCurves) {
      frame.push.curve = curve;
      expectEveryProbeInside(dispatch(frame), modelOf(frame));
    }
}

TEST_F(TonemapResolveProbes, ContractAndModelNameTheSame) {
  const Frame frame = bulk({kGroupSide, kGroupSide}, caseSeed());
  expectTheModelNamesEveryProbe(std::array{modelOf(frame)});
  checked(frame.hdr.pixels());
}

TEST_F(TonemapResolve, BulkStaysInsideTheBound) {
  expectEveryCombinationInsideTheBound(bulk(kSize, caseSeed()));
}

TEST_F(TonemapResolve, ShadowsStayInsideTheBound) {
  expectEveryCombinationInsideTheBound(shadows(kSize, caseSeed()));
}

TEST_F(TonemapResolve, HighlightsStayInsideTheBound) {
  expectEveryCombinationInsideTheBound(highlights(kSize, caseSeed()));
}

TEST_F(TonemapResolve, BadInputCountsAsTheContractSays) {
  Frame frame = degenerate();
  for (const float exposure : {0x1p-32f, 0.75f, 0x1p32f}) {
    frame.push.exposure = exposure;
    expectEveryCombinationInsideTheBound(frame);
  }
}

TEST_F(TonemapResolve, EveryPieceOfATransferFunctionEndsWhereItShould) {
  Frame frame = thresholds();
  for (const uint transfer : kTransfers) {
    frame.push.transfer = transfer;
    expectInsideTheBound(frame);
  }
}

TEST_F(TonemapResolveLaws, PixelsBeyondTheSizeAreNotTouched) {
  for (const uvec2 size :
       {uvec2(kGroupSide + 5, kGroupSide), uvec2(kGroupSide, kGroupSide + 5), uvec2(1, 1)}) {
    const Frame frame = bulk(size, caseSeed());
    expectClean(dispatch(frame, kGroupSide));
    checked(std::size_t{size.x} * size.y);
  }
}

TEST_F(TonemapResolve, BloomOfEverySizeIsFilteredBetweenItsCentres) {
  for (const uvec2 bloom : {uvec2(1, 1), uvec2(1, 9), uvec2(11, 1), uvec2(31, 17), uvec2(62, 34),
                            uvec2(61, 33), uvec2(100, 90)}) {
    Frame frame = between(0.01, 1, {61, 33}, bloom, caseSeed() + bloom.x);
    frame.push.bloomIntensity = 1;
    expectInsideTheBound(frame);
  }
}

TEST_F(TonemapResolve, EverySizeAroundAGroupIsWrittenExactly) {
  for (const uvec2 size : {uvec2(1, 1), uvec2(kGroupSide - 1, kGroupSide), uvec2(kGroupSide),
                           uvec2(kGroupSide, kGroupSide + 1), uvec2(1, 37), uvec2(37, 1)})
    expectInsideTheBound(bulk(size, caseSeed() + size.x));
}

TEST_F(TonemapResolve, AnUnknownCurveOrTransferCountsAsNone) {
  Frame frame = bulk({16, 16}, caseSeed());
  for (const uint unknown : {4u, ~0u}) {
    frame.push.curve = frame.push.transfer = unknown;
    expectInsideTheBound(frame);
  }
}

TEST_F(TonemapResolve, ASkyWithSunAndSpecksStaysInsideTheBound) {
  const Picture sky = load(Session::current().options().root / "data/frames/sky.exr");
  Frame frame{.push = {.size = sky.size,
                       .exposure = 0.7f,
                       .bloomIntensity = 0.3f,
                       .curve = kHill,
                       .transfer = kSrgb},
              .hdr = sky,
              .bloom = halved(sky, 0.1f)};
  expectConformsOn(std::move(frame), [this](Frame& f) {
    const HalfImage hdr("hdr", f.hdr), bloom("bloom", f.bloom);
    f.hdr = hdr.picture();
    f.bloom = bloom.picture();
    return Trial{dispatch(f.push, hdr.input(), bloom.input()), modelOf(f)};
  });
}

TEST_F(TonemapResolveLaws, NanIsBlackAndInfinityIsWhite) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  Frame frame{.push = {.size = {4, 1},
                       .exposure = 0.5f,
                       .bloomIntensity = 0,
                       .curve = kLinear,
                       .transfer = kNone},
              .hdr = {.size = {4, 1},
                      .texels = {vec4(std::numeric_limits<float>::quiet_NaN()), vec4(-kInf),
                                 vec4(kInf), vec4(0)}},
              .bloom = {.size = {1, 1}, .texels = {vec4(0)}}};
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers) {
      frame.push.curve = curve;
      frame.push.transfer = transfer;
      if (!applies(frame.push)) continue;
      const std::vector<vec4> pixels = shown(frame);
      EXPECT_EQ(pixels[0], pixels[3]) << "NaN, curve " << curve << ", transfer " << transfer;
      EXPECT_EQ(pixels[1], pixels[3]) << "-Inf, curve " << curve << ", transfer " << transfer;
      EXPECT_EQ(vec3(pixels[3]), vec3(0)) << "black, curve " << curve;
      // sRGB's 1.055 - 0.055 and a power of 1 are as far from 1 as their roundings.
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(pixels[2][c], 1, 4 * std::numeric_limits<float>::epsilon())
            << "+Inf, curve " << curve << ", transfer " << transfer;
    }
}

// A doubling is exact in binary, so both sides are the same numbers from the first product on.
TEST_F(TonemapResolveLaws, OneStopMoreIsTwiceTheLight) {
  Frame brighter = bulk(kSize, caseSeed());
  for (const uint curve : kCurves) {
    brighter.push.curve = curve;
    brighter.push.transfer = kSrgb;
    if (!applies(brighter.push)) continue;
    Frame scaled = brighter;
    brighter.push.exposure *= 2;
    for (Picture* picture : {&scaled.hdr, &scaled.bloom})
      for (vec4& texel : picture->texels) texel *= 2.0f;
    EXPECT_EQ(shown(brighter), shown(scaled)) << "curve " << curve;
    brighter.push.exposure /= 2;
  }
}

// Steps of 2 %, in which the flattest curve that is not yet white (Narkowicz below 7.24) moves by
// more than its rounding: 0.02 x f'(x) = 3e-4 at x = 7, against an interval of 1e-6.
TEST_F(TonemapResolveLaws, GreyRampsRise) {
  constexpr uint kSteps = 800;
  constexpr float kStep = 1.02f;
  constexpr float kWhite = 1 - 4 * std::numeric_limits<float>::epsilon();  // as encoded
  Frame frame = bulk({kSteps, 1}, caseSeed());
  frame.push.exposure = 1;
  frame.push.bloomIntensity = 0;
  float x = 1e-6f;
  for (vec4& texel : frame.hdr.texels) {
    texel = vec4(x, x, x, 1);
    x *= kStep;
  }
  for (const uint curve : kCurves)
    for (const uint transfer : kTransfers) {
      frame.push.curve = curve;
      frame.push.transfer = transfer;
      if (!applies(frame.push)) continue;
      const std::vector<vec4> pixels = shown(frame);
      for (std::size_t i = 1; i < pixels.size(); ++i) {
        ASSERT_GE(pixels[i].x, pixels[i - 1].x)
            << "curve " << curve << ", transfer " << transfer << " at " << frame.hdr.at(i).x;
        if (pixels[i - 1].x < kWhite && pixels[i].x > 0) {
          ASSERT_GT(pixels[i].x, pixels[i - 1].x)
              << "curve " << curve << ", transfer " << transfer << " at " << frame.hdr.at(i).x;
        }
      }
    }
}

TEST_F(TonemapResolveLaws, EveryResultIsInRangeWithAlphaOne) {
  for (Frame frame : {degenerate(), highlights(kSize, caseSeed()), shadows(kSize, caseSeed())})
    for (const uint curve : kCurves) {
      frame.push.curve = curve;
      if (!applies(frame.push)) continue;
      for (const vec4& pixel : shown(frame)) {
        for (int c = 0; c < 3; ++c) ASSERT_TRUE(pixel[c] >= 0 && pixel[c] <= 1) << pixel[c];
        ASSERT_EQ(pixel.w, 1);
      }
    }
}

}  // namespace
}  // namespace gnomon::tonemap
