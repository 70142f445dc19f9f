// culling/hiz: all levels of the pyramid in one dispatch.
//
// Covered: every texel to the bit, as in hiz_level_test.cpp, and here at sizes around a tile, with
// tiles that take up to 127 pixels a side, and so many of them that the last group makes a second
// round; an image without levels; scratch left as it was (hygiene). Frames were watched as small
// images. Not covered: images beyond 16384 pixels a side.
#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

class CullingHiz : public HizCase {};

constexpr uint kTile = 1u << kHizTile;

TEST_F(CullingHiz, EverySizeIsExact) {
  widthDoesNotMatter();
  for (const uvec2 size : {uvec2(1, 7), uvec2(3, 5), uvec2(31, 62)})
    expectEveryTexel(generatedDepths(size, caseSeed() + size.x));
}

// Whole tiles, tiles with a rest, and a last group with work for all of its threads.
TEST_F(CullingHiz, SubgroupsOfEveryWidthMakeTheSamePyramid) {
  for (const uvec2 size : {uvec2(3 * kTile + 1, 2 * kTile + 5), uvec2(8256, 3)})
    expectEveryTexel(generatedDepths(size, caseSeed() + size.x));
}

// One tile or two, the last of which takes the rest of its row or column.
TEST_F(CullingHiz, EverySizeAroundATileIsExact) {
  widthDoesNotMatter();
  for (const uvec2 size :
       {uvec2(kTile - 1, kTile), uvec2(kTile), uvec2(kTile + 1, 2 * kTile - 1), uvec2(2 * kTile, 1),
        uvec2(2 * kTile - 1), uvec2(2 * kTile + 1, 3 * kTile - 1)})
    expectEveryTexel(generatedDepths(size, caseSeed() + size.x));
}

// More tiles than one tile has texels: 129 and 192 a row, and 127, which one more tile takes.
// The last group has work for all of its threads there, so that the order of them shows.
TEST_F(CullingHiz, LevelsAboveTheSecondTileAreExact) {
  widthDoesNotMatter();
  for (const uvec2 size : {uvec2(8256, 3), uvec2(3, 12351), uvec2(16384, 1)})
    expectEveryTexel(generatedDepths(size, caseSeed() + size.x));
  expectEveryTexelAtOnce(generatedDepths({8128, 65}, caseSeed()));
}

TEST_F(CullingHiz, OddSizesAreExact) {
  for (const uvec2 size : {uvec2(1023, 767), uvec2(4095, 1)})
    expectEveryTexelAtOnce(generatedDepths(size, caseSeed() + size.x));
}

TEST_F(CullingHiz, FramesAreExact) {
  widthDoesNotMatter();
  for (const uvec2 size : {uvec2(1366, 768), uvec2(1920, 1080), uvec2(3840, 2160)})
    expectEveryTexelAtOnce(generatedDepths(size, caseSeed() + size.x));
}

TEST_F(CullingHiz, AHoleOfOnePixelIsSeenWhereverItIs) {
  widthDoesNotMatter();
  expectEveryTexel(holedDepths({187, 59}, caseSeed()));
}

TEST_F(CullingHiz, BadDepthsCountAsTheContractSays) {
  widthDoesNotMatter();
  const DepthBuffer depths = specialDepths();
  expectEveryTexel(depths);
  expectNoNegativeZeros(dispatch(depths), "levels");
}

// Hygiene finds the only texel that it is given unwritten, and nothing else.
TEST_F(CullingHiz, ASinglePixelHasNoLevels) {
  widthDoesNotMatter();
  const DepthBuffer pixel = constantDepths({1, 1}, 0.5f);
  if (shapeOf(pixel.size).elements() > 0) GTEST_SKIP() << "another pyramid may have one";
  const Observation seen = dispatch(pixel);
  for (const std::string& finding : seen.findings)
    EXPECT_NE(finding.find("left 1 of 1 words of 'levels' unwritten"), std::string::npos)
        << finding;
  EXPECT_FALSE(seen.findings.empty());
  checked(1);
}

TEST_F(CullingHiz, ADepthBufferIsReadAsItIs) {
  widthDoesNotMatter();
  const DepthBuffer depths = generatedDepths({65, 33}, caseSeed());
  expectConforms(dispatch(depths, Effort::kWatched, PixelFormat::kD32), modelOfAll(depths));
}

}  // namespace
}  // namespace gnomon::culling
