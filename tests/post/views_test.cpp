// post/views: every debug view against its model.
//
// Covered: albedo, normal, depth and cascades inside their intervals, over pictures whose sides are
// no multiples of a group and over tiny ones; every probe inside its own; sky; distances around
// every split and blend zone; bad input; an unknown mode; the linearisation against the projection
// it inverts, and at both planes. Not covered: the tile-light heat map (it comes with the lights).
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "harness/cases/modelled.h"
#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "reference/post/views.h"

namespace gnomon::post {
namespace {

// The model's functions as its truth and laws call them (modelled.h).
double linearDepth(double d, double near, double far) {
  return modelled("linearDepth", [&]<class T>() {
    return post::linearDepth<T>(given<T>(d), given<T>(near), given<T>(far));
  });
}
Vec4<double> view(const Views& push, const Surface& surface) {
  const char* entry = push.mode == kNormal     ? "view.normal"
                      : push.mode == kDepth    ? "view.depth"
                      : push.mode == kCascades ? "view.cascades"
                                               : "view.albedo";
  return modelled(entry, [&]<class T>() { return post::view<T>(push, surface); });
}

constexpr std::array kModes = {kAlbedo, kNormal, kDepth, kCascades};

struct Scene {
  Views push;
  Picture albedo, normal, depth;

  Surface at(std::size_t i) const {
    return {vec3(albedo.at(i)), vec3(normal.at(i)), depth.at(i).x};
  }
};

Views camera(const uvec2& size) {
  return {.size = size,
          .mode = kAlbedo,
          .near = 0.1f,
          .far = 250.0f,
          .splits = {7.5f, 22.0f, 80.0f, 250.0f}};
}

vec4 colour(Random& random) {
  return {random.uniform(), random.uniform(), random.uniform(), random.uniform()};
}

/// Depth of a distance: the projection that linearDepth inverts.
float depthOf(double distance, const Views& push) {
  const double n = push.near, f = push.far;
  return static_cast<float>(n * (f - distance) / (distance * (f - n)));
}

/// One pixel in ten is sky, three in ten lie within a thousandth of a split or of a blend zone.
Scene generatedScene(const uvec2& size, std::uint64_t seed) {
  Random random(seed);
  Scene scene{.push = camera(size), .albedo = {size}, .normal = {size}, .depth = {size}};
  const Views& push = scene.push;
  for (std::size_t i = 0; i < std::size_t{size.x} * size.y; ++i) {
    double distance = random.logUniform(push.near, push.far);
    const auto cascade = static_cast<int>(random.below(4));
    const double end = push.splits[cascade];
    const double begin = cascade == 0 ? push.near : push.splits[cascade - 1];
    const double u = random.uniform();
    if (u < 0.15) distance = end * random.uniform(0.999, 1.001);
    if (u > 0.85) distance = (end - kCascadeBlend * (end - begin)) * random.uniform(0.999, 1.001);
    const bool sky = random.chance(0.1);
    const glm::dvec3 n = random.direction();
    scene.albedo.texels.push_back(colour(random));
    scene.normal.texels.emplace_back(n.x / 2 + 0.5, n.y / 2 + 0.5, n.z / 2 + 0.5, 0);
    scene.depth.texels.emplace_back(
        sky ? 0.0f : depthOf(std::min<double>(distance, push.far), push), 0, 0, 0);
  }
  return scene;
}

void parts(Parts& p, Scene& scene) {
  p.push(scene.push);
  p.imageOfExtent("albedo", scene.albedo);
  p.imageOfExtent("normal", scene.normal);
  p.imageOfExtent("depth", scene.depth);
  p.extent(scene.push.size);
}

bool admits(const Scene& scene) {
  const Views& v = scene.push;
  return v.near > 0 && v.near < v.splits.x && v.splits.x < v.splits.y && v.splits.y < v.splits.z &&
         v.splits.z < v.splits.w && v.splits.w == v.far;
}

std::string describe(const Views& push, const Surface& s) {
  return fmt::format(
      "    mode   {}\n    near   {:.9g}, far {:.9g}, splits {:.9g} {:.9g} {:.9g} {:.9g}\n"
      "    albedo ({:.9g}, {:.9g}, {:.9g})\n    normal ({:.9g}, {:.9g}, {:.9g})\n"
      "    depth  {:.9g}\n",
      push.mode, push.near, push.far, push.splits.x, push.splits.y, push.splits.z, push.splits.w,
      s.albedo.x, s.albedo.y, s.albedo.z, s.normal.x, s.normal.y, s.normal.z, s.depth);
}

class PostViews : public KernelCase {
 protected:
  PostViews() : KernelCase("post/views") {}

