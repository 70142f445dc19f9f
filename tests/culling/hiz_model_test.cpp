// The model of the depth pyramid, and of how pyramids are addressed, without a GPU.
//
// Covered: what texels cover, at sizes that are odd at every level and at frames'; what counts as a
// depth; the loss of pyramids that forget to fold; which pixels other conventions' texels see.
// Not covered: that the formulas of those conventions are what anybody ships.
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "harness/cases/modelled.h"
#include "harness/cases/special_floats.h"
#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

// The model as its truth and laws call it (modelled.h).
double farthest(const DepthBuffer& depths, const Footprint& footprint) {
  return modelled("farthest", [&]<class T>() { return culling::farthest<T>(depths, footprint); });
}

Footprint whole(const uvec2& size) { return {{0, size.x}, {0, size.y}}; }

constexpr std::array<uint, 15> kSides = {1,   2,   3,   5,    7,    63,   64,  65,
                                         127, 767, 768, 1023, 1080, 1366, 4095};

TEST(CullingHizModel, LevelsAreHalvedDownToOnePixel) {
  EXPECT_EQ(levelSize(uvec2(1920, 1080), 1), uvec2(960, 540));
  EXPECT_EQ(levelSize(uvec2(1920, 1080), 4), uvec2(120, 67));
  EXPECT_EQ(levelSize(uvec2(1920, 1080), 10), uvec2(1, 1));
  EXPECT_EQ(levelSize(uvec2(3, 5), 1), uvec2(1, 2));
  EXPECT_EQ(levelCount({1, 1}), 0u);
  EXPECT_EQ(levelCount({1, 2}), 1u);
  EXPECT_EQ(levelCount({3, 5}), 2u);
  EXPECT_EQ(levelCount({1920, 1080}), 10u);
  EXPECT_EQ(levelCount({4096, 1}), 12u);
  EXPECT_EQ(levelCount({32767, 32767}), kMaxLevels);
}

// 7 columns make 3 texels, of which the last takes 3, and those make 1.
TEST(CullingHizModel, TheLastTexelTakesTheRest) {
  EXPECT_EQ(footprint(7, 1, 0), (Range{0, 2}));
  EXPECT_EQ(footprint(7, 1, 2), (Range{4, 7}));
  EXPECT_EQ(footprint(7, 2, 0), (Range{0, 7}));
  EXPECT_EQ(footprint(1, 5, 0), (Range{0, 1}));
}

TEST(CullingHizModel, EveryPixelIsInOneTexelOfEachLevel) {
  for (const uint side : kSides)
    for (uint level = 0; level <= levelCount({side, side}); ++level) {
      uint end = 0;
      for (uint texel = 0; texel < levelSize(side, level); ++texel) {
        const Range range = footprint(side, level, texel);
        EXPECT_EQ(range.begin, end) << side << ", level " << level << ", texel " << texel;
        EXPECT_FALSE(range.empty());
        end = range.end;
      }
      EXPECT_EQ(end, side) << "level " << level;
    }
}

// So that a level may be made from the one before it.
TEST(CullingHizModel, EveryTexelLiesInOneOfTheNextLevel) {
  for (const uint side : kSides)
    for (uint level = 0; level < levelCount({side, side}); ++level)
      for (uint texel = 0; texel < levelSize(side, level); ++texel) {
        const uint parent = std::min(texel / 2, levelSize(side, level + 1) - 1);
        const Range inner = footprint(side, level, texel),
                    outer = footprint(side, level + 1, parent);
        EXPECT_LE(outer.begin, inner.begin) << side << ", level " << level << ", texel " << texel;
        EXPECT_LE(inner.end, outer.end) << side << ", level " << level << ", texel " << texel;
      }
}

TEST(CullingHizModel, BadDepthsCountAsTheFarthest) {
  for (const float depth : specialFloats({1e-40f})) {
    const bool good = depth >= std::numeric_limits<float>::min() && depth < INFINITY;
    EXPECT_EQ(farthest({{1, 1}, {depth}}, whole({1, 1})), good ? depth : 0.0f);
    EXPECT_FALSE(std::signbit(farthest({{1, 1}, {depth}}, whole({1, 1}))));
    EXPECT_EQ(farthest({{2, 1}, {1, depth}}, whole({2, 1})), good ? std::min(depth, 1.0f) : 0.0f);
  }
}

