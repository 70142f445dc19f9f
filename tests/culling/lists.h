// What the cases of frustum and occlusion have in common: inputs, dispatches, and lists as sets.
#pragma once

#include <vector>

#include "harness/cases/kernel_case.h"
#include "kernels/culling/culling.h"
#include "reference/culling/occlusion.h"
#include "tests/culling/scenes.h"

namespace gnomon::culling {

/// So often that a group that asks is answered: another one has started and needs microseconds.
inline constexpr uint kForever = ~0u;

/// What frustum is given.
struct FrustumInput {
  std::vector<Camera> camera{};  ///< one
  std::vector<Bounds> bounds{};
  Frustum push{0, 0, 0, 0, kForever};
  std::vector<DrawCommand> commands{};  ///< follow from the number of bounds
};

/// As many draws fit as there are objects.
FrustumInput frustumInput(const Camera& camera, std::vector<Bounds> bounds, float pad = 0);
void parts(Parts& p, FrustumInput& input);
bool admits(const FrustumInput& input);

/// What occlusion is given: every `stride`-th object is a survivor of the frustum.
struct OcclusionInput {
  std::vector<Camera> camera{};  ///< one
  std::vector<Bounds> bounds{};
  Picture depth{};
  Occlusion push{{1, 1}, 0, 0, 0, 0, kForever};
  uint stride = 1;
};

OcclusionInput occlusionInput(const Camera& camera, std::vector<Bounds> bounds, Picture depth,
                              float pad = 0);
void parts(Parts& p, OcclusionInput& input);
bool admits(const OcclusionInput& input);

/// Bytes that a dispatch is given; made of an input, which it must not outlive.
struct FrustumStimulus {
  explicit FrustumStimulus(FrustumInput& input);
  Stimulus stimulus;
};
class OcclusionStimulus {
 public:
  explicit OcclusionStimulus(OcclusionInput& input);
  OcclusionStimulus(const OcclusionStimulus&) = delete;
  OcclusionStimulus& operator=(const OcclusionStimulus&) = delete;

  Stimulus stimulus{};
  std::vector<DrawCommand> survivors{};
  Pyramid pyramid{};

 private:
  std::vector<Tally> found;
  std::vector<float> levels;
};

/// The fixture of all four entries. "visible" is the output of an observation that says for every
/// candidate whether it is listed.
class ListCase : public KernelCase {
 protected:
  using KernelCase::KernelCase;

  /// Runs, and reads the list as a set.
  Trial judged(FrustumInput& input);
  Trial judged(OcclusionInput& input);

  void expectRightList(FrustumInput input) {
    expectConformsOn(std::move(input), [this](FrustumInput& i) { return judged(i); });
  }
  void expectRightList(OcclusionInput input) {
    expectConformsOn(std::move(input), [this](OcclusionInput& i) { return judged(i); });
  }

  /// The tally, number by number; `recounted` is what the patience leaves.
  void expectRightTally(FrustumInput input, uint recounted);
  void expectRightTally(OcclusionInput input, uint recounted);

  /// What is visible, for laws: findings of hygiene fail the case.
  std::vector<bool> visible(FrustumInput input);
  std::vector<bool> visible(OcclusionInput input);

  /// The same in one run without any check, for the many scenes of a truth.
  std::vector<bool> quicklyVisible(FrustumInput input);
  std::vector<bool> quicklyVisible(OcclusionInput input);

 private:
  std::vector<bool> readList(const std::map<std::string, std::vector<std::byte>>& outputs,
                             std::size_t candidates, uint stride) const;
};

/// How many blocks have to be counted again where nobody is asked: all before each.
uint allRecounted(std::size_t candidates);

/// Spheres of every size in and around what a scene's camera sees.
std::vector<Bounds> spheresAround(const Scene& scene, std::size_t n, std::uint64_t seed);

}  // namespace gnomon::culling
