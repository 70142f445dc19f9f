// culling/hiz_level: one level of the pyramid, and a chain of it, against the model.
//
// Covered: every texel to the bit, of one level and of chains that end at 1 x 1, each level made
// from what the kernel made before and compared with the model at full resolution; sizes that are
// odd at several levels, of one row or column, around a group; frames; single holes; bad depths;
// D32 as a frame has it. The laws stand in hiz_laws_test.cpp.
#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

class CullingHizLevel : public HizLevelCase {};

// Around a group of the level, odd and even, and down to a single pixel.
TEST_F(CullingHizLevel, EverySizeIsExact) {
  for (const uvec2 size :
       {uvec2(1, 1), uvec2(1, 2), uvec2(2, 1), uvec2(1, 7), uvec2(3, 5), uvec2(2 * kHizGroupSide),
        uvec2(2 * kHizGroupSide + 1, 2 * kHizGroupSide - 1),
        uvec2(2 * kHizGroupSide + 2, 2 * kHizGroupSide + 3), uvec2(131, 77)})
    expectEveryTexelOfOneLevel(generatedDepths(size, caseSeed() + size.x));
}

TEST_F(CullingHizLevel, ChainsOfOddSizesAreExact) {
  for (const uvec2 size : {uvec2(1, 7), uvec2(3, 5), uvec2(1023, 767), uvec2(4095, 1)})
    expectEveryTexelOfTheChain(generatedDepths(size, caseSeed() + size.x),
                               size.x < 1000 ? Effort::kWatched : Effort::kOnce);
}

TEST_F(CullingHizLevel, ChainsOfFramesAreExact) {
  for (const uvec2 size : {uvec2(1366, 768), uvec2(1920, 1080), uvec2(3840, 2160)})
    expectEveryTexelOfTheChain(generatedDepths(size, caseSeed() + size.x), Effort::kOnce);
}

TEST_F(CullingHizLevel, AHoleOfOnePixelIsSeenWhereverItIs) {
  expectEveryTexelOfTheChain(holedDepths({187, 59}, caseSeed()), Effort::kWatched);
}

TEST_F(CullingHizLevel, BadDepthsCountAsTheContractSays) {
  const DepthBuffer depths = specialDepths();
  expectEveryTexelOfOneLevel(depths);
  expectNoNegativeZeros(dispatch(depths, shapeOf(depths.size).size(0)), "level");
}

TEST_F(CullingHizLevel, ADepthBufferIsReadAsItIs) {
  const DepthBuffer depths = generatedDepths({65, 33}, caseSeed());
  expectConforms(
      dispatch(depths, shapeOf(depths.size).size(0), Effort::kWatched, PixelFormat::kD32),
      modelOf("level", depths, 0, 1));
}

TEST_F(CullingHizLevel, TexelsBeyondTheSizeAreNotTouched) {
  if (lookup() == Lookup::kPreviousPow2)
    GTEST_SKIP() << "the size of its first level follows from the image alone";
  for (const uvec2 size : {uvec2(2 * kHizGroupSide + 5, 7), uvec2(7, 2 * kHizGroupSide + 5)}) {
    const DepthBuffer depths = generatedDepths(size, caseSeed());
    expectClean(dispatch(depths, shapeOf(size).size(0), Effort::kWatched, PixelFormat::kR32f,
                         kHizGroupSide));
    checked(std::size_t{size.x} * size.y);
  }
}

}  // namespace
}  // namespace gnomon::culling
