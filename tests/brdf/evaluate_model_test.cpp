// The model of brdf/evaluate against truth that does not come from it. No GPU.
//
// Covered: D against Walter's printed form, its normalisation, the weak furnace with Smith's exact
// masking, an importance sampler (chi-square); Schlick's fit of masking at closed forms; Fresnel's
// ends and powers; a whole sample against the contract and those parts, bad input included; closed
// forms and bounds of the directional albedo; what must be told apart.
// Not covered: measured materials.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/modelled.h"
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

// The model's functions, for every test but those that ask its own bound (modelled.h).
double D_GGX(const Vec3<double>& nxh, double NoH, double alpha) {
  return modelled("D_GGX", [&]<class T>() {
    return brdf::D_GGX<T>(given<T>(nxh), given<T>(NoH), given<T>(alpha));
  });
}
double kDirect(double r) {
  return modelled("kDirect", [&]<class T>() { return brdf::kDirect<T>(given<T>(r)); });
}
double G1_Schlick(double NoX, double k) {
  return modelled("G1_Schlick",
                  [&]<class T>() { return brdf::G1_Schlick<T>(given<T>(NoX), given<T>(k)); });
}
Vec3<double> F_Schlick(double VoH, const Vec3<double>& F0) {
  return modelled("F_Schlick",
                  [&]<class T>() { return brdf::F_Schlick<T>(given<T>(VoH), given<T>(F0)); });
}
Vec3<double> F_SchlickRoughness(double NoV, const Vec3<double>& F0, double r) {
  return modelled("F_SchlickRoughness", [&]<class T>() {
    return brdf::F_SchlickRoughness<T>(given<T>(NoV), given<T>(F0), given<T>(r));
  });
}
ShadedOf<double> evaluate(const Sample& s) {
  return modelled("evaluate", [&]<class T>() { return brdf::evaluate<T>(s); });
}

double modelD(double theta, double alpha) {
  return D_GGX({0, std::sin(theta), 0}, std::cos(theta), alpha);
}

constexpr std::array kAlphas = {0.002025, 0.01, 0.04, 0.1, 0.25, 0.5, 0.75, 1.0};

void expectThePrintedForm() {
  for (const double alpha : kAlphas)
    for (double theta = 0; theta < kPi / 2; theta += kPi / 64)
      EXPECT_LE(std::abs(modelD(theta, alpha) / truth::ggx(theta, alpha) - 1), kFloatConstants)
          << "alpha " << alpha << ", theta " << theta;
}

void expectThatDTimesNoHIntegratesToOne() {
  for (const double alpha : kAlphas) {
    const double integral = truth::hemisphere(
        [&](double theta, double) { return modelD(theta, alpha) * std::cos(theta); }, alpha, 96);
    EXPECT_LE(std::abs(integral - 1), kFloatConstants) << "alpha " << alpha;
  }
}