  Observation dispatch(const Scene& scene, unsigned beyond = 0) {
    return run(
        {.inputImages = {floatImage("albedo", scene.albedo), floatImage("normal", scene.normal),
                         floatImage("depth", scene.depth)},
         .outputImages = {{.image = "target",
                           .width = scene.push.size.x,
                           .height = scene.push.size.y,
                           .beyond = beyond}},
         .push = std::as_bytes(std::span(&scene.push, 1)),
         .extent = {scene.push.size.x, scene.push.size.y}});
  }

  static Expectation modelOf(const Scene& scene) {
    return pixelsOf(
        "target", scene.push.size,
        [&scene]<class T>(std::size_t i) { return view<T>(scene.push, scene.at(i)); },
        [&scene](std::size_t i) { return describe(scene.push, scene.at(i)); });
  }

  /// The depths are those that the kernel's convention can tell: 1 - d in float loses small ones.
  void expectInsideTheBound(const Scene& scene) {
    expectConformsOn(scene, [this](Scene& s) {
      recover(s.depth, "depth");
      return Trial{dispatch(s), modelOf(s)};
    });
  }
};

/// Cases that judge without the model.
class PostViewsLaws : public PostViews {};

/// Cases that judge the intermediates.
class PostViewsProbes : public PostViews {
 protected:
  void SetUp() override {
    PostViews::SetUp();
    skipUnlessTheProbesAreOurs();
  }
};

// A few groups, the last ones in part.
TEST_F(PostViewsProbes, EveryProbeStaysInsideItsBound) {
  Scene scene = generatedScene({4 * kGroupSide + 5, 4 * kGroupSide + 3}, caseSeed());
  for (const uint mode : kModes) {
    scene.push.mode = mode;
    expectEveryProbeInside(dispatch(scene), modelOf(scene));
  }
}

// Each view reaches some of them: together all.
TEST_F(PostViewsProbes, ContractAndModelNameTheSame) {
  std::vector<Scene> scenes(kModes.size(), generatedScene({kGroupSide, kGroupSide}, caseSeed()));
  std::vector<Expectation> all;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    scenes[i].push.mode = kModes[i];
    all.push_back(modelOf(scenes[i]));
    checked(all.back().elements);
  }
  expectTheModelNamesEveryProbe(all);
}

TEST_F(PostViews, EveryModeStaysInsideTheBound) {
  Scene scene = generatedScene({251, 127}, caseSeed());
  for (const uint mode : kModes) {
    scene.push.mode = mode;
    expectInsideTheBound(scene);
  }
}

TEST_F(PostViews, EverySizeAroundAGroupIsWrittenExactly) {
  for (const uvec2 size : {uvec2(1, 1), uvec2(kGroupSide - 1, kGroupSide), uvec2(kGroupSide),
                           uvec2(kGroupSide, kGroupSide + 1), uvec2(1, 37), uvec2(37, 1)}) {
    Scene scene = generatedScene(size, caseSeed() + size.x);
    scene.push.mode = kCascades;
    expectInsideTheBound(scene);
  }
}

TEST_F(PostViewsLaws, PixelsBeyondTheSizeAreNotTouched) {
  for (const uvec2 size : {uvec2(kGroupSide + 5, kGroupSide), uvec2(kGroupSide, kGroupSide + 5)}) {
    const Scene scene = generatedScene(size, caseSeed());
    expectClean(dispatch(scene, kGroupSide));
    checked(std::size_t{size.x} * size.y);
  }
}

TEST_F(PostViews, AnUnknownModeShowsAlbedo) {
  Scene scene = generatedScene({16, 16}, caseSeed());
  for (const uint mode : {3u, 10u, 12u, ~0u}) {
    scene.push.mode = mode;
    expectInsideTheBound(scene);
  }
}

TEST_F(PostViews, BadInputCountsAsTheContractSays) {
  const std::vector<float> special = specialFloats({3.0f});
  const auto n = static_cast<uint>(special.size());
  const uvec2 size(3 * n, n);
  Scene scene{.push = camera(size), .albedo = {size}, .normal = {size}, .depth = {size}};
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x) {
      vec4 colour(0.25f, 0.5f, 0.75f, 0);
      colour[static_cast<int>(x % 3)] = special[x / 3];
      scene.albedo.texels.push_back(colour);
      scene.normal.texels.push_back(colour);
      // A denormal may be flushed to the sky, so it is ambiguous: once is enough.
      const bool again = std::fpclassify(special[y]) == FP_SUBNORMAL && x > 0;
      scene.depth.texels.emplace_back(again ? 0.5f : special[y], 0, 0, 0);
    }
  for (const uint mode : kModes) {
    scene.push.mode = mode;
    expectInsideTheBound(scene);
  }
}

