#include "tests/culling/hiz_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "harness/cases/special_floats.h"

namespace gnomon::culling {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::span<const std::byte> bytesOf(const std::vector<float>& depths) {
  return std::as_bytes(std::span(depths));
}

struct Place {
  uint element;
  uvec2 texel;
};

/// What one texel may be. Exact where it saw just what it had to.
Bounded allowed(const DepthBuffer& depths, const PyramidShape& shape, const Place& at) {
  const Footprint own = shape.own(at.element, at.texel), most = shape.most(at.element, at.texel);
  Bounded result;
  result.hi = own.empty() ? kInfinite : farthest<double>(depths, own);
  result.lo = own.empty() ? -kInfinite : result.hi;
  if (!own.empty() && !(own == most)) result.lo = farthest<double>(depths, most);
  result.value = result.hi;
  return result;
}

std::string describe(const DepthBuffer& depths, const PyramidShape& shape, const Place& at) {
  const Footprint f = shape.own(at.element, at.texel);
  std::string text =
      fmt::format("    level   {}, texel ({}, {})\n    covers  columns {} to {}, rows {} to {}\n",
                  at.element + 1, at.texel.x, at.texel.y, f.columns.begin, f.columns.end - 1,
                  f.rows.begin, f.rows.end - 1);
  const double least = f.empty() ? 0 : farthest<double>(depths, f);
  for (uint y = f.rows.begin; y < f.rows.end; ++y)
    for (uint x = f.columns.begin; x < f.columns.end; ++x)
      if (counted(depths.at(x, y)) == least)
        return text + fmt::format("    depth   {} at ({}, {})\n", exactly(depths.at(x, y)), x, y);
  return text;
}

}  // namespace

// Four decades: reverse-Z depths from a near plane to ten thousand times as far. Sky pixels here
// and there would make every texel of the upper levels 0.
DepthBuffer generatedDepths(const uvec2& size, std::uint64_t seed) {
  Random random(seed);
  DepthBuffer buffer{.size = size};
  for (uint y = 0; y < size.y; ++y)
    for (uint x = 0; x < size.x; ++x)
      buffer.depths.push_back(y < size.y / 20 ? 0.0f
                                              : static_cast<float>(random.logUniform(1e-4, 1)));
  return buffer;
}

DepthBuffer constantDepths(const uvec2& size, float depth) {
  return {size, std::vector<float>(std::size_t{size.x} * size.y, depth)};
}

DepthBuffer holedDepths(const uvec2& size, std::uint64_t seed) {
  constexpr float kWall = 0.75f;
  DepthBuffer buffer = constantDepths(size, kWall);
  Random random(seed);
  float depth = kWall;
  const auto dig = [&](uint64_t x, uint64_t y) {
    depth *= 0.99f;
    buffer.depths[y * size.x + x] = depth;
  };
  const uint right = size.x - 1, below = size.y - 1;
  for (const uvec2 corner : {uvec2(0), uvec2(right, 0), uvec2(0, below), uvec2(right, below)})
    dig(corner.x, corner.y);
  for (int i = 0; i < 16; ++i) {
    dig(right, random.below(size.y));
    dig(random.below(size.x), below);
    dig(random.below(size.x), random.below(size.y));
  }
  return buffer;
}

// A texel of level 1 holds two of them beside two that are nearest, so that a bad depth is the only
// one there that counts as 0.
DepthBuffer specialDepths() {
  const std::vector<float> special = specialFloats();
  const auto n = static_cast<uint>(special.size());
  DepthBuffer buffer = constantDepths(uvec2(2 * n + 1), 1);
  for (uint y = 0; y < n; ++y)
    for (uint x = 0; x < n; ++x) {
      float* const row = buffer.depths.data() + std::size_t{2 * y} * buffer.size.x;
      row[2 * x] = special[x];
      row[buffer.size.x + 2 * x + 1] = special[y];
    }
  return buffer;
}

void parts(Parts& p, HizInput& input) {
  p.push(input.push);
  p.imageOfExtent("depth", input.depth);
  p.extent(input.push.size);
}

// A single pixel has no levels.
bool admits(const HizInput& input) { return input.push.size.x > 1 || input.push.size.y > 1; }

void parts(Parts& p, LevelInput& input) {
  p.push(input.push);
  p.imageOfExtent("parent", input.parent);
  p.extent(input.push.size);
}

Picture pictureOf(const DepthBuffer& buffer) {
  Picture picture{.size = buffer.size};
  for (const float depth : buffer.depths) picture.texels.emplace_back(depth, 0, 0, 0);
  return picture;
}

DepthBuffer depthsOf(const Picture& picture) {
  DepthBuffer buffer{.size = picture.size};
  for (const vec4& texel : picture.texels) buffer.depths.push_back(texel.x);
  return buffer;
}

Lookup PyramidCase::lookup() const {
  const auto& conventions = Session::current().subject(kernelName).conventions();
  const auto said = conventions.find("lookup");
  return said == conventions.end() ? Lookup::kPinned : lookupNamed(said->second);
}

Expectation PyramidCase::modelOf(const std::string& output, DepthBuffer buffer, uint first,
                                 uint elements) const {
  const PyramidShape shape = shapeOf(buffer.size);
  const Levels levels{shape.size(first).x, shape.size(first).y, elements};
  const auto depths = std::make_shared<const DepthBuffer>(std::move(buffer));
  const auto placeOf = [=](std::size_t i) -> Place {
    const LevelPixel pixel = pixelAt(levels, i);
    return {first + pixel.level, {pixel.x, pixel.y}};
  };
  Expectation e;
  e.output = output;
  e.elements = gnomon::pixelsOf(levels);
  e.width = levels.width;
  e.height = levels.height;
  e.mips = levels.count;
  // The interval is what a texel may have seen: it says nothing of arithmetic.
  e.judgesRules = lookup() != Lookup::kPinned;
  e.plain = [=](std::size_t i, std::span<double> out) {
    out[0] = allowed(*depths, shape, placeOf(i)).value;
  };
  e.bounded = [=](std::size_t i, std::span<Bounded> out) {
    out[0] = allowed(*depths, shape, placeOf(i));
  };
  e.inputs = [=](std::size_t i) { return describe(*depths, shape, placeOf(i)); };
  return e;
}

