// What the cases of the depth pyramid share: depth buffers, and the fixture that makes a pyramid of
// one with culling/hiz or with a chain of culling/hiz_level.
#pragma once

#include <memory>
#include <vector>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "reference/culling/hiz.h"
#include "reference/culling/hiz_lookup.h"

namespace gnomon::culling {

/// Elements of `levels`, rows from the top.
using Pyramid = std::vector<std::vector<float>>;

/// Depths as a frame has them, log-uniform over four decades; the upper twentieth is sky.
DepthBuffer generatedDepths(const uvec2& size, std::uint64_t seed);

/// A buffer of one depth.
DepthBuffer constantDepths(const uvec2& size, float depth);

/// The same near depth but for single pixels, each of a depth of its own: in the corners, along the
/// last row and column and anywhere.
DepthBuffer holedDepths(const uvec2& size, std::uint64_t seed);

/// Every special float beside every other one, of which the bad ones count as 0; both sides odd.
DepthBuffer specialDepths();

/// What is generated for culling/hiz, and what is for culling/hiz_level.
struct HizInput {
  Hiz push;
  Picture depth;
};
struct LevelInput {
  HizLevel push;
  Picture parent;
};
void parts(Parts& p, HizInput& input);
bool admits(const HizInput& input);
void parts(Parts& p, LevelInput& input);

Picture pictureOf(const DepthBuffer& buffer);
DepthBuffer depthsOf(const Picture& picture);

/// How much a run is watched: a big one was watched as a small one.
enum class Effort { kWatched, kOnce };

class PyramidCase : public KernelCase {
 protected:
  using KernelCase::KernelCase;

  /// Elements of the kernel under test, as it says that it is addressed.
  Lookup lookup() const;
  PyramidShape shapeOf(const uvec2& size) const { return {lookup(), size}; }

  /// Each texel of these elements is the farthest of the pixels that it covers; of a pyramid that
  /// is addressed otherwise than ours, farther than none that a query finds there, and not farther
  /// than all that it may have seen.
  Expectation modelOf(const std::string& output, DepthBuffer depths, uint firstElement,
                      uint elements) const;

  /// Runs the kernel, or its chain. Hygiene's findings fail the case.
  virtual Pyramid pyramidOf(const DepthBuffer& depths) = 0;

  /// -0 is 0, which a comparison of numbers does not see.
  static void expectNoNegativeZeros(const Observation& seen, const std::string& output);

  /// run(), or the strict twin once.
  Observation runWith(Effort effort, const Stimulus& stimulus);

  // Laws, of whichever makes the pyramid.
  void aConstantStaysConstant();
  void theTopIsTheGlobalMinimum();
  void loweringADepthRaisesNoTexel();
  void mirroringMirrorsEveryLevel();
  void aLevelHasTheLevelsAboveItForItsPyramid();
  void noQueryIsNearerThanADepthInIt();
};

/// The whole pyramid in one dispatch.
class HizCase : public PyramidCase {
 protected:
  HizCase() : PyramidCase("culling/hiz") {}

  Observation dispatch(const DepthBuffer& depths, Effort effort = Effort::kWatched,
                       PixelFormat format = PixelFormat::kR32f);
  Expectation modelOfAll(DepthBuffer depths) const;
  void expectEveryTexel(const DepthBuffer& depths);
  /// Of a big one.
  void expectEveryTexelAtOnce(const DepthBuffer& depths);
  Pyramid pyramidOf(const DepthBuffer& depths) override;
};

/// Level by level.
class HizLevelCase : public PyramidCase {
 protected:
  HizLevelCase() : PyramidCase("culling/hiz_level") {}

  Observation dispatch(const DepthBuffer& parent, const uvec2& size,
                       Effort effort = Effort::kWatched, PixelFormat format = PixelFormat::kR32f,
                       unsigned beyond = 0);
  void expectEveryTexelOfOneLevel(const DepthBuffer& parent);
  /// The chain from the depth buffer to its end, each level from what the kernel has made before.
  void expectEveryTexelOfTheChain(const DepthBuffer& depths, Effort effort);
  Pyramid pyramidOf(const DepthBuffer& depths) override;
};

}  // namespace gnomon::culling
