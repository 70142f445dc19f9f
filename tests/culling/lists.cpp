#include "tests/culling/lists.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "harness/cases/random.h"
#include "harness/verdict/list.h"
#include "reference/culling/frustum.h"

namespace gnomon::culling {
namespace {

std::size_t blocksOf(std::size_t candidates) {
  return std::max<std::size_t>((candidates + kBlock - 1) / kBlock, 1);
}

std::string describe(const Bounds& b) {
  return fmt::format("    centre ({:.9g}, {:.9g}, {:.9g})\n    radius {:.9g}\n", b.centre.x,
                     b.centre.y, b.centre.z, b.radius);
}

template <class T>
T membership(const FrustumInput& input, std::size_t i) {
  return inFrustum<T>(input.camera[0], input.bounds[i], input.push);
}

struct OcclusionModel {
  const OcclusionInput& input;
  Pyramid pyramid;
  std::vector<DrawCommand> survivors;

  template <class T>
  T membership(std::size_t i) const {
    const uint object = survivors[i].firstInstance;
    if (object >= input.push.objects) return T(1);
    return unoccluded<T>(input.camera[0], input.bounds[object], input.push, pyramid);
  }
};

/// A tally of the contract in a model's numbers.
template <class T>
struct Counts {
  T tested{}, total{}, listed{}, overflowed{}, recounted{};
  auto scalars() { return std::tie(tested, total, listed, overflowed, recounted); }
};

bool isForeign(const std::string& kernel) {
  return Session::current().options().kernels.contains(kernel);
}

/// Whether a kernel of a user's says that it keeps more than the contract does.
bool keepsMore(const std::string& kernel) {
  const auto& conventions = Session::current().subject(kernel).conventions();
  const auto said = conventions.find("keeps");
  return said != conventions.end() && said->second == "more";
}

Bounded withValue(Bounded x, const Bounded& of) {
  x.value = of.value;
  return x;
}

/// What a tally is made of.
struct Totals {
  std::size_t candidates = 0;
  uint capacity = 0, patience = 0;
  Tally said{};          ///< by the kernel
  bool foreign = false;  ///< may count again as it likes
  bool more = false;     ///< may keep more

