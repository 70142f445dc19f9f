// post/views: every debug view against its model.
//
// Covered: albedo, normal, depth and cascades inside their intervals, over pictures whose sides are
// no multiples of a group and over tiny ones; sky; distances around every split and blend zone; bad
// input; an unknown mode; the linearisation against the projection it
// inverts, and at both planes.
// Not covered: the tile-light heat map (it comes with the lights).
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "harness/cases/special_floats.h"
#include "reference/post/views.h"

namespace gnomon::post {
namespace {

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

TEST_F(PostViews, PixelsBeyondTheSizeAreNotTouched) {
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
      const bool again = special[y] == std::numeric_limits<float>::denorm_min() && x > 0;
      scene.depth.texels.emplace_back(again ? 0.5f : special[y], 0, 0, 0);
    }
  for (const uint mode : kModes) {
    scene.push.mode = mode;
    expectInsideTheBound(scene);
  }
}

// Green, blue, yellow, red over black albedo, read off the picture itself.
TEST_F(PostViews, CascadesHaveTheirColours) {
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
}

TEST(PostViewsModel, LinearDepthIsExactAtBothPlanes) {
  EXPECT_EQ(linearDepth(1.0, 0.5, 128.0), 0.5);
  EXPECT_EQ(linearDepth(0.0, 0.5, 128.0), 128.0);
}

TEST(PostViewsModel, TheSkyIsBlackInEveryView) {
  for (const uint mode : kModes) {
    Views push = camera({1, 1});
    push.mode = mode;
    const Vec4<double> sky = view<double>(push, {vec3(1), vec3(1), 0});
    EXPECT_EQ(sky.x + sky.y + sky.z, 0);
    EXPECT_EQ(sky.w, 1);
  }
}

// The last tenth of each range but the last one is brighter, by the contract's factor.
TEST(PostViewsModel, TheBlendZoneIsTheLastTenthOfACascade) {
  Views push = camera({1, 1});
  push.mode = kCascades;
  const auto green = [&](double share) {
    const double distance = push.near + share * (double{push.splits.x} - push.near);
    return view<double>(push, {vec3(0), vec3(0), depthOf(distance, push)}).y;
  };
  EXPECT_EQ(green(0.95) / green(0.85), kBlendBrighter);
  const auto red = [&](double distance) {
    return view<double>(push, {vec3(0), vec3(0), depthOf(distance, push)}).x;
  };
  EXPECT_EQ(red(245), red(100));
}

}  // namespace
}  // namespace gnomon::post
