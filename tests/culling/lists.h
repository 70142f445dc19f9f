// What the cases of frustum and occlusion have in common: inputs, dispatches, and lists as sets.
#pragma once

#include <vector>

#include "harness/cases/kernel_case.h"
#include "kernels/culling/culling.h"
#include "reference/culling/occlusion.h"
#include "tests/culling/scenes.h"

namespace gnomon::culling {

/// What frustum is given, and groups beyond those that have a block.
struct FrustumInput {
  std::vector<Camera> camera{};  ///< one
  std::vector<Bounds> bounds{};
  Frustum push{0, 0, 0, 0, kPatience};
  std::vector<DrawCommand> commands{};  ///< follow from the number of bounds
  uint idleGroups = 0;
};

/// As many draws fit as there are objects.
FrustumInput frustumInput(const Camera& camera, std::vector<Bounds> bounds, float pad = 0);
void parts(Parts& p, FrustumInput& input);
bool admits(const FrustumInput& input);

/// What occlusion is given: every `stride`-th object is a survivor of the frustum. Behind the list
/// of survivors there may be draws that nobody has listed, as where the list was full; and the
/// frustum may have listed more than there is room for.
struct OcclusionInput {
  std::vector<Camera> camera{};  ///< one
  std::vector<Bounds> bounds{};
  Picture depth{};
  Occlusion push{{1, 1}, 0, 0, 0, 0, kPatience};
  uint stride = 1, behind = 0, lacking = 0;
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
  std::vector<DrawCommand> given;  ///< the survivors, and what is behind them
  std::vector<float> levels;
};

/// Candidates of more blocks than a group has threads, the last block with one.
constexpr std::size_t kMoreThanThreads = (kGroupSize + 2) * std::size_t{kBlock} + 1;

/// The fixture of all four entries. "visible" is the output of an observation that says for every
/// candidate whether it is listed.
class ListCase : public KernelCase {
 protected:
  using KernelCase::KernelCase;

  /// Runs, and reads the list as a set.
  Trial judged(FrustumInput& input);
  Trial judged(OcclusionInput& input);

  /// A finding where a kernel that keeps more keeps most of what it has to cull. Laws do not ask:
  /// what a looser kernel has left may be all that it would cull.
  Trial notLoose(Trial trial) const;

  void expectRightList(FrustumInput input) {
    expectConformsOn(std::move(input), [this](FrustumInput& i) { return notLoose(judged(i)); });
  }
  void expectRightList(OcclusionInput input) {
    expectConformsOn(std::move(input), [this](OcclusionInput& i) { return notLoose(judged(i)); });
  }

  /// The tally, number by number.
  void expectRightTally(FrustumInput input);
  void expectRightTally(OcclusionInput input);

  /// That groups which ask are answered: of some runs one in which no block is counted again. A
  /// group may be kept waiting while the machine does something else, but not always.
  void expectAnswers(FrustumInput input);
  void expectAnswers(OcclusionInput input);

  /// That each third candidate, from the first on, is visible and no other.
  void expectEveryThird(const std::vector<bool>& kept);

  /// What is visible, for laws: findings of hygiene fail the case.
  std::vector<bool> visible(FrustumInput input);
  std::vector<bool> visible(OcclusionInput input);

  /// The same in one run without any check, for the many scenes of a truth.
  std::vector<bool> quicklyVisible(FrustumInput input);
  std::vector<bool> quicklyVisible(OcclusionInput input);

 private:
  void expectAnswersTo(const Stimulus& stimulus);
  std::vector<bool> readList(const std::map<std::string, std::vector<std::byte>>& outputs,
                             std::size_t candidates, uint stride) const;
};

/// Spheres of every size in and around what a scene's camera sees.
std::vector<Bounds> spheresAround(const Scene& scene, std::size_t n, std::uint64_t seed);

}  // namespace gnomon::culling