  /// Blocks that are counted again where nobody is asked: all before each.
  uint allBlocks() const {
    const auto blocks = static_cast<uint>(blocksOf(candidates));
    return blocks * (blocks - 1) / 2;
  }
};

double leastOf(double x) { return x; }
double leastOf(const Bounded& x) { return x.lo; }

/// Blocks that are counted again: all of them without patience, at most all with it.
uint recountedOf(const Totals& totals) {
  const uint said = totals.said.recounted, all = totals.allBlocks();
  if (totals.foreign) return said;
  return totals.patience == 0 ? all : std::min(said, all);  // timing's, where there was patience
}

/// How often blocks are counted again is timing: the module as it is may say another number than
/// its twin did, up to all. Judged so, it is set to the twin's.
void judgeTiming(const Totals& totals, Observation& seen) {
  if (!seen.applies || totals.patience == 0) return;
  Tally plain = elementsOf<Tally>(seen.plain.at("tally"))[0];
  if (!totals.foreign) {
    EXPECT_LE(plain.recounted, totals.allBlocks());
  }
  plain.recounted = totals.said.recounted;
  std::ranges::copy(std::as_bytes(std::span(&plain, 1)), seen.plain.at("tally").begin());
}

/// `member` says of one candidate whether it is visible, 1 or 0; of bounds both.
template <class T, class Member>
Counts<T> countsOf(const Totals& totals, const Member& member) {
  T total = T(0);
  for (std::size_t i = 0; i < totals.candidates; ++i)
    total = total + member.template operator()<T>(i);
  if (totals.more) total = T(std::max(totals.said.total, static_cast<uint>(leastOf(total))));
  const T most = T(totals.capacity);
  return {T(static_cast<uint>(totals.candidates)), total, min(total, most),
          select(total > most, T(1), T(0)), T(recountedOf(totals))};
}

template <class Member>
Expectation tallyOf(const Totals& totals, Member member) {
  return expectationOf(
      "tally", 1, [=]<class T>(std::size_t) { return countsOf<T>(totals, member); },
      [=](std::size_t) { return fmt::format("    {} candidates\n", totals.candidates); });
}

/// A kernel that says so may keep more, since nothing visible is lost by it: what need not be
/// listed may be.
void allowMore(Expectation& visible) {
  visible.bounded = [ours = visible.bounded](std::size_t i, std::span<Bounded> out) {
    ours(i, out);
    out[0] = withValue(Bounded::between(out[0].lo, 1), out[0]);
  };
}

/// But it has to cull most of what ours does.
void refuseTheLoose(const Expectation& visible, Observation& seen) {
  const auto flags = elementsOf<uint>(seen.twin.at("visible"));
  std::size_t hidden = 0, kept = 0;
  for (std::size_t i = 0; i < visible.elements; ++i) {
    double model = 0;
    visible.plain(i, {&model, 1});
    hidden += model == 0;
    kept += model == 0 && flags[i] == 1;
  }
  constexpr std::size_t kFew = 64;  // of which a share says little
  const double loosest = Session::current().policy()["cullingLoosest"];
  if (hidden < kFew || static_cast<double>(kept) <= loosest * static_cast<double>(hidden)) return;
  seen.findings.push_back(
      fmt::format("it keeps {} of {} candidates that the contract culls; at most {} may be kept",
                  kept, hidden, static_cast<std::size_t>(loosest * static_cast<double>(hidden))));
}

Trial asJudged(Observation seen, Expectation visible, const std::string& kernel) {
  if (seen.applies && keepsMore(kernel)) allowMore(visible);
  return {std::move(seen), std::move(visible)};
}

Tally tallyBy(const Observation& seen) {
  return seen.applies ? elementsOf<Tally>(seen.twin.at("tally"))[0] : Tally{};
}

/// The levels from the first on, as an image has them; one texel where there are none.
std::vector<float> mipsOf(const Pyramid& pyramid) {
  std::vector<float> texels;
  for (std::size_t level = 1; level < pyramid.levels.size(); ++level)
    texels.insert(texels.end(), pyramid.levels[level].begin(), pyramid.levels[level].end());
  if (texels.empty()) texels.push_back(pyramid.levels[0][0]);
  return texels;
}

/// Draws that do not know which object they are of: the kernel has to say.
std::vector<DrawCommand> unnumbered(std::size_t objects) {
  std::vector<DrawCommand> commands = commandsFor(objects);
  for (DrawCommand& c : commands) c.firstInstance = ~c.firstInstance;
  return commands;
}

}  // namespace

FrustumInput frustumInput(const Camera& camera, std::vector<Bounds> bounds, float pad) {
  const auto n = static_cast<uint>(bounds.size());
  return {.camera = {camera},
          .bounds = std::move(bounds),
          .push = {.count = n, .capacity = n, .noNearPlane = 0, .pad = pad, .patience = kPatience},
          .commands = unnumbered(n)};
}

void parts(Parts& p, FrustumInput& input) {
  p.push(input.push);
  p.elements("camera", input.camera);
  p.elements("bounds", input.bounds);
  p.count(input.push.count, "bounds");
}

bool admits(const FrustumInput& input) {
  return input.camera.size() == 1 && input.push.pad >= 0 && input.camera[0].near > 0;
}

OcclusionInput occlusionInput(const Camera& camera, std::vector<Bounds> bounds, Picture depth,
                              float pad) {
  const auto n = static_cast<uint>(bounds.size());
  const uvec2 size = depth.size;
  return {.camera = {camera},
          .bounds = std::move(bounds),
          .depth = std::move(depth),
          .push = {.size = size,
                   .objects = n,
                   .candidates = n,
                   .capacity = n,
                   .pad = pad,
                   .patience = kPatience}};
}

void parts(Parts& p, OcclusionInput& input) {
  p.push(input.push);
  p.elements("camera", input.camera);
  p.elements("bounds", input.bounds);
  p.imageOfExtent("depth", input.depth);
  p.extent(input.push.size);
  p.count(input.push.objects, "bounds");
}

bool admits(const OcclusionInput& input) {
  return input.camera.size() == 1 && input.push.pad >= 0 && input.camera[0].near > 0;
}

FrustumStimulus::FrustumStimulus(FrustumInput& input) {
  if (input.commands.size() != input.bounds.size())
    input.commands = unnumbered(input.bounds.size());
  stimulus = {.inputs = {{"camera", std::as_bytes(std::span(input.camera))},
                         {"bounds", std::as_bytes(std::span(input.bounds))},
                         {"commands", std::as_bytes(std::span(input.commands))}},
              .outputs = {{"draws", input.push.capacity, /*list=*/true}, {"tally", 1}},
              .scratch = {{"scratch", kBlocks + blocksOf(input.bounds.size())}},
              .push = std::as_bytes(std::span(&input.push, 1)),
              .extent = {input.bounds.size() + std::size_t{input.idleGroups} * kBlock}};
}

OcclusionStimulus::OcclusionStimulus(OcclusionInput& input)
    : pyramid(pyramidOf(input.depth)), levels(mipsOf(pyramid)) {
  const std::vector<DrawCommand> all = commandsFor(input.bounds.size());
  for (std::size_t i = 0; i < all.size(); i += input.stride) survivors.push_back(all[i]);
  const auto n = static_cast<uint>(survivors.size());
  input.push.candidates = n + input.behind;
  const std::vector<DrawCommand> unfound(input.behind, {36, 1, 0, 0, 0});
  given = survivors;
  given.insert(given.end(), unfound.begin(), unfound.end());
  found = {{.tested = input.push.objects,
            .total = n + input.behind + input.lacking,
            .listed = n + input.lacking,
            .overflowed = input.behind > 0,
            .recounted = 0}};
  const uvec2 size = max(input.push.size / 2u, uvec2(1));
  const auto mips = static_cast<unsigned>(std::max<std::size_t>(pyramid.levels.size() - 1, 1));
  stimulus = {.inputs = {{"camera", std::as_bytes(std::span(input.camera))},
                         {"bounds", std::as_bytes(std::span(input.bounds))},
                         {"survivors", std::as_bytes(std::span(given))},
                         {"found", std::as_bytes(std::span(found))}},
              .outputs = {{"draws", input.push.capacity, /*list=*/true}, {"tally", 1}},
              .scratch = {{"scratch", kBlocks + blocksOf(given.size())}},
              .inputImages = {floatImage("depth", input.depth),
                              {.image = "pyramid",
                               .description = {.format = PixelFormat::kR32f,
                                               .width = size.x,
                                               .height = size.y,
                                               .mips = mips},
                               .texels = std::as_bytes(std::span(levels))}},
              .push = std::as_bytes(std::span(&input.push, 1)),
              .extent = {given.size()}};
}

Trial ListCase::notLoose(Trial trial) const {
  if (trial.seen.applies && keepsMore(kernelName)) refuseTheLoose(trial.expected, trial.seen);
  return trial;
}

Trial ListCase::judged(FrustumInput& input) {
  const FrustumStimulus given(input);
  Observation seen = run(given.stimulus);
  const KernelRecord& record = Session::current().subject(kernelName).record();
  const std::size_t decided = !seen.applies ? 0
                                            : decodeList(record, record.list("visible"),
                                                         std::as_bytes(std::span(input.commands)),
                                                         input.push.capacity, seen);
  return asJudged(
      std::move(seen),
      expectationOf(
          "visible", decided, [&input]<class T>(std::size_t i) { return membership<T>(input, i); },
          [&input](std::size_t i) { return describe(input.bounds[i]); }),
      kernelName);
}

Trial ListCase::judged(OcclusionInput& input) {
  OcclusionStimulus given(input);
  Observation seen = run(given.stimulus);
  const KernelRecord& record = Session::current().subject(kernelName).record();
  const std::size_t decided = !seen.applies ? 0
                                            : decodeList(record, record.list("visible"),
                                                         std::as_bytes(std::span(given.survivors)),
                                                         input.push.capacity, seen);
  const auto model = std::make_shared<const OcclusionModel>(
      OcclusionModel{input, std::move(given.pyramid), std::move(given.survivors)});
  return asJudged(
      std::move(seen),
      expectationOf(
          "visible", decided, [model]<class T>(std::size_t i) { return model->membership<T>(i); },
          [model](std::size_t i) {
            return describe(model->input.bounds[model->survivors[i].firstInstance]);
          }),
      kernelName);
}

void ListCase::expectRightTally(FrustumInput input) {
  Observation seen = judged(input).seen;
  const Totals totals{input.bounds.size(), input.push.capacity,   input.push.patience,
                      tallyBy(seen),       isForeign(kernelName), keepsMore(kernelName)};
  judgeTiming(totals, seen);
  expectConforms(
      seen, tallyOf(totals, [&input]<class T>(std::size_t i) { return membership<T>(input, i); }));
}

void ListCase::expectRightTally(OcclusionInput input) {
  Observation seen = judged(input).seen;
  const OcclusionStimulus given(input);
  const auto model =
      std::make_shared<const OcclusionModel>(OcclusionModel{input, given.pyramid, given.survivors});
  const Totals totals{model->survivors.size(), input.push.capacity,   input.push.patience,
                      tallyBy(seen),           isForeign(kernelName), keepsMore(kernelName)};
  judgeTiming(totals, seen);
  expectConforms(
      seen, tallyOf(totals, [model]<class T>(std::size_t i) { return model->membership<T>(i); }));
}

void ListCase::expectAnswers(FrustumInput input) {
  expectAnswersTo(FrustumStimulus(input).stimulus);
}
void ListCase::expectAnswers(OcclusionInput input) {
  expectAnswersTo(OcclusionStimulus(input).stimulus);
}

void ListCase::expectAnswersTo(const Stimulus& stimulus) {
  constexpr int kRuns = 200;
  uint least = ~0u;
  for (int i = 0; i < kRuns && least > 0; ++i) {
    const auto outputs = runTwinOnce(Session::current().subject(kernelName), stimulus);
    least = std::min(least, elementsOf<Tally>(outputs.at("tally"))[0].recounted);
  }
  EXPECT_EQ(least, 0u) << "blocks are counted again in every one of " << kRuns
                       << " runs: no group hears of another's count";
  checked(1);
}

void ListCase::expectEveryThird(const std::vector<bool>& kept) {
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) wrong += kept[i] != (i % 3 == 0);
  EXPECT_EQ(wrong, 0u) << "of " << kept.size() << " candidates";
  checked(kept.size());
}