/// A near plane for which near * far / near, rounded to float, is beyond a far plane of 250. Their
/// product is a little above 16, where it is rounded by as much, relative to itself, as it can be.
float nearThatRoundsUp(float far) {
  for (float near = 0.0645f;; near = std::nextafter(near, 1.0f)) {
    const float product = near * far;
    if (product / near > far) return near;
  }
}

// Next to the far plane a distance may be rounded beyond it, and beyond the last split with it.
TEST_F(PostViews, WhatRoundsBeyondTheFarPlaneIsInTheLastCascade) {
  Scene scene = generatedScene({1, 1}, caseSeed());
  scene.push.mode = kCascades;
  scene.push.near = nearThatRoundsUp(scene.push.far);
  scene.albedo.texels = {vec4(0.5f)};
  scene.depth.texels = {vec4(1e-30f)};  // not the sky, but nothing beside the near plane
  expectInsideTheBound(scene);
}

// Green, blue, yellow, red over black albedo, read off the picture itself.
TEST_F(PostViewsLaws, CascadesHaveTheirColours) {
  const uvec2 size(4, 1);
  Scene scene{.push = camera(size), .albedo = {size}, .normal = {size}, .depth = {size}};
  scene.push.mode = kCascades;
  for (const double distance : {1.0, 10.0, 30.0, 200.0}) {
    scene.albedo.texels.emplace_back(0, 0, 0, 0);
    scene.normal.texels.emplace_back(0, 0, 0, 0);
    scene.depth.texels.emplace_back(depthOf(distance, scene.push), 0, 0, 0);
  }
  if (!applies(scene.push)) return;
  const Observation seen = dispatch(scene);
  expectClean(seen);
  checked(size.x);
  const std::vector<vec4> shown = elementsOf<vec4>(seen.twin.at("target"));
  const std::array expected = {vec3(0, 1, 0), vec3(0, 0, 1), vec3(1, 1, 0), vec3(1, 0, 0)};
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(vec3(shown[i]), 0.7f * expected[i]) << "cascade " << i;
}

TEST(PostViewsModel, LinearDepthInvertsTheProjection) {
  Random random(caseSeed());
  for (int i = 0; i < 10'000; ++i) {
    const double near = random.logUniform(0.01, 10), far = near * random.logUniform(2, 1e5);
    const double distance = random.logUniform(near, far);
    const double depth = near * (far - distance) / (distance * (far - near));
    // far - distance cancels next to the far plane: its rounding, relative to what is left.
    const double slack = 8 * std::numeric_limits<double>::epsilon() * far / distance;
    EXPECT_LE(std::abs(linearDepth(depth, near, far) / distance - 1),
              slack + 8 * std::numeric_limits<double>::epsilon() * distance / near)
        << near << " " << far << " " << distance;
  }
  // Powers of two: both planes exactly.
  EXPECT_EQ(linearDepth(1.0, 0.5, 128.0), 0.5);
  EXPECT_EQ(linearDepth(0.0, 0.5, 128.0), 128.0);
}

