// The model of brdf/evaluate against truth that does not come from it. No GPU.
//
// Covered: D against Walter's printed form, its normalisation, an importance sampler (chi-square);
// Smith's G1 against a published table and the weak furnace; Schlick's fit against Smith; Fresnel's
// ends; closed forms and bounds of the directional albedo; what must be told apart.
// Not covered: measured materials.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "reference/brdf/evaluate.h"
#include "reference/truth/microfacet.h"
#include "reference/truth/quadrature.h"
#include "reference/truth/statistics.h"
#include "tests/brdf/domains.h"

namespace gnomon::brdf {
namespace {

constexpr double kPi = std::numbers::pi;

// The model's constants are floats (0.1f, not 0.1), so it differs from truth by their rounding:
// half an ULP for each constant and its power, here pi once and twice for squares.
constexpr double kFloatConstants = 4 * std::numeric_limits<float>::epsilon();

double modelD(double theta, double alpha) {
  return D_GGX({0, std::sin(theta), 0}, std::cos(theta), alpha);
}

constexpr std::array kAlphas = {0.002025, 0.01, 0.04, 0.1, 0.25, 0.5, 0.75, 1.0};

TEST(BrdfEvaluateModel, DIsTheFormThatWalterPrinted) {
  for (const double alpha : kAlphas)
    for (double theta = 0; theta < kPi / 2; theta += kPi / 64)
      EXPECT_LE(std::abs(modelD(theta, alpha) / truth::ggx(theta, alpha) - 1), kFloatConstants)
          << "alpha " << alpha << ", theta " << theta;
}

TEST(BrdfEvaluateModel, DTimesNoHIntegratesToOne) {
  for (const double alpha : kAlphas) {
    const double integral = truth::hemisphere(
        [&](double theta, double) { return modelD(theta, alpha) * std::cos(theta); }, alpha, 96);
    EXPECT_LE(std::abs(integral - 1), kFloatConstants) << "alpha " << alpha;
  }
}

// Half vectors drawn by Walter's eqs. 35, 36 against bins filled by integrating our D NoH.
TEST(BrdfEvaluateModel, AnImportanceSamplerFollowsD) {
  constexpr std::size_t kSamples = 100'000, kBins = 64;
  const Policy& policy = Session::current().policy();
  const double significance = truth::sidak(policy["chiSquareSignificance"], kAlphas.size());
  const truth::GaussLegendre rule(32);
  for (const double alpha : kAlphas) {
    Random random(caseSeed());
    std::vector<double> counts(kBins), expected(kBins);
    // Bins of equal probability under the sampler's own distribution: theta(u) at u = i / kBins.
    for (std::size_t i = 0; i < kSamples; ++i) {
      const double theta = truth::sampleGgx(random.uniform(), 0, alpha)[0];
      const double t2 = std::pow(std::tan(theta) / alpha, 2);
      counts[std::min(kBins - 1, static_cast<std::size_t>(kBins * (t2 / (1 + t2))))] += 1;
    }
    for (std::size_t b = 0; b < kBins; ++b) {
      const auto edge = [&](std::size_t i) {
        return truth::sampleGgx(static_cast<double>(i) / kBins, 0, alpha)[0];
      };
      expected[b] = kSamples * rule(edge(b), b + 1 == kBins ? kPi / 2 : edge(b + 1), [&](double t) {
                      return 2 * kPi * modelD(t, alpha) * std::cos(t) * std::sin(t);
                    });
    }
    EXPECT_GE(truth::chiSquareTest(counts, expected), significance) << "alpha " << alpha;
  }
}

// Smith G1 for GGX at alpha = 0.1, theta from pi/3 to pi/2 in 19 steps: Mitsuba 3,
// test_microfacet.py, test03_smith_g1_ggx, printed with eight digits. It was computed in float32: a
// theta in [1, 2) is rounded by at most 2^-24, its cosine below 1/2 by 2^-26, together below 2^-23.
TEST(BrdfEvaluateModel, SmithG1IsThePublishedTable) {
  constexpr std::array kTable = {9.9261039e-01, 9.9160647e-01, 9.9042398e-01, 9.8901933e-01,
                                 9.8733366e-01, 9.8528832e-01, 9.8277503e-01, 9.7964239e-01,
                                 9.7567332e-01, 9.7054905e-01, 9.6378750e-01, 9.5463598e-01,
                                 9.4187391e-01, 9.2344058e-01, 8.9569420e-01, 8.5189372e-01,
                                 7.7902949e-01, 6.5144652e-01, 4.1989169e-01};
  constexpr double kAlpha = 0.1, kCosineError = 0x1p-23;
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    const double theta = kPi / 3 + (kPi / 2 - kPi / 3) * static_cast<double>(i) / 19;
    // dG1/dcos is at most 2 / alpha (at the horizon), so that much of the cosine's error arrives;
    // the last printed digit is 1e-8.
    EXPECT_LE(std::abs(truth::smithG1(std::cos(theta), kAlpha) - kTable[i]),
              kCosineError * 2 / kAlpha + 1e-8 / 2)
        << "theta " << theta;
  }
}

// Heitz 2014, eq. 77 with G1: the weak white furnace, int D G1(v) |VoH|+ / NoV ... = 1.
TEST(BrdfEvaluateModel, TheWeakFurnaceHoldsForSmithAndNotForSchlick) {
  const auto furnace = [](double NoV, double alpha, auto&& G1) {
    const double vx = std::sqrt(1 - NoV * NoV);
    return truth::hemisphere(
        [&](double theta, double phi) {
          const double VoH = vx * std::sin(theta) * std::cos(phi) + NoV * std::cos(theta);
          return VoH > 0 ? modelD(theta, alpha) * G1(NoV, alpha) * VoH / NoV : 0.0;
        },
        alpha, 128);
  };
  const auto schlick = [](double NoV, double alpha) {
    return G1_Schlick(NoV, kDirect(std::sqrt(alpha)));
  };
  for (const double alpha : {0.1, 0.25, 0.5, 1.0})
    for (const double NoV : {0.1, 0.5, 0.9, 1.0}) {
      // The integrand has a kink where VoH = 0, which the ring of 128 points crosses: error 1/128^2
      // of the part beyond it, which is at most 1, for each of at most 8 rings that it cuts.
      constexpr double kKink = 8.0 / (128 * 128);
      EXPECT_LE(std::abs(furnace(NoV, alpha, truth::smithG1) - 1), kKink) << alpha << " " << NoV;
      // For Schlick's fit the integral is the ratio of the two G1, by the same equation.
      const double ratio = schlick(NoV, alpha) / truth::smithG1(NoV, alpha);
      EXPECT_LE(std::abs(furnace(NoV, alpha, schlick) - ratio), kKink) << alpha << " " << NoV;
    }
}

TEST(BrdfEvaluateModel, FresnelIsF0HeadOnAndOneAtGrazing) {
  const Vec3<double> F0{0.04, 0.5, 1};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(F_Schlick(1.0, F0)[c], F0[c]);
    EXPECT_EQ(F_Schlick(0.0, F0)[c], 1.0);
    EXPECT_EQ(F_SchlickRoughness(1.0, F0, 0.3)[c], F0[c]);
    EXPECT_EQ(F_SchlickRoughness(0.0, F0, 0.3)[c], std::max(1 - 0.3, F0[c]));
  }
}