std::vector<bool> ListCase::visible(FrustumInput input) {
  const Observation seen = judged(input).seen;
  expectClean(seen);
  if (!seen.applies) return {};
  const auto flags = elementsOf<uint>(seen.twin.at("visible"));
  return {flags.begin(), flags.end()};
}

std::vector<bool> ListCase::visible(OcclusionInput input) {
  const Observation seen = judged(input).seen;
  expectClean(seen);
  if (!seen.applies) return {};
  const auto flags = elementsOf<uint>(seen.twin.at("visible"));
  return {flags.begin(), flags.end()};
}

std::vector<bool> ListCase::readList(const std::map<std::string, std::vector<std::byte>>& outputs,
                                     std::size_t candidates, uint stride) const {
  const auto draws = elementsOf<DrawCommand>(outputs.at("draws"));
  const auto tally = elementsOf<Tally>(outputs.at("tally"));
  std::vector<bool> all(candidates);
  std::size_t next = 0;  // the first candidate that may follow
  for (std::size_t i = 0; i < std::min<std::size_t>(tally[0].listed, draws.size()); ++i) {
    const std::size_t c = draws[i].firstInstance / stride;
    if (c < next || c >= candidates) {
      ADD_FAILURE() << "draws[" << i << "] is of candidate " << c << " of " << candidates
                    << ", behind that of candidate " << next - 1;
      break;
    }
    all[c] = true;
    next = c + 1;
  }
  return all;
}

