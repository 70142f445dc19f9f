// Tone curves and transfer functions of tonemap/resolve's model against truth that does not come
// from it. No GPU.
//
// Covered: every curve against printed values, limits and slopes; Hill's matrices against the
// primaries that they come from; both transfer functions against closed forms and an inverse;
// each number against the function that it stands for. ACES
// itself is a yardstick in tests/reference/tonemap_ocio_test.cpp.
// Not covered: colours outside Rec. 709.
#include <array>
#include <cmath>
#include <limits>

#include <glm/glm.hpp>
#include <gtest/gtest.h>

#include "harness/cases/modelled.h"
#include "harness/cases/random.h"
#include "reference/tonemap/resolve.h"

namespace gnomon::tonemap {
namespace {

// The model's constants are floats (0.59f, not 0.59): each is off by half an ULP at most.
constexpr double kHalfUlp = 0x1p-24;
// Half a unit of the last of six printed digits.
constexpr double kPrinted = 0.5e-6;
// Some roundings of double, for what would be exact in real numbers.
constexpr double kDouble = 4 * std::numeric_limits<double>::epsilon();

constexpr std::array kCurves = {kLinear, kReinhard, kNarkowicz, kHill};
constexpr std::array kTransfers = {kNone, kGamma, kSrgb};

// The model's functions as the tests call them (modelled.h).
double reinhard(double x) {
  return modelled("reinhard", [&]<class T>() { return tonemap::reinhard<T>(given<T>(x)); });
}
double narkowicz(double x) {
  return modelled("narkowicz", [&]<class T>() { return tonemap::narkowicz<T>(given<T>(x)); });
}
Vec3<double> hill(const Vec3<double>& x) {
  return modelled("hill", [&]<class T>() { return tonemap::hill<T>(given<T>(x)); });
}
double encodeGamma(double x) {
  return modelled("encodeGamma", [&]<class T>() { return tonemap::encodeGamma<T>(given<T>(x)); });
}
double encodeSrgb(double x) {
  return modelled("encodeSrgb", [&]<class T>() { return tonemap::encodeSrgb<T>(given<T>(x)); });
}
Vec3<double> curve(uint which, const Vec3<double>& x) {
  constexpr std::array kEntries = {"curve.linear", "curve.reinhard", "curve.narkowicz",
                                   "curve.hill"};
  return modelled(kEntries.at(which),
                  [&]<class T>() { return tonemap::curve<T>(which, given<T>(x)); });
}
double transfer(uint which, double x) {
  constexpr std::array kEntries = {"transfer.none", "transfer.gamma", "transfer.srgb"};
  return modelled(kEntries.at(which),
                  [&]<class T>() { return tonemap::transfer<T>(which, given<T>(x)); });
}

double hillGrey(double x) { return hill(Vec3<double>(x)).x; }

struct Entry {
  double x, y;
};

// Printed to six digits. Every term of numerator and denominator is positive, so their constants
// move the quotient by half an ULP each.
void expectHisPrintedValues() {
  constexpr std::array<Entry, 9> kTable = {{{0, 0},
                                            {0.001, 0.000231},
                                            {0.01, 0.003770},
                                            {0.05, 0.044283},
                                            {0.18, 0.266899},
                                            {0.5, 0.616307},
                                            {1, 0.803797},
                                            {2, 0.914855},
                                            {4, 0.973417}}};
  for (const auto [x, y] : kTable)
    EXPECT_LE(std::abs(narkowicz(x) - y), kPrinted + 2 * kHalfUlp * y) << x;
  EXPECT_LE(std::abs(narkowicz(10.0) - 1.009075), kPrinted + 2 * kHalfUlp * 1.009075);
}

// Ends and crossing of x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14): at infinity the ratio of the
// leading coefficients, at 0 that of the last ones; it is 1 where 0.08 x^2 - 0.56 x - 0.14 = 0.
void expectTheSlopeTheCrossingAndTheLimitOfHisCoefficients() {
  const double far = 0x1p60, near = 0x1p-60;  // the other terms are below 2^-53 of the result
  EXPECT_LE(std::abs(narkowicz(far) / (2.51 / 2.43) - 1), 2 * kHalfUlp);
  EXPECT_LE(std::abs(narkowicz(near) / near / (3.0 / 14) - 1), 2 * kHalfUlp);
  const double crossing = (0.56 + std::sqrt(0.56 * 0.56 + 4 * 0.08 * 0.14)) / (2 * 0.08);
  EXPECT_LE(std::abs(crossing - 7.241657), kPrinted);
  EXPECT_LE(std::abs(narkowicz(crossing) - 1), 2 * kHalfUlp);
}

TEST(TonemapResolveModel, NarkowiczIsHisPrintedFormula) {
  expectHisPrintedValues();
  expectTheSlopeTheCrossingAndTheLimitOfHisCoefficients();
}

// Reinhard et al. 2002, eq. 3: 0.18 / 1.18, 1 / 2, 4 / 5. Inverse: y / (1 - y).
TEST(TonemapResolveModel, ReinhardIsEquationThree) {
  EXPECT_LE(std::abs(reinhard(0.18) - 0.152542), kPrinted);
  EXPECT_EQ(reinhard(1.0), 0.5);
  EXPECT_EQ(reinhard(4.0), 0.8);
  for (const double x : {0x1p-20, 0.01, 0.18, 0.5, 3.0, 16.0}) {
    const double y = reinhard(x);  // the inverse amplifies the rounding of y by 1 / (1 - y) = 1 + x
    EXPECT_LE(std::abs(y / (1 - y) / x - 1), kDouble * (1 + x)) << x;
  }
}

// The constants' half ULPs through Hill's three steps: one of the input matrix, through the fit,
// for which v fit'(v) < 0.37; two of the fit, at most 1 / 0.983729; one of the output matrix, whose
// rows have absolute sums of at most 1.60475 + 0.53108 + 0.07367 < 2.25.
constexpr double kHillConstants = 4 * kHalfUlp * 2.25 / 0.983729;

void expectHillsPublishedTable() {
  constexpr std::array<Entry, 5> kGrey = {
      {{0.18, 0.105591}, {0.5, 0.374308}, {1, 0.619115}, {2, 0.803562}, {10, 0.973822}}};
  for (const auto [x, y] : kGrey)
    EXPECT_LE(std::abs(hillGrey(x) - y), kPrinted + kHillConstants) << x;
  const Vec3<double> red = hill(Vec3<double>{1, 0, 0});
  EXPECT_LE(std::abs(red.x - 0.688028), kPrinted + kHillConstants);
  EXPECT_LT(red.y, 0);  // printed as 0, after saturation
  EXPECT_LE(std::abs(red.z - 0.002639), kPrinted + kHillConstants);
}

// The fit as printed, in double.
double rrtAndOdt(double v) {
  return (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
}

// The rows of both matrices are printed to five digits and sum to 1 within their rounding. What
// enters the fit moves the result by v fit'(v) < 0.37 of it, what leaves it by fit(v) < 1.02.
void expectThatHillKeepsGreyGrey() {
  constexpr double kRowSum = 3 * 0.5e-5;
  for (double x = 0x1p-10; x <= 0x1p10; x *= 2) {
    const Vec3<double> y = hill(Vec3<double>(x));
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_LE(std::abs(y[c] - rrtAndOdt(x)), (0.37 + 1.02) * kRowSum + kHillConstants)
          << x << " " << c;
  }
}

// The fit's constant terms alone, which no other value shows; they move by half an ULP each.
void expectThatHillsBlackIsTheRatioOfTheConstantTerms() {
  const double black = 0.000090537 / 0.238081;
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_LE(std::abs(hill(Vec3<double>(0))[c] + black), (3 * 0.5e-5 + kHillConstants) * black);
}

// Around black the curve is linear: how component i rises with colour c is the printed matrices'
// product times the slope of the printed fit at 0, (p / q)' = (p' q - p q') / q^2. Every term of it
// is moved by half an ULP of one coefficient of either matrix and of the slope's five factors.
void expectThatHillRisesByThePrintedMatricesAndTheFitsSlope() {
  const glm::dmat3 in(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566,
                      0.83777);
  const glm::dmat3 out(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605,
                       1.07602);
  const double p = -0.000090537, dp = 0.0245786, q = 0.238081, dq = 0.4329510;
  const double slope = (dp * q - p * dq) / (q * q);
  // The third derivative leaves 2^-48 of a central difference, the roundings of fit(0) 2^-40.
  constexpr double kStep = 0x1p-24;
  for (std::size_t c = 0; c < 3; ++c) {
    Vec3<double> colour(0);
    colour[c] = kStep;
    const Vec3<double> rise = (hill(colour) - hill(-colour)) / (2 * kStep);
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0, terms = 0;
      for (int k = 0; k < 3; ++k) {
        const double term = out[k][static_cast<int>(i)] * in[static_cast<int>(c)][k] * slope;
        sum += term;
        terms += std::abs(term);
      }
      EXPECT_LE(std::abs(rise[i] - sum), (2 + 5) * kHalfUlp * terms) << i << " of " << c;
    }
  }
}

TEST(TonemapResolveModel, HillRisesFromBlackByHisPrintedCoefficients) {
  expectThatHillsBlackIsTheRatioOfTheConstantTerms();
  expectThatHillRisesByThePrintedMatricesAndTheFitsSlope();
}

// The number chooses; the functions have been tested above, each by itself.
TEST(TonemapResolveParts, EveryNumberIsItsOwnCurveAndTransferFunction) {
  Random random(caseSeed());
  const auto light = [&] { return random.chance(0.1) ? 0.0 : random.logUniform(0x1p-20, 0x1p6); };
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> x{light(), light(), light()};
    const auto each = [&](double (&of)(const double&)) { return map(x, of); };
    const Vec3<double> expected[] = {x, each(tonemap::reinhard<double>),
                                     each(tonemap::narkowicz<double>), tonemap::hill<double>(x)};
    for (const uint which : kCurves)
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(curve(which, x)[c], expected[which][c]) << which << " of " << x[c];
    EXPECT_EQ(transfer(kNone, x.x), x.x);
    EXPECT_EQ(transfer(kGamma, x.x), tonemap::encodeGamma<double>(x.x)) << x.x;
    EXPECT_EQ(transfer(kSrgb, x.x), tonemap::encodeSrgb<double>(x.x)) << x.x;
  }
}

// RGB to XYZ of primaries and a white, both as chromaticities: SMPTE RP 177.
glm::dmat3 toXyz(const std::array<glm::dvec2, 3>& primaries, const glm::dvec2& white) {
  const auto xyz = [](const glm::dvec2& c) { return glm::dvec3(c.x, c.y, 1 - c.x - c.y) / c.y; };
  glm::dmat3 m(xyz(primaries[0]), xyz(primaries[1]), xyz(primaries[2]));
  const glm::dvec3 luminance = glm::inverse(m) * xyz(white);
  for (int c = 0; c < 3; ++c) m[c] *= luminance[c];
  return m;
}

// Chromatic adaptation from one white to another: Lam 1985 (Bradford).
glm::dmat3 bradford(const glm::dvec2& from, const glm::dvec2& to) {
  const glm::dmat3 cone = glm::transpose(
      glm::dmat3(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296));
  const auto response = [&](const glm::dvec2& c) {
    return cone * (glm::dvec3(c.x, c.y, 1 - c.x - c.y) / c.y);
  };
  const glm::dvec3 gain = response(to) / response(from);
  return glm::inverse(cone) * glm::dmat3(gain.x, 0, 0, 0, gain.y, 0, 0, 0, gain.z) * cone;
}

// Hill's comments: sRGB => XYZ => D65_2_D60 => AP1 => RRT_SAT, and ODT_SAT => XYZ => D60_2_D65 =>
// sRGB. Chromaticities: ITU-R BT.709, SMPTE ST 2065-1 (white), ACES S-2014-004 (AP1). Saturation of
// ACES 1.0: towards the luminance of AP1 by 0.96 in the RRT, 0.93 in the ODT.
void expectThePrimariesAndSaturationsOfAces() {
  const glm::dvec2 d65(0.3127, 0.3290), d60(0.32168, 0.33767);
  const glm::dmat3 rec709 = toXyz({{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}}}, d65);
  const glm::dmat3 ap1 = toXyz({{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}}}, d60);
  const auto saturation = [&](double s) {
    const glm::dvec3 Y(ap1[0][1], ap1[1][1], ap1[2][1]);
    return glm::dmat3(s) + (1 - s) * glm::outerProduct(glm::dvec3(1), Y);
  };
  const glm::dmat3 in = saturation(0.96) * glm::inverse(ap1) * bradford(d65, d60) * rec709;
  const glm::dmat3 out = glm::inverse(rec709) * bradford(d60, d65) * ap1 * saturation(0.93);
  // Half a unit of the fifth digit for each of three coefficients: of a row of the first matrix,
  // through a fit nowhere steeper than 0.91 and a row of the second of at most 2.25; and of a row
  // of the second.
  constexpr double kFiveDigits = 3 * 0.5e-5 * (0.91 * 2.25 + 1 / 0.983729) + kHillConstants;
  Random random(caseSeed());
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 x(random.uniform(), random.uniform(), random.uniform());
    const glm::dvec3 v = in * x,
                     y = out * glm::dvec3(rrtAndOdt(v.x), rrtAndOdt(v.y), rrtAndOdt(v.z));
    const Vec3<double> got = hill(Vec3<double>{x.x, x.y, x.z});
    for (int c = 0; c < 3; ++c)
      ASSERT_LE(std::abs(got[static_cast<std::size_t>(c)] - y[c]), kFiveDigits) << i << " " << c;
  }
}

