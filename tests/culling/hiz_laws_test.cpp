// Laws of the depth pyramid, of culling/hiz and of chains of culling/hiz_level alike, whatever way
// it is addressed.
//
// Covered: constants, the top, lowering a depth, mirrors, levels as depth buffers, queries of
// rectangles. Not covered: what a query culls (occlusion).
#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

class CullingHizLaws : public HizCase {
 protected:
  void SetUp() override {
    HizCase::SetUp();
    widthDoesNotMatter();
  }
};
class CullingHizLevelLaws : public HizLevelCase {};

TEST_F(CullingHizLaws, AConstantStaysConstant) { aConstantStaysConstant(); }
TEST_F(CullingHizLevelLaws, AConstantStaysConstant) { aConstantStaysConstant(); }

TEST_F(CullingHizLaws, TheTopIsTheGlobalMinimum) { theTopIsTheGlobalMinimum(); }
TEST_F(CullingHizLevelLaws, TheTopIsTheGlobalMinimum) { theTopIsTheGlobalMinimum(); }

TEST_F(CullingHizLaws, LoweringADepthRaisesNoTexel) { loweringADepthRaisesNoTexel(); }
TEST_F(CullingHizLevelLaws, LoweringADepthRaisesNoTexel) { loweringADepthRaisesNoTexel(); }

TEST_F(CullingHizLaws, MirroringMirrorsEveryLevel) { mirroringMirrorsEveryLevel(); }
TEST_F(CullingHizLevelLaws, MirroringMirrorsEveryLevel) { mirroringMirrorsEveryLevel(); }

TEST_F(CullingHizLaws, ALevelHasTheLevelsAboveItForItsPyramid) {
  aLevelHasTheLevelsAboveItForItsPyramid();
}
TEST_F(CullingHizLevelLaws, ALevelHasTheLevelsAboveItForItsPyramid) {
  aLevelHasTheLevelsAboveItForItsPyramid();
}

TEST_F(CullingHizLaws, NoQueryIsNearerThanADepthInIt) { noQueryIsNearerThanADepthInIt(); }
TEST_F(CullingHizLevelLaws, NoQueryIsNearerThanADepthInIt) { noQueryIsNearerThanADepthInIt(); }

}  // namespace
}  // namespace gnomon::culling