// D = 1/pi and G1(x) = 2x / (1 + x) at alpha = 1, so E(NoV = 1) = int mu / (1 + mu) = 1 - ln 2.
TEST(BrdfEvaluateModel, SpecularAlbedoOfARoughMirrorSeenHeadOnIsOneMinusLogTwo) {
  const double albedo = truth::GaussLegendre(64)(0, 1, [](double mu) {
    const Sample s{.normal = {0, 0, 1},
                   .roughness = 1,
                   .view = {0, 0, 1},
                   .metallic = 1,
                   .light = vec3(std::sqrt(1 - mu * mu), 0, mu),
                   .albedo = vec3(1),
                   .irradiance = vec3(1)};
    return 2 * kPi * evaluate<double>(s).radiance.x;
  });
  // The light's direction is rounded to float as well.
  EXPECT_LE(std::abs(albedo - (1 - std::numbers::ln2)), kFloatConstants);
}

// Directional albedo of the specular lobe by the model's own G and F.
double specularAlbedo(double NoV, double r, double F0) {
  const double k = kDirect(r);
  return truth::specularAlbedo(
      NoV, r * r,
      [&](double NoL, double VoH) {
        return G1_Schlick(NoV, k) * G1_Schlick(NoL, k) * F_Schlick(VoH, Vec3<double>{F0, F0, F0}).x;
      },
      200);
}