// The leading coefficients' ratio, through output rows that sum to 1 within five digits.
void expectThatHillsWhiteIsItsLimitAndSaturates() {
  const Vec3<double> white = hill(Vec3<double>(kMaxScene));
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_LE(std::abs(white[c] - 1 / 0.983729), 3 * 0.5e-5 / 0.983729 + kHillConstants);
    EXPECT_GT(white[c], 1);
  }
}

TEST(TonemapResolveModel, HillIsAsPublishedOnGreyOnColoursAndAtWhite) {
  expectHillsPublishedTable();
  expectThatHillKeepsGreyGrey();
  expectThePrimariesAndSaturationsOfAces();
  expectThatHillsWhiteIsItsLimitAndSaturates();
}

// By the contract black is 0 and white saturates in every curve but Reinhard's, which tends to 1.
TEST(TonemapResolveModel, CurvesOfGreyRiseFromBlackToWhite) {
  for (const uint which : kCurves) {
    const auto display = [&](double x) { return clamp(curve(which, Vec3<double>(x)).x, 0.0, 1.0); };
    EXPECT_EQ(display(0), 0) << which;
    double before = 0;
    for (double x = 0x1p-32; x <= kMaxScene; x *= 1.03125) {
      EXPECT_GE(display(x), before) << which << " at " << x;
      EXPECT_TRUE(display(x) > before || before == 0 || before == 1) << which << " at " << x;
      before = display(x);
    }
    EXPECT_GE(display(kMaxScene), which == kReinhard ? kMaxScene / (1.0 + kMaxScene) : 1) << which;
  }
}

