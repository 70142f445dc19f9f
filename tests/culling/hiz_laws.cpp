// The laws of PyramidCase.
#include <algorithm>
#include <limits>

#include "tests/culling/hiz_cases.h"

namespace gnomon::culling {
namespace {

std::size_t texelsIn(const Pyramid& pyramid) {
  std::size_t count = 0;
  for (const auto& element : pyramid) count += element.size();
  return count;
}

std::vector<float> mirrored(const std::vector<float>& texels, uint width, bool rows) {
  std::vector<float> result = texels;
  for (auto row = result.begin(); row != result.end(); row += width) std::reverse(row, row + width);
  if (rows) std::ranges::reverse(result);  // and of each row, which stands mirrored, the order
  return result;
}

struct Rectangle {
  uvec2 first, last;
};

/// Long and short, square and narrow, anywhere.
Rectangle anyRectangle(Random& random, const uvec2& size) {
  const auto side = [&](uint most) {
    return std::min(most, static_cast<uint>(random.logUniform(1, most + 1.0)));
  };
  const uvec2 extent(side(size.x), side(size.y));
  const auto start = [&](uint most, uint taken) {
    return static_cast<uint>(random.below(most - taken + 1));
  };
  const uvec2 first(start(size.x, extent.x), start(size.y, extent.y));
  return {first, first + extent - 1u};
}

Footprint pixelsOf(const Rectangle& r) {
  return {{r.first.x, r.last.x + 1}, {r.first.y, r.last.y + 1}};
}

/// What the contract's query finds in a pyramid, and the smallest that it may be.
struct Found {
  double depth = std::numeric_limits<double>::infinity(), least = depth;
};

Found query(const DepthBuffer& depths, const PyramidShape& shape, const Pyramid& pyramid,
            const Rectangle& r) {
  Found found;
  const auto element = shape.elementFor(r.first, r.last);
  for (const uint y : {r.first.y, r.last.y})
    for (const uint x : {r.first.x, r.last.x}) {
      if (!element) {
        found.depth = std::min<double>(found.depth, depths.at(x, y));
        found.least = found.depth;
        continue;
      }
      const uvec2 texel = shape.texelOf(*element, {x, y});
      const std::size_t at = std::size_t{texel.y} * shape.size(*element).x + texel.x;
      found.depth = std::min<double>(found.depth, pyramid[*element][at]);
      found.least = std::min(found.least, farthest<double>(depths, shape.most(*element, texel)));
    }
  return found;
}

}  // namespace

void PyramidCase::aConstantStaysConstant() {
  for (const uvec2 size : {uvec2(1, 7), uvec2(3, 5), uvec2(67, 129)})
    for (const float depth : {0.0f, 0.375f, 1.0f}) {
      const PyramidShape shape = shapeOf(size);
      const Pyramid pyramid = pyramidOf(constantDepths(size, depth));
      for (uint element = 0; element < shape.elements(); ++element)
        for (uint i = 0; i < pyramid[element].size(); ++i) {
          const uint width = shape.size(element).x;
          if (shape.own(element, {i % width, i / width}).empty()) continue;
          EXPECT_EQ(pyramid[element][i], depth) << "level " << element + 1 << ", texel " << i;
        }
      checked(texelsIn(pyramid));
    }
}

void PyramidCase::theTopIsTheGlobalMinimum() {
  for (const uvec2 size : {uvec2(1, 7), uvec2(3, 5), uvec2(129, 191), uvec2(255, 64)}) {
    DepthBuffer depths = generatedDepths(size, caseSeed() + size.x);
    std::ranges::replace(depths.depths, 0.0f, 0.5f);  // else it is the sky
    const Pyramid pyramid = pyramidOf(depths);
    ASSERT_EQ(pyramid.back().size(), 1u);
    EXPECT_EQ(pyramid.back()[0], *std::ranges::min_element(depths.depths)) << size.x;
    checked(1);
  }
}

void PyramidCase::loweringADepthRaisesNoTexel() {
  const uvec2 size(131, 77);
  DepthBuffer depths = generatedDepths(size, caseSeed());
  Random random(caseSeed());
  Pyramid before = pyramidOf(depths);
  for (int step = 0; step < 4; ++step) {
    for (int i = 0; i < 16; ++i) depths.depths[random.below(depths.depths.size())] *= 0.25f;
    Pyramid after = pyramidOf(depths);
    for (std::size_t element = 0; element < before.size(); ++element)
      for (std::size_t i = 0; i < before[element].size(); ++i)
        EXPECT_LE(after[element][i], before[element][i])
            << "level " << element + 1 << ", texel " << i;
    EXPECT_NE(after, before);
    checked(texelsIn(after));
    before = std::move(after);
  }
}

// Sides that are powers of two: elsewhere the last texel, which takes the rest, has no mirror.
void PyramidCase::mirroringMirrorsEveryLevel() {
  if (lookup() == Lookup::kPreviousPow2)
    GTEST_SKIP() << "of a texel in the centre of a pixel the next one may count, on one side";
  const uvec2 size(256, 128);
  const DepthBuffer depths = generatedDepths(size, caseSeed());
  const Pyramid pyramid = pyramidOf(depths);
  for (const bool rows : {false, true}) {
    const Pyramid turned = pyramidOf({size, mirrored(depths.depths, size.x, rows)});
    for (uint element = 0; element < pyramid.size(); ++element)
      EXPECT_EQ(turned[element], mirrored(pyramid[element], shapeOf(size).size(element).x, rows))
          << "level " << element + 1 << (rows ? ", rows too" : "");
    checked(texelsIn(turned));
  }
}

void PyramidCase::aLevelHasTheLevelsAboveItForItsPyramid() {
  if (lookup() != Lookup::kPinned) GTEST_SKIP() << "the levels of other pyramids need not nest";
  for (const uvec2 size : {uvec2(129, 191), uvec2(37, 5), uvec2(130, 66)}) {
    const Pyramid pyramid = pyramidOf(generatedDepths(size, caseSeed() + size.x));
    const Pyramid above = pyramidOf({shapeOf(size).size(0), pyramid[0]});
    EXPECT_EQ(above, Pyramid(pyramid.begin() + 1, pyramid.end())) << size.x << " x " << size.y;
    checked(texelsIn(above));
  }
}

void PyramidCase::noQueryIsNearerThanADepthInIt() {
  constexpr std::size_t kQueries = 2000;
  for (const uvec2 size : {uvec2(1, 7), uvec2(67, 129), uvec2(191, 63)}) {
    const DepthBuffer depths = holedDepths(size, caseSeed());
    const PyramidShape shape = shapeOf(size);
    const Pyramid pyramid = pyramidOf(depths);
    Random random(caseSeed() + size.x);
    for (std::size_t i = 0; i < kQueries; ++i) {
      const Rectangle r = anyRectangle(random, size);
      const Found found = query(depths, shape, pyramid, r);
      const double least = farthest<double>(depths, pixelsOf(r));
      ASSERT_LE(found.depth, least) << "pixels (" << r.first.x << ", " << r.first.y << ") to ("
                                    << r.last.x << ", " << r.last.y << ")";
      ASSERT_GE(found.depth, found.least) << "less than every depth that its texels may have seen";
    }
    checked(kQueries);
  }
}

}  // namespace gnomon::culling