TEST(BrdfEvaluateModel, AMirrorReflectsAtMostWhatArrives) {
  for (const double r : {0.045, 0.1, 0.25, 0.5, 0.75, 1.0})
    for (const double NoV : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0})
      EXPECT_LE(specularAlbedo(NoV, r, 1), 1) << r << " " << NoV;
}

// With albedo 1 both lobes together exceed 1, because (1 - F) weights diffuse light by the half
// vector alone: known of this BRDF. The largest over this grid, measured with this quadrature, is
// recorded to the digits printed here, so that a change of either lobe is seen.
TEST(BrdfEvaluateModel, DiffusePlusSpecularExceedsOneOnlyByTheKnownAmount) {
  double highest = 0;
  for (const double r : {0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 1.0})
    for (const double NoV : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0}) {
      const double vx = std::sqrt(1 - NoV * NoV);
      const auto diffuse = [&](double theta, double phi) {
        const Sample s{.normal = {0, 0, 1},
                       .roughness = static_cast<float>(r),
                       .view = vec3(vx, 0, NoV),
                       .metallic = 0,
                       .light = vec3(std::sin(theta) * std::cos(phi),
                                     std::sin(theta) * std::sin(phi), std::cos(theta)),
                       .albedo = vec3(1),
                       .irradiance = vec3(1)};
        return evaluate<double>(s).diffuse.x * std::cos(theta);
      };
      highest = std::max(highest,
                         truth::hemisphere(diffuse, 1, 48) + specularAlbedo(NoV, r, kDielectricF0));
    }
  constexpr double kRecorded = 1.073257, kLastDigit = 1e-6;
  EXPECT_LE(std::abs(highest - kRecorded), kLastDigit / 2);
}

// The three confusions of this stage - k for image-based light, alpha for r, NoV for VoH - leave
// the interval wherever they change the result by more than what the bulk domain must resolve.
TEST(BrdfEvaluateModel, TheBoundTellsTheUsualConfusionsApart) {
  // Relative: six times the wider of the medians measured in bulk (G 1.7e-6, F 4.1e-7), so that the
  // wider ones among single intervals resolve it too.
  constexpr double kResolution = 1e-5;
  const Rules rules = Rules::specification(Rounding::nearestEven);
  const UseRules scope(rules);
  std::size_t lit = 0, resolved = 0;
  // Whether a confusion changes the result enough to be seen; if it does, it must be outside.
  const auto separates = [&](double right, double confused, const Bounded& allowed) {
    if (std::abs(confused / right - 1) <= kResolution) return;
    ++resolved;
    EXPECT_GT(budgetUsed(confused, allowed, false), 1);
  };
  for (const Sample& s : bulk(4096, caseSeed())) {
    const auto allowed = explore([&] { return evaluate<Bounded>(s); });
    const auto unit = [](const vec3& v) { return glm::normalize(glm::dvec3(v)); };
    const glm::dvec3 n = unit(s.normal), v = unit(s.view), l = unit(s.light);
    const double NoV = glm::dot(n, v), NoL = glm::dot(n, l), r = s.roughness;
    if (NoV < 0.05 || NoL < 0.05) continue;
    ++lit;
    const auto G = [&](double k) { return G1_Schlick(NoV, k) * G1_Schlick(NoL, k); };
    separates(G(kDirect(r)), G(r * r / 2), allowed.G);
    separates(G(kDirect(r)), G(kDirect(r * r)), allowed.G);
    const double F0 = 0.04 * (1 - double{s.metallic}) + double{s.albedo.x} * s.metallic;
    const auto F = [&](double c) { return F_Schlick(c, Vec3<double>{F0, F0, F0}).x; };
    separates(F(glm::dot(v, glm::normalize(v + l))), F(NoV), allowed.F.x);
  }
  ASSERT_GT(lit, 500u);
  // Only r near 1, cosines near each other or F0 near 1 are too close to tell.
  EXPECT_GE(resolved * 100, 3 * lit * 95);
}

}  // namespace
}  // namespace gnomon::brdf