TEST(CullingHizModel, AConstantStaysConstant) {
  const DepthBuffer depths = constantDepths({7, 5}, 0.375f);
  for (uint level = 1; level <= levelCount(depths.size); ++level)
    EXPECT_EQ(farthest(depths, footprint(depths.size, level, uvec2(0))), 0.375);
}

// Whichever pixel it is at.
TEST(CullingHizModel, TheTopIsTheGlobalMinimum) {
  const DepthBuffer depths = generatedDepths({21, 13}, caseSeed());
  const Footprint all = footprint(depths.size, levelCount(depths.size), uvec2(0));
  EXPECT_EQ(farthest(depths, all), *std::ranges::min_element(depths.depths));
  for (std::size_t i = 0; i < depths.depths.size(); ++i) {
    DepthBuffer lowered = constantDepths(depths.size, 0.75f);
    lowered.depths[i] = 0.5f;
    EXPECT_EQ(farthest(lowered, all), 0.5) << "pixel " << i;
  }
}

// Wherever the pixel is, it alone decides, and only in the texel that covers it.
TEST(CullingHizModel, LoweringADepthLowersTheTexelThatCoversIt) {
  const uvec2 size(7, 5);
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x) {
      DepthBuffer depths = constantDepths(size, 0.75f);
      depths.depths[y * size.x + x] = 0.5f;
      for (uint ty = 0; ty < 2; ++ty)
        for (uint tx = 0; tx < 3; ++tx) {
          const bool covers = std::min(x / 2, 2u) == tx && std::min(y / 2, 1u) == ty;
          EXPECT_EQ(farthest(depths, footprint(size, 1, {tx, ty})), covers ? 0.5 : 0.75)
              << "pixel (" << x << ", " << y << "), texel (" << tx << ", " << ty << ")";
        }
    }
}

/// Share of the pixels that no texel of a level has seen where odd columns and rows are dropped,
/// counted pixel by pixel: of each level those that are in the first 2 size(level) are halved.
double lostWithoutFolding(const uvec2& size, uint level) {
  const auto seen = [level](uint side) {
    uint count = 0;
    for (uint pixel = 0; pixel < side; ++pixel) {
      bool kept = true;
      for (uint l = 1; l <= level; ++l)
        kept &= (pixel >> l) < levelSize(side, l) || levelSize(side, l - 1) == 1;
      count += kept;
    }
    return static_cast<double>(count);
  };
  return 1 - seen(size.x) * seen(size.y) / (static_cast<double>(size.x) * size.y);
}

// As published for pyramids that halve without folding, to the digits given.
TEST(CullingHizModel, WithoutFoldingPixelsAreLost) {
  EXPECT_NEAR(lostWithoutFolding({1920, 1080}, 4), 0.0074, 5e-5);
  EXPECT_NEAR(lostWithoutFolding({1920, 1080}, 6), 0.052, 5e-4);
  EXPECT_NEAR(lostWithoutFolding({1920, 1080}, 8), 0.115, 5e-4);
  EXPECT_NEAR(lostWithoutFolding({1366, 768}, 2), 0.0015, 5e-5);
  EXPECT_NEAR(lostWithoutFolding({1023, 767}, 1), 0.0023, 5e-5);
  EXPECT_NEAR(lostWithoutFolding({800, 600}, 4), 0.013, 5e-4);
}

constexpr std::array kLookups = {Lookup::kPinned, Lookup::kFold3, Lookup::kNextPow2,
                                 Lookup::kPreviousPow2};