void PyramidCase::expectNoNegativeZeros(const Observation& seen, const std::string& output) {
  const std::vector<float> texels = elementsOf<float>(seen.twin.at(output));
  for (std::size_t i = 0; i < texels.size(); ++i)
    EXPECT_FALSE(texels[i] == 0 && std::signbit(texels[i])) << output << "[" << i << "] is -0";
}

Observation PyramidCase::runWith(Effort effort, const Stimulus& stimulus) {
  if (effort == Effort::kWatched) return run(stimulus);
  Observation seen;
  seen.twin = runTwinOnce(Session::current().subject(kernelName), stimulus);
  seen.plain = seen.twin;
  return seen;
}

Observation HizCase::dispatch(const DepthBuffer& depths, Effort effort, PixelFormat format) {
  const PyramidShape shape = shapeOf(depths.size);
  const Hiz push{depths.size};
  const uvec2 tiles = levelSize(depths.size, kHizTile);
  return runWith(effort, {.scratch = {{"scratch", 1 + std::size_t{tiles.x} * tiles.y}},
                          .inputImages = {{.image = "depth",
                                           .description = {.format = format,
                                                           .width = depths.size.x,
                                                           .height = depths.size.y},
                                           .texels = bytesOf(depths.depths)}},
                          .outputImages = {{.image = "levels",
                                            .width = shape.size(0).x,
                                            .height = shape.size(0).y,
                                            .mips = std::max(1u, shape.elements())}},
                          .push = std::as_bytes(std::span(&push, 1)),
                          .extent = {depths.size.x, depths.size.y}});
}

Expectation HizCase::modelOfAll(DepthBuffer depths) const {
  const uint elements = shapeOf(depths.size).elements();
  return modelOf("levels", std::move(depths), 0, elements);
}

void HizCase::expectEveryTexel(const DepthBuffer& buffer) {
  expectConformsOn(HizInput{{buffer.size}, pictureOf(buffer)}, [this](HizInput& input) {
    const DepthBuffer depths = depthsOf(input.depth);
    return Trial{dispatch(depths), modelOfAll(depths)};
  });
}

void HizCase::expectEveryTexelAtOnce(const DepthBuffer& depths) {
  expectConforms(dispatch(depths, Effort::kOnce), modelOfAll(depths));
}

Pyramid HizCase::pyramidOf(const DepthBuffer& depths) {
  const PyramidShape shape = shapeOf(depths.size);
  const Observation seen = dispatch(depths);
  expectClean(seen);
  const std::vector<float> all = elementsOf<float>(seen.twin.at("levels"));
  Pyramid pyramid;
  auto at = all.begin();
  for (uint element = 0; element < shape.elements(); ++element) {
    const auto count = static_cast<std::ptrdiff_t>(shape.size(element).x) * shape.size(element).y;
    pyramid.emplace_back(at, at + count);
    at += count;
  }
  return pyramid;
}

Observation HizLevelCase::dispatch(const DepthBuffer& parent, const uvec2& size, Effort effort,
                                   PixelFormat format, unsigned beyond) {
  const HizLevel push{parent.size};
  return runWith(
      effort,
      {.inputImages =
           {{.image = "parent",
             .description = {.format = format, .width = parent.size.x, .height = parent.size.y},
             .texels = bytesOf(parent.depths)}},
       .outputImages = {{.image = "level", .width = size.x, .height = size.y, .beyond = beyond}},
       .push = std::as_bytes(std::span(&push, 1)),
       .extent = {size.x, size.y}});
}

void HizLevelCase::expectEveryTexelOfOneLevel(const DepthBuffer& parent) {
  expectConformsOn(LevelInput{{parent.size}, pictureOf(parent)}, [this](LevelInput& input) {
    const DepthBuffer depths = depthsOf(input.parent);
    return Trial{dispatch(depths, shapeOf(depths.size).size(0)), modelOf("level", depths, 0, 1)};
  });
}

void HizLevelCase::expectEveryTexelOfTheChain(const DepthBuffer& depths, Effort effort) {
  const PyramidShape shape = shapeOf(depths.size);
  DepthBuffer parent = depths;
  for (uint element = 0; element < shape.elements(); ++element) {
    const uvec2 size = shape.size(element);
    const Observation seen = dispatch(parent, size, effort);
    expectConforms(seen, modelOf("level", depths, element, 1));
    parent = {size, elementsOf<float>(seen.twin.at("level"))};
  }
  EXPECT_EQ(parent.size, uvec2(1));
}

Pyramid HizLevelCase::pyramidOf(const DepthBuffer& depths) {
  const PyramidShape shape = shapeOf(depths.size);
  Pyramid pyramid;
  DepthBuffer parent = depths;
  for (uint element = 0; element < shape.elements(); ++element) {
    const Observation seen = dispatch(parent, shape.size(element));
    expectClean(seen);
    parent = {shape.size(element), elementsOf<float>(seen.twin.at("level"))};
    pyramid.push_back(parent.depths);
  }
  return pyramid;
}

}  // namespace gnomon::culling