// Half vectors drawn by Walter's eqs. 35, 36 against bins filled by integrating our D NoH.
void expectThatAnImportanceSamplerFollowsD() {
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

// Heitz 2014, eq. 77 with G1: the weak white furnace, int D G1(v) |VoH|+ / NoV ... = 1, for Smith's
// exact masking: what is seen of the microsurface from v covers what is seen of the surface.
void expectTheWeakFurnace() {
  for (const double alpha : {0.1, 0.25, 0.5, 1.0})
    for (const double NoV : {0.1, 0.5, 0.9, 1.0}) {
      const double vx = std::sqrt(1 - NoV * NoV);
      const double furnace = truth::hemisphere(
          [&](double theta, double phi) {
            const double VoH = vx * std::sin(theta) * std::cos(phi) + NoV * std::cos(theta);
            return VoH > 0 ? modelD(theta, alpha) * truth::smithG1(NoV, alpha) * VoH / NoV : 0.0;
          },
          alpha, 128);
      // The integrand has a kink where VoH = 0, which the ring of 128 points crosses: error 1/128^2
      // of the part beyond it, which is at most 1, for each of at most 8 rings that it cuts.
      EXPECT_LE(std::abs(furnace - 1), 8.0 / (128 * 128)) << alpha << " " << NoV;
    }
}

// As printed, as a distribution of a surface's normals has to be, and as drawn. What alters D by a
// factor or an exponent breaks all of these.
TEST(BrdfEvaluateModel, DIsTheDistributionThatWalterPrintedAndSamples) {
  expectThePrintedForm();
  expectThatDTimesNoHIntegratesToOne();
  expectTheWeakFurnace();
  expectThatAnImportanceSamplerFollowsD();
}

// sin^2 is that of |n x h|, whichever way it points: turned about any axis D is the same, and so it
// is mirrored where NoH < 0. Six roundings of sin^2 at most, and twice that in its square.
TEST(BrdfEvaluateModel, DDoesNotDependOnTheDirectionOfNCrossH) {
  constexpr double kDouble = 16 * std::numeric_limits<double>::epsilon();
  Random random(caseSeed());
  for (int i = 0; i < 1000; ++i) {
    const double alpha = kAlphas[random.below(kAlphas.size())], theta = random.uniform(0, kPi / 2);
    const glm::dvec3 to = random.direction() * std::sin(theta);
    for (const double NoH : {std::cos(theta), -std::cos(theta)})
      EXPECT_LE(std::abs(D_GGX({to.x, to.y, to.z}, NoH, alpha) / modelD(theta, alpha) - 1), kDouble)
          << alpha << " " << theta;
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

// Schlick 1994, eq. 15 at cosines whose fifth powers are exact: (1/2)^5 = 1/32, (1/4)^5 = 1/1024.
TEST(BrdfEvaluateModel, FresnelRisesWithTheFifthPower) {
  EXPECT_EQ(F_Schlick(0.5, Vec3<double>{0, 0.5, 1}).x, 1.0 / 32);
  EXPECT_EQ(F_Schlick(0.5, Vec3<double>{0, 0.5, 1}).y, 0.5 + 0.5 / 32);
  EXPECT_EQ(F_Schlick(0.75, Vec3<double>{0.5, 1, 0}).z, 1.0 / 1024);
  // With r = 1/2 grazing reflectance is max(1/2, F0), so it rises by 1/2, 1/4 and not at all.
  constexpr std::array kF0 = {0.0, 0.25, 0.75}, kRise = {0.5, 0.25, 0.0};
  for (const auto& [NoV, power] : {std::array{0.5, 1.0 / 32}, std::array{0.75, 1.0 / 1024}})
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const Vec3<double> F = F_SchlickRoughness(NoV, {kF0[i], kF0[j], kF0[k]}, 0.5);
      EXPECT_EQ(F.x, kF0[i] + kRise[i] * power);
      EXPECT_EQ(F.y, kF0[j] + kRise[j] * power);
      EXPECT_EQ(F.z, kF0[k] + kRise[k] * power);
    }
}

// Karis 2013, p. 3: k = (r + 1)^2 / 8, all of them exact.
TEST(BrdfEvaluateModel, KForPunctualLightGoesFromAnEighthToAHalf) {
  EXPECT_EQ(kDirect(0.0), 1.0 / 8);
  EXPECT_EQ(kDirect(0.5), 9.0 / 32);
  EXPECT_EQ(kDirect(1.0), 1.0 / 2);
}

// Schlick 1994, eq. 19: nothing is hidden head on or where k = 0; everything is at the horizon,
// with slope 1 / k; and at k = 1/2, x = 1/2 two thirds are left.
TEST(BrdfEvaluateModel, SchlicksG1HasItsEndsItsSlopeAndItsMiddle) {
  for (const double k : {0.0, 0.125, 0.25, 0.5}) EXPECT_EQ(G1_Schlick(1.0, k), 1);
  for (const double x : {0.0625, 0.5, 0.875}) EXPECT_EQ(G1_Schlick(x, 0.0), 1);
  for (const double k : {0.125, 0.25, 0.5}) {
    EXPECT_EQ(G1_Schlick(0.0, k), 0);
    EXPECT_EQ(G1_Schlick(0x1p-60, k), 0x1p-60 / k);  // the other term is below 2^-53 of k
  }
  EXPECT_EQ(G1_Schlick(0.5, 0.5), 2.0 / 3);
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
    return 2 * kPi * evaluate(s).radiance.x;
  });
  // The light's direction is rounded to float as well.
  EXPECT_LE(std::abs(albedo - (1 - std::numbers::ln2)), kFloatConstants);
}