// Written from the standard's decoding side: threshold 0.04045.
double decodeSrgb(double c) {
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

// Half ULPs of the encoder: 12.92 or 1.055, 0.055 and the exponent, which moves the power by
// |ln x| / 2.4 < 5.8 / 2.4 of its own; decoding has a slope of at most 2.4 / 1.055, its own
// threshold another half unit of 0.04045's last digit of a slope that is continuous to 3e-8.
TEST(TonemapResolveModel, DecodingSrgbGivesBackWhatWasEncoded) {
  constexpr double kEncoder = (1 + 0.055 + 5.8 / 2.4) * 1.055 * kHalfUlp;
  for (double x = 0; x <= 1; x += 0x1p-12)
    EXPECT_LE(std::abs(decodeSrgb(encodeSrgb(x)) - x), kEncoder * 2.4 / 1.055 + 3e-8) << x;
  for (int code = 0; code < 256; ++code)
    EXPECT_EQ(std::lround(255 * encodeSrgb(decodeSrgb(code / 255.0))), code);
}

// 1.055 0.0031308^(1 / 2.4) - 0.055 - 12.92 0.0031308 = -2.85e-8 in exact constants; those of the
// model move either piece of about 0.04 and the 0.095 under it by a few half ULPs.
TEST(TonemapResolveModel, SrgbIsContinuousButForTheKnownJump) {
  const double at = 0.0031308f, above = std::nextafter(at, 1.0);
  for (const auto& encode : {&encodeSrgb, +[](double x) { return transfer(kSrgb, x); }}) {
    const double jump = encode(above) - encode(at);
    EXPECT_LE(std::abs(jump + 2.85e-8), 0.005e-8 + (4 * 0.095 + 0.055 + 0.04) * kHalfUlp);
    EXPECT_NE(jump, 0);
    EXPECT_EQ(encode(at), 12.92f * at);  // the piece that it belongs to, by the standard's <=
  }
}

TEST(TonemapResolveModel, TransfersRiseFromBlackToWhite) {
  for (const uint which : kTransfers) {
    EXPECT_EQ(transfer(which, 0.0), 0) << which;
    EXPECT_LE(std::abs(transfer(which, 1.0) - 1), 2 * kHalfUlp) << which;  // 1.055f - 0.055f
  }
  for (const uint which : {kGamma, kSrgb})
    for (double x = 0; x < 1; x += 0x1p-12)
      // But for the jump of sRGB, which the step is far above.
      EXPECT_LT(transfer(which, x), transfer(which, x + 0x1p-12)) << which << " at " << x;
}

// 0.5^(1 / 2.2) and, where the exponent's half ULP counts most, |ln 2^-24| / 2.2 of it.
TEST(TonemapResolveModel, GammaIsThePowerOneOverTwoPointTwo) {
  EXPECT_LE(std::abs(encodeGamma(0.5) - 0.729740), kPrinted);
  for (double x = 1; x >= 0x1p-24; x /= 2)
    EXPECT_LE(std::abs(std::pow(encodeGamma(x), 2.2) / x - 1), 24 * std::log(2.0) * kHalfUlp) << x;
}

// The contract's 0 below 2^-126; there the power is 2^(-126 / 2.2), and the exponent's half ULP
// moves it by ln 2^-126 / 2.2 of that, and of a double's rounding likewise.
TEST(TonemapResolveModel, GammaBeginsAtTheSmallestNormalFloat) {
  const double least = 0x1p-126, below = std::nextafter(least, 0.0);
  const double first = std::pow(2, -126 / 2.2);
  for (const auto& encode : {&encodeGamma, +[](double x) { return transfer(kGamma, x); }}) {
    EXPECT_LE(std::abs(encode(least) / first - 1), 126 * std::log(2.0) / 2.2 * kHalfUlp);
    EXPECT_EQ(encode(below), 0);
  }
}

}  // namespace
}  // namespace gnomon::tonemap
