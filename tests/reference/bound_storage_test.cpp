// What narrow formats keep of a float.
//
// Covered: every code of every format decodes and encodes to itself and is stored exactly; a value
// between two codes may become either; clamps, overflow, NaN, flushed halves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/bound/storage.h"

namespace gnomon {
namespace {

testing::AssertionResult is(const Bounded& x, double lo, double hi) {
  if (x.lo == lo && x.hi == hi) return testing::AssertionSuccess();
  return testing::AssertionFailure() << x << " should be [" << lo << ", " << hi << ']';
}

struct Format {
  const char* name;
  Storage storage;
  std::uint32_t codes;
};
const Format kFormats[] = {
    {"half", Storage::half, 0x10000},       {"unorm8", Storage::unorm8, 0x100},
    {"snorm8", Storage::snorm8, 0x100},     {"unorm16", Storage::unorm16, 0x10000},
    {"ufloat11", Storage::ufloat11, 0x800}, {"ufloat10", Storage::ufloat10, 0x400},
};

// All values of a format, in order, each once.
std::vector<double> valuesOf(const Format& format) {
  std::vector<double> values;
  for (std::uint32_t bits = 0; bits < format.codes; ++bits)
    if (const double x = decode(bits, format.storage); std::isfinite(x)) values.push_back(x);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// Largest values: half (2 - 2^-10) 2^15, the small floats (2 - 2^-6) 2^15 and (2 - 2^-5) 2^15.
TEST(BoundStorage, FormatsEndWhereTheyShould) {
  EXPECT_EQ(valuesOf(kFormats[0]).back(), 65504);
  EXPECT_EQ(valuesOf(kFormats[1]).back(), 1);
  EXPECT_EQ(valuesOf(kFormats[2]).front(), -1);
  EXPECT_EQ(valuesOf(kFormats[4]).back(), 65024);
  EXPECT_EQ(valuesOf(kFormats[5]).back(), 64512);
  EXPECT_EQ(decode(0x3c00, Storage::half), 1);
  EXPECT_EQ(decode(0x0001, Storage::half), 0x1p-24);
  EXPECT_EQ(decode(0x80, Storage::snorm8), -1);
}

TEST(BoundStorage, EveryCodeSurvives) {
  for (const Format& format : kFormats)
    for (const double x : valuesOf(format)) {
      EXPECT_EQ(decode(encode(x, format.storage), format.storage), x) << format.name;
      const Bounded got = stored(Bounded::between(x, x), format.storage);
      // A code of a normalised format is no float: one float on either side of it.
      EXPECT_TRUE(got.lo <= x && x <= got.hi) << format.name << ' ' << x << ' ' << got;
    }
}

TEST(BoundStorage, BetweenTwoValuesEitherIsStored) {
  for (const Format& format : kFormats) {
    const std::vector<double> values = valuesOf(format);
    for (std::size_t i = 1; i < values.size(); ++i) {
      for (const double share : {0.25, 0.75}) {
        const double exact = values[i - 1] + (values[i] - values[i - 1]) * share;
        const auto between = static_cast<float>(exact);
        const Bounded got = stored(Bounded(between), format.storage);
        ASSERT_TRUE(is(got, floorToFloat(values[i - 1]), ceilToFloat(values[i]))) << format.name;
        ASSERT_EQ(decode(encode(between, format.storage), format.storage),
                  share < 0.5 ? values[i - 1] : values[i])
            << format.name << ' ' << between;
      }
    }
  }
}

TEST(BoundStorage, FloatsOverflowToTheLargestOrInfinity) {
  EXPECT_TRUE(is(stored(Bounded(65505), Storage::half), 65504, kInfinity));
  EXPECT_TRUE(is(stored(Bounded(-1e30f), Storage::half), -kInfinity, -65504));
  EXPECT_EQ(encode(65519.9, Storage::half), 0x7bffU);
  EXPECT_EQ(encode(65520, Storage::half), 0x7c00U);  // half a step, 16, above 65504
  EXPECT_TRUE(is(stored(Bounded(-3), Storage::ufloat11), 0, 0));
}

TEST(BoundStorage, NormalisedFormatsClamp) {
  EXPECT_TRUE(is(stored(Bounded(7), Storage::unorm8), 1, 1));
  EXPECT_TRUE(is(stored(Bounded(-7), Storage::unorm16), 0, 0));
  EXPECT_TRUE(is(stored(Bounded(-7), Storage::snorm8), -1, -1));
  EXPECT_TRUE(is(stored(Bounded(std::numeric_limits<float>::quiet_NaN()), Storage::unorm8), 0, 1));
}

TEST(BoundStorage, DenormalHalvesAreFlushedOnlyByPacking) {
  EXPECT_TRUE(is(stored(Bounded(0x1p-20f), Storage::half), 0x1p-20, 0x1p-20));
  EXPECT_TRUE(is(stored(Bounded(0x1p-20f), Storage::packedHalf), 0, 0x1p-20));
}

TEST(BoundStorage, FloatKeepsEverything) {
  EXPECT_TRUE(is(stored(Bounded(0.1f), Storage::float32), 0.1f, 0.1f));
  EXPECT_EQ(encode(1, Storage::float32), 0x3f800000U);
}

TEST(BoundStorage, PackedColourHasACoarserBlue) {
  // 1 + 1/64 + 1/128 lies between codes of both; 1/32 apart in blue, 1/64 in red.
  const Vec3<Bounded> got = storedR11G11B10(Vec3<Bounded>(1.0234375f));
  EXPECT_TRUE(is(got.x, 1 + 1 / 64.0, 1 + 2 / 64.0));
  EXPECT_TRUE(is(got.z, 1, 1 + 1 / 32.0));
}

}  // namespace
}  // namespace gnomon