std::vector<bool> ListCase::quicklyVisible(FrustumInput input) {
  const FrustumStimulus given(input);
  return readList(runTwinOnce(Session::current().subject(kernelName), given.stimulus),
                  input.bounds.size(), 1);
}

std::vector<bool> ListCase::quicklyVisible(OcclusionInput input) {
  const OcclusionStimulus given(input);
  return readList(runTwinOnce(Session::current().subject(kernelName), given.stimulus),
                  given.survivors.size(), input.stride);
}

std::vector<Bounds> spheresAround(const Scene& scene, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const glm::dmat4 world = glm::inverse(scene.view);
  std::vector<Bounds> spheres;
  for (std::size_t i = 0; i < n; ++i) {
    const double u = random.uniform(-1.5, 1.5), v = random.uniform(-1.5, 1.5);
    const double d = random.logUniform(0.3, 1000) * scene.near;
    const glm::dmat4& p = scene.projection;
    const glm::dvec3 at =
        scene.perspective()
            ? glm::dvec3((u + p[2][0]) / p[0][0] * d, (v + p[2][1]) / p[1][1] * d, -d)
            : glm::dvec3((u - p[3][0]) / p[0][0], (v - p[3][1]) / p[1][1], -d);
    const double most = scene.perspective() ? d : 1 / std::abs(p[0][0]);
    spheres.push_back(
        {vec3(world * glm::dvec4(at, 1)), static_cast<float>(most * random.logUniform(1e-4, 1))});
  }
  return spheres;
}

}  // namespace gnomon::culling