TEST(PostViewsModel, TheSkyIsBlackInEveryView) {
  for (const uint mode : kModes) {
    Views push = camera({1, 1});
    push.mode = mode;
    const Vec4<double> sky = view(push, {vec3(1), vec3(1), 0});
    // Clamped to the sky, though of the second the formula would be beyond the far plane.
    const Vec4<double> below = view(push, {vec3(1), vec3(1), -1});
    const Vec4<double> justBelow = view(push, {vec3(1), vec3(1), -0x1p-20f});
    for (const auto& seen : {sky, below, justBelow}) {
      EXPECT_EQ(seen.x + seen.y + seen.z, 0);
      EXPECT_EQ(seen.w, 1);
    }
  }
}

// The whole is white where everything saturates; alpha is 1 in every view.
TEST(PostViewsModel, EveryViewIsOpaque) {
  for (const uint mode : kModes) {
    Views push = camera({1, 1});
    push.mode = mode;
    EXPECT_EQ(view(push, {vec3(0.5f), vec3(0.5f), 0.5f}).w, 1) << mode;
  }
}

// What is shown as it stands: inside [0, 1] itself, outside the nearer end, NaN and infinity 0;
// each colour by itself.
TEST(PostViewsModel, AlbedoAndNormalAreShownAsTheyStand) {
  using Limits = std::numeric_limits<float>;
  struct Shown {
    float given;
    double shown;
  };
  constexpr std::array<Shown, 8> kShown = {{{0, 0},
                                            {0x1p-20f, 0x1p-20},
                                            {0.25f, 0.25},
                                            {1, 1},
                                            {1.5f, 1},
                                            {-0.5f, 0},
                                            {Limits::quiet_NaN(), 0},
                                            {Limits::infinity(), 0}}};
  for (const uint mode : {kAlbedo, kNormal})
    for (int c = 0; c < 3; ++c)
      for (const Shown& x : kShown) {
        Views push = camera({1, 1});
        push.mode = mode;
        vec3 colour(0.125f, 0.5f, 0.75f);
        colour[c] = x.given;
        const vec3 other(0.375f);
        const Vec4<double> got =
            mode == kAlbedo ? view(push, {colour, other, 0.5f}) : view(push, {other, colour, 0.5f});
        for (int i = 0; i < 3; ++i)
          EXPECT_EQ(got[static_cast<std::size_t>(i)], i == c ? x.shown : double{colour[i]})
              << x.given << " in component " << c << " of mode " << mode;
      }
}

// Powers of two, so that every step is exact: with far = 2 near a depth d shows
// 1 / (1 + d) of far, which is 1/2 on the near plane, and beyond it, and 2/3 half way.
TEST(PostViewsModel, DepthIsTheShareOfTheFarPlane) {
  Views push = camera({1, 1});
  push.mode = kDepth;
  push.near = 0.5f;
  push.far = 1;
  const auto grey = [&](float depth) {
    const Vec4<double> got = view(push, {vec3(0), vec3(0), depth});
    EXPECT_EQ(got.x, got.y);
    EXPECT_EQ(got.x, got.z);
    return got.x;
  };
  EXPECT_EQ(grey(0.5f), 1 / 1.5);
  EXPECT_EQ(grey(1), 0.5);
  EXPECT_EQ(grey(2), 0.5);  // clamped to the near plane
  // The smallest depths that are no sky: a share of 1 less their own size.
  EXPECT_EQ(grey(0x1p-20f), 1 / (1 + 0x1p-20));
  push.near = 0x1p-20f;  // however small a share
  EXPECT_EQ(grey(1), 0x1p-20);
  push.near = 0.5f;
  push.far = 4;  // 1 / (1 + 7 d)
  EXPECT_EQ(grey(0.5f), 1 / 4.5);
}

/// Where a cascade begins and ends, and what its tint leaves of a pixel.
struct Range {
  double begin, end;
  vec3 colour;
};