float countedIn(float x, float lo, float hi) {
  return std::isfinite(x) ? std::clamp(x, lo, hi) : std::clamp(0.0f, lo, hi);
}

glm::dvec3 countedIn(const vec3& v, float lo, float hi) {
  return {countedIn(v.x, lo, hi), countedIn(v.y, lo, hi), countedIn(v.z, lo, hi)};
}

double largestOf(const glm::dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

Vec3<double> vecOf(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
glm::dvec3 vecOf(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

// What the contract says of a sample (kernels/brdf/brdf.h), made of the functions that the tests
// above have tested, each of a unit half vector. Lobes: Cook and Torrance 1982 with Karis' 4 NoV
// NoL; Lambert.
ShadedOf<double> madeOfItsParts(const Sample& s) {
  const auto unitOrZero = [](const vec3& x) {
    const glm::dvec3 u = countedIn(x, -1, 1);
    return largestOf(u) >= kShortestUnit ? u : glm::dvec3(0);
  };
  const glm::dvec3 n = unitOrZero(s.normal), v = unitOrZero(s.view), l = unitOrZero(s.light);
  const glm::dvec3 zero(0);
  if (n == zero || v == zero || l == zero || largestOf(v + l) < kShortestHalf) return {};

  const glm::dvec3 h = glm::normalize(v + l), albedo = countedIn(s.albedo, 0, 1);
  const double r = countedIn(s.roughness, kMinRoughness, 1), metallic = countedIn(s.metallic, 0, 1);
  const auto cosine = [](const glm::dvec3& a, const glm::dvec3& b) {
    return std::clamp(glm::dot(a, b), 0.0, 1.0);
  };
  const double NoV = std::max<double>(cosine(n, v), kMinNoV), NoL = cosine(n, l);
  const glm::dvec3 F0 = glm::mix(glm::dvec3(kDielectricF0), albedo, metallic);
  const double k = brdf::kDirect<double>(r);
  const double D = brdf::D_GGX<double>(vecOf(glm::cross(n, h)), glm::dot(n, h), r * r);
  const double G = brdf::G1_Schlick<double>(NoV, k) * brdf::G1_Schlick<double>(NoL, k);
  const glm::dvec3 F = vecOf(brdf::F_Schlick<double>(cosine(v, h), vecOf(F0)));
  const glm::dvec3 diffuse =
      (1.0 - F) * (1 - metallic) * albedo / double{std::numbers::pi_v<float>};
  const glm::dvec3 specular = D * F * G / std::max<double>(4 * NoV * NoL, kMinDenominator);
  return {D,
          G,
          vecOf(F),
          brdf::F_SchlickRoughness<double>(NoV, vecOf(F0), r),
          vecOf(diffuse),
          vecOf(specular),
          vecOf((diffuse + specular) * NoL * countedIn(s.irradiance, 0, kMaxIrradiance))};
}

constexpr std::array kScalars = {
    "D",          "G",          "F.x",        "F.y",        "F.z",       "ambientF.x",
    "ambientF.y", "ambientF.z", "diffuse.x",  "diffuse.y",  "diffuse.z", "specular.x",
    "specular.y", "specular.z", "radiance.x", "radiance.y", "radiance.z"};

std::array<double, kScalars.size()> scalarsOf(ShadedOf<double> shaded) {
  std::array<double, kScalars.size()> all{};
  auto take = [at = all.begin()](double x) mutable { *at++ = x; };
  forEachScalar(shaded, take);
  return all;
}

// A unit half vector rounds n x h by 2^-52 of 1; inside the lobe |n x h| is about alpha, and D goes
// with its inverse fourth power: four times 2^-52 / alpha, once in what is judged and once in its
// parts, so eight. All else are a few roundings of numbers of about 1.
const double kUnitHalf =
    8 * std::numeric_limits<double>::epsilon() / (double{kMinRoughness} * kMinRoughness);

void expectMadeOfItsParts(const Sample& s) {
  const auto got = scalarsOf(evaluate(s)), expected = scalarsOf(madeOfItsParts(s));
  for (std::size_t i = 0; i < got.size(); ++i)
    EXPECT_LE(std::abs(got[i] - expected[i]), kUnitHalf * std::max(1.0, std::abs(expected[i])))
        << kScalars[i] << " is " << got[i] << ", of its parts " << expected[i] << "\n"
        << describe(s);
}

TEST(BrdfEvaluateParts, EvaluateIsMadeOfItsParts) {
  constexpr std::size_t kEach = 250;
  for (const auto& domain : {bulk(kEach, caseSeed()), lobe(kEach, caseSeed()),
                             grazing(kEach, caseSeed()), rough(kEach, caseSeed())})
    for (const Sample& s : domain) expectMadeOfItsParts(s);
}

TEST(BrdfEvaluateParts, BadInputCountsAsTheContractSays) {
  for (const Sample& s : degenerate()) expectMadeOfItsParts(s);
}

// By the contract a half vector counts whose largest component, whichever and of whichever sign, is
// 2^-16 or more. v + l is exact here: -1 + 1 and a number of few digits.
TEST(BrdfEvaluateModel, TheHalfVectorCountsFromItsShortestOn) {
  const float least = kShortestHalf, below = std::nextafter(least, 0.0f);
  for (const int axis : {0, 1, 2})
    for (const float sign : {1.0f, -1.0f}) {
      const auto D = [&](float half) {
        vec3 v(0), l(0);
        v[(axis + 1) % 3] = 1, l[(axis + 1) % 3] = -1;
        l[axis] = sign * half;
        // n = v, which is square to the half vector: D = alpha^2 / pi, not 0.
        return evaluate({.normal = v,
                         .roughness = 1,
                         .view = v,
                         .metallic = 0,
                         .light = l,
                         .albedo = vec3(1),
                         .irradiance = vec3(1)})
            .D;
      };
      EXPECT_GT(D(least), 0) << axis;
      EXPECT_EQ(D(below), 0) << axis;
    }
}

// The same for unit vectors, which count from a largest component of 1/2 on.
TEST(BrdfEvaluateModel, AUnitVectorCountsFromItsShortestOn) {
  const float least = kShortestUnit, below = std::nextafter(least, 0.0f);
  for (const int axis : {0, 1, 2})
    for (const float sign : {1.0f, -1.0f})
      for (const int which : {0, 1, 2}) {
        const auto D = [&](float length) {
          std::array vectors = {vec3(1), vec3(1), vec3(1)};
          vectors[static_cast<std::size_t>(which)] = vec3(0);
          vectors[static_cast<std::size_t>(which)][axis] = sign * length;
          return evaluate({.normal = vectors[0],
                           .roughness = 1,
                           .view = vectors[1],
                           .metallic = 0,
                           .light = vectors[2],
                           .albedo = vec3(1),
                           .irradiance = vec3(1)})
              .D;
        };
        EXPECT_GT(D(least), 0) << axis << " " << which;
        EXPECT_EQ(D(below), 0) << axis << " " << which;
      }
}

// A black metal has no F0, so F is (1 - VoH)^5: nothing at all for a VoH of 1, which vectors longer
// than a unit vector would exceed.
TEST(BrdfEvaluateModel, ABlackMetalReflectsNothingHeadOn) {
  const Vec3<double> F = evaluate({.normal = vec3(1),
                                   .roughness = 0.5f,
                                   .view = vec3(1),
                                   .metallic = 1,
                                   .light = vec3(1),
                                   .albedo = vec3(0),
                                   .irradiance = vec3(1)})
                             .F;
  EXPECT_EQ(F.x, 0);
  EXPECT_EQ(F.y, 0);
  EXPECT_EQ(F.z, 0);
}

// Directional albedo of the specular lobe by the model's own G and F, which have tests above and
// stay as they are here.
double specularAlbedo(double NoV, double r, double F0) {
  const double k = brdf::kDirect<double>(r);
  const auto G1 = [&](double x) { return brdf::G1_Schlick<double>(x, k); };
  return truth::specularAlbedo(
      NoV, r * r,
      [&](double NoL, double VoH) {
        return G1(NoV) * G1(NoL) * brdf::F_Schlick<double>(VoH, Vec3<double>(F0)).x;
      },
      200);
}

// Of white light from everywhere.
double diffuseAlbedo(double NoV, double r) {
  const double vx = std::sqrt(1 - NoV * NoV);
  const auto diffuse = [&](double theta, double phi) {
    const Sample s{.normal = {0, 0, 1},
                   .roughness = static_cast<float>(r),
                   .view = vec3(vx, 0, NoV),
                   .metallic = 0,
                   .light = vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                 std::cos(theta)),
                   .albedo = vec3(1),
                   .irradiance = vec3(1)};
    return evaluate(s).diffuse.x * std::cos(theta);
  };
  return truth::hemisphere(diffuse, 1, 48);
}

// A mirror reflects at most what arrives. With albedo 1 both lobes together exceed that, because
// (1 - F) weights diffuse light by the half vector alone: known of this BRDF. The largest over this
// grid, measured with this quadrature, is recorded to the digits printed here, so that a change of
// either lobe is seen.
TEST(BrdfEvaluateModel, EnergyExceedsWhatArrivesOnlyByTheKnownAmount) {
  double highest = 0;
  for (const double NoV : {0.05, 0.1, 0.25, 0.5, 0.75, 1.0}) {
    for (const double r : {0.045, 0.1, 0.25, 0.5, 0.75, 1.0})
      EXPECT_LE(specularAlbedo(NoV, r, 1), 1) << r << " " << NoV;
    for (const double r : {0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 1.0})
      highest = std::max(highest, diffuseAlbedo(NoV, r) + specularAlbedo(NoV, r, kDielectricF0));
  }
  constexpr double kRecorded = 1.073257, kLastDigit = 1e-6;
  EXPECT_LE(std::abs(highest - kRecorded), kLastDigit / 2);
}

// The three confusions of this stage - k for image-based light, alpha for r, NoV for VoH - leave
// the interval wherever they change the result by more than what the bulk domain must resolve.
TEST(BrdfEvaluateBound, TheBoundTellsTheUsualConfusionsApart) {
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
    const auto k = [](double x) { return brdf::kDirect<double>(x); };
    const auto G = [&](double by) {
      return brdf::G1_Schlick<double>(NoV, by) * brdf::G1_Schlick<double>(NoL, by);
    };
    separates(G(k(r)), G(r * r / 2), allowed.G);
    separates(G(k(r)), G(k(r * r)), allowed.G);
    const double F0 = 0.04 * (1 - double{s.metallic}) + double{s.albedo.x} * s.metallic;
    const auto F = [&](double c) { return brdf::F_Schlick<double>(c, Vec3<double>(F0)).x; };
    separates(F(glm::dot(v, glm::normalize(v + l))), F(NoV), allowed.F.x);
  }
  ASSERT_GT(lit, 500u);
  // Only r near 1, cosines near each other or F0 near 1 are too close to tell.
  EXPECT_GE(resolved * 100, 3 * lit * 95);
}

}  // namespace
}  // namespace gnomon::brdf