TEST(CullingHizModel, EveryPixelIsSeenWhereALookupFindsIt) {
  for (const Lookup lookup : kLookups)
    for (const uint side : kSides) {
      const PyramidShape shape(lookup, {side, 1});
      const LookupAxis axis{lookup, side};
      for (uint element = 0; element < shape.elements(); ++element)
        for (uint pixel = 0; pixel < side; ++pixel) {
          const uint texel = axis.texelOf(element, pixel);
          const Range own = axis.own(element, texel), most = axis.most(element, texel);
          ASSERT_LT(texel, axis.size(element));
          ASSERT_TRUE(own.begin <= pixel && pixel < own.end)
              << nameOf(lookup) << ", side " << side << ", element " << element << ", pixel "
              << pixel;
          ASSERT_TRUE(most.begin <= own.begin && own.end <= most.end && most.end <= side);
        }
    }
}

TEST(CullingHizModel, EveryPyramidEndsInOneTexelThatHasSeenAll) {
  for (const Lookup lookup : kLookups)
    for (const uint side : kSides) {
      const PyramidShape shape(lookup, {side, 1});
      if (shape.elements() == 0) continue;
      const uint top = shape.elements() - 1;
      EXPECT_EQ(shape.size(top), uvec2(1)) << nameOf(lookup) << ", side " << side;
      EXPECT_EQ(shape.own(top, uvec2(0)), whole({side, 1})) << nameOf(lookup) << ", side " << side;
    }
}

// The pixels of a texel are of no other: what it may have seen is at most a texel or, at the base,
// a pixel more.
TEST(CullingHizModel, OtherPyramidsSeeLittleMoreThanTheirOwn) {
  for (const Lookup lookup : kLookups)
    for (const uint side : kSides) {
      const PyramidShape shape(lookup, {side, 1});
      const LookupAxis axis{lookup, side};
      for (uint element = 0; element < shape.elements(); ++element)
        for (uint texel = 0; texel < axis.size(element); ++texel) {
          const Range own = axis.own(element, texel), most = axis.most(element, texel);
          if (own.empty()) continue;
          const uint more = (own.begin - most.begin) + (most.end - own.end);
          const uint allowed = lookup == Lookup::kFold3          ? (2u << element) - 1
                               : lookup == Lookup::kPreviousPow2 ? 2
                                                                 : 0;
          EXPECT_LE(more, allowed) << nameOf(lookup) << ", side " << side << ", element " << element
                                   << ", texel " << texel;
        }
    }
}

// 1920 columns onto 1024 texels, 1.875 a texel. Texel 1 has its centre at 2.8125 pixels, between
// the centres of 2 and 3, and from 1.875 to 3.75 holds both; texel 0 has it at 0.9375 and to 1.875
// both of 0 and 1; texel 7 has it at 14.0625, between 13 and 14, and from 13.125 to 15 both.
TEST(CullingHizModel, APreviousPowerOfTwoTakesTwoPixels) {
  const LookupAxis axis{Lookup::kPreviousPow2, 1920};
  EXPECT_EQ(axis.size(0), 1024u);
  for (const auto& [texel, taps] : {std::pair(0u, Range{0, 2}), {1u, {2, 4}}, {7u, {13, 15}}}) {
    EXPECT_EQ(axis.most(0, texel), taps) << texel;
    EXPECT_EQ(axis.own(0, texel), taps) << texel;
  }
  EXPECT_EQ(axis.texelOf(0, 2), 1u);
  EXPECT_EQ(axis.texelOf(3, 1919), 127u);
}

TEST(CullingHizModel, QueriesTakeTheLevelOfTheLongerSide) {
  const PyramidShape shape(Lookup::kPinned, {1920, 1080});
  EXPECT_EQ(shape.elementFor({5, 5}, {5, 5}), std::nullopt);
  EXPECT_EQ(shape.elementFor({5, 5}, {6, 5}), 0u);
  EXPECT_EQ(shape.elementFor({5, 5}, {7, 5}), 1u);
  EXPECT_EQ(shape.elementFor({5, 5}, {8, 5}), 1u);
  EXPECT_EQ(shape.elementFor({5, 5}, {5, 9}), 2u);
  EXPECT_EQ(shape.elementFor({0, 0}, {1919, 1079}), 9u);  // 2^11 would be a level that there is not
}

}  // namespace
}  // namespace gnomon::culling