std::array<Range, 4> rangesOf(const Views& push) {
  return {{{push.near, push.splits.x, {0, 1, 0}},
           {push.splits.x, push.splits.y, {0, 0, 1}},
           {push.splits.y, push.splits.z, {1, 1, 0}},
           {push.splits.z, push.splits.w, {1, 0, 0}}}};
}

// 0.7 of the cascade's colour over 0.3 of the albedo, both as floats, and a quarter brighter in the
// last tenth of the range, unless it is the last. A depth's half ULP moves the distance by 2^-24 of
// it, which is at most 250 / 170 of a range: 5e-6 to either side of the zone's begin are clear.
TEST(PostViewsModel, CascadesTintTheDimmedAlbedo) {
  Views push = camera({1, 1});
  push.mode = kCascades;
  const vec3 albedo(0.25f, 0.5f, 1);
  const std::array ranges = rangesOf(push);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    for (const double share : {0.05, 0.9 - 5e-6, 0.9 + 5e-6, 0.95}) {
      const auto& [begin, end, colour] = ranges[i];
      const double distance = begin + share * (end - begin);
      const double brighter = share > 0.9 && i < 3 ? 1.25 : 1;
      const Vec4<double> got = view(push, {albedo, vec3(0), depthOf(distance, push)});
      for (int c = 0; c < 3; ++c) {
        const double shown = double{0.7f} * colour[c] + double{0.3f} * albedo[c];
        // 0.7 and 0.3 of 1 make up 1, or more where it is brighter: saturated.
        EXPECT_EQ(got[static_cast<std::size_t>(c)], std::min(1.0, brighter * shown))
            << "cascade " << i << " at " << share << ", component " << c;
      }
      EXPECT_EQ(got.w, 1);
    }
}

// Bad albedo counts as the contract says before it is dimmed: -1 as 0, 2 as 1, NaN as 0.
TEST(PostViewsModel, AlbedoIsClampedBeforeACascadeDimsIt) {
  Views push = camera({1, 1});
  push.mode = kCascades;
  const std::array ranges = rangesOf(push);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    for (const double share : {0.5, 0.95}) {
      const auto& [begin, end, colour] = ranges[i];
      const float depth = depthOf(begin + share * (end - begin), push);
      for (int c = 0; c < 3; ++c)
        for (const auto& [bad, counted] :
             {std::array{-1.0f, 0.0f}, std::array{2.0f, 1.0f}, std::array{std::nanf(""), 0.0f}}) {
          vec3 albedo(0.5f), good(0.5f);
          albedo[c] = bad, good[c] = counted;
          const Vec4<double> got = view(push, {albedo, vec3(0), depth});
          const double brighter = share > 0.9 && i < 3 ? 1.25 : 1;
          for (int k = 0; k < 3; ++k)
            EXPECT_EQ(got[static_cast<std::size_t>(k)],
                      std::min(1.0, brighter * (double{0.7f} * colour[k] + double{0.3f} * good[k])))
                << "cascade " << i << ", component " << k << " of " << bad;
        }
    }
}

// A distance that equals a split belongs to the cascade that ends there. With near 1 and far 3 the
// depth 1/4 is at 3 / (1 + 1/2) = 2, exactly.
TEST(PostViewsModel, ACascadeHoldsItsEnd) {
  Views push = camera({1, 1});
  push.mode = kCascades;
  push.near = 1;
  push.far = 3;
  constexpr std::array<std::array<float, 4>, 3> kSplits = {
      {{2, 2.5f, 2.75f, 3}, {1.5f, 2, 2.5f, 3}, {1.25f, 1.5f, 2, 3}}};
  for (std::size_t i = 0; i < kSplits.size(); ++i) {
    push.splits = {kSplits[i][0], kSplits[i][1], kSplits[i][2], kSplits[i][3]};
    const vec3 colour = rangesOf(push)[i].colour;
    const Vec4<double> got = view(push, {vec3(0), vec3(0), 0.25f});
    for (int c = 0; c < 3; ++c)
      EXPECT_EQ(got[static_cast<std::size_t>(c)] > 0, colour[c] > 0) << i << ", component " << c;
  }
}

}  // namespace
}  // namespace gnomon::post
