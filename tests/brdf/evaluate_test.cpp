// brdf/evaluate: the kernel against the model over five domains, laws on the kernel, bad input.
//
// Covered: every field of the result inside its interval in bulk, lobe, grazing, rough and
// degenerate domains; every probe inside its own; sizes around a group; reciprocity; turned and
// mirrored axes; bounds of every quantity; metals without diffuse; F monotone; the closed form
// E(alpha 1, NoV 1, F 1).
// Not covered: multiple scattering (the contract has none).
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "harness/cases/kernel_case.h"
#include "harness/verdict/parallel.h"
#include "reference/brdf/evaluate.h"
#include "reference/truth/quadrature.h"
#include "tests/brdf/domains.h"

namespace gnomon::brdf {
namespace {

class BrdfEvaluate : public KernelCase {
 protected:
  BrdfEvaluate() : KernelCase("brdf/evaluate") {}

  Observation dispatch(const std::vector<Sample>& samples) {
    const Evaluate push{.count = static_cast<uint>(samples.size())};
    return run({.inputs = {{"samples", std::as_bytes(std::span(samples))}},
                .outputs = {{"results", samples.size()}},
                .push = std::as_bytes(std::span(&push, 1)),
                .extent = {samples.size()}});
  }

  std::vector<Shaded> shade(const std::vector<Sample>& samples) {
    checked(samples.size());
    const Observation seen = dispatch(samples);
    expectClean(seen);
    return elementsOf<Shaded>(seen.twin.at("results"));
  }

  static Expectation modelOf(const std::vector<Sample>& samples) {
    return expectationOf(
        "results", samples.size(),
        [&samples]<class T>(std::size_t i) { return evaluate<T>(samples[i]); },
        [&samples](std::size_t i) { return describe(samples[i]); });
  }

  void expectInsideTheBound(std::vector<Sample> samples) {
    expectConformsOn(std::move(samples), [this](const std::vector<Sample>& s) {
      return Trial{dispatch(s), modelOf(s)};
    });
  }
};

/// Cases that read results directly.
class BrdfEvaluateLaws : public BrdfEvaluate {
 protected:
  void SetUp() override {
    BrdfEvaluate::SetUp();
    skipUnlessEveryOutputIsGiven();
  }
};

/// Cases that judge the intermediates.
class BrdfEvaluateProbes : public BrdfEvaluate {
 protected:
  void SetUp() override {
    BrdfEvaluate::SetUp();
    skipUnlessTheProbesAreOurs();
  }
};

TEST_F(BrdfEvaluate, BulkStaysInsideTheBound) {
  expectInsideTheBound(bulk(generated("bulkElements"), caseSeed()));
}

TEST_F(BrdfEvaluate, LobeStaysInsideTheBound) {
  expectInsideTheBound(lobe(generated("elementsPerDomain"), caseSeed()));
}

TEST_F(BrdfEvaluate, GrazingStaysInsideTheBound) {
  expectInsideTheBound(grazing(generated("elementsPerDomain"), caseSeed()));
}

TEST_F(BrdfEvaluate, RoughStaysInsideTheBound) {
  expectInsideTheBound(rough(generated("elementsPerDomain"), caseSeed()));
}

TEST_F(BrdfEvaluate, BadInputCountsAsTheContractSays) { expectInsideTheBound(degenerate()); }

TEST_F(BrdfEvaluate, EverySizeAroundAGroupIsWrittenExactly) {
  for (const std::size_t n : {0u, 1u, kGroupSize - 1, kGroupSize, kGroupSize + 1, 3 * kGroupSize})
    expectInsideTheBound(bulk(n, caseSeed() + n));
}

TEST_F(BrdfEvaluateProbes, EveryProbeStaysInsideItsBound) {
  // A choice: 16 groups of each domain. What probes are for, the results, has large domains of its
  // own; and degenerate() reaches every guard.
  constexpr std::size_t kElements = 16 * std::size_t{kGroupSize};
  for (const std::vector<Sample>& samples :
       {bulk(kElements, caseSeed()), lobe(kElements, caseSeed()), grazing(kElements, caseSeed()),
        degenerate()})
    expectEveryProbeInside(dispatch(samples), modelOf(samples));
}

TEST_F(BrdfEvaluateProbes, ContractAndModelNameTheSame) {
  const std::vector<Sample> samples = bulk(kGroupSize, caseSeed());
  expectTheModelNamesEveryProbe(std::array{modelOf(samples)});
  checked(samples.size());
}

TEST_F(BrdfEvaluateLaws, EveryResultIsFiniteAndInRange) {
  std::vector<Sample> samples = degenerate();
  const std::vector<Sample> more = grazing(generated("elementsPerDomain"), caseSeed());
  samples.insert(samples.end(), more.begin(), more.end());
  const std::vector<Shaded> results = shade(samples);
  // 1 - F and G are quotients and differences that may miss their range by a few roundings on a
  // conforming device: eight of them, four times what the longest chain of either has.
  constexpr float kSlack = 8 * std::numeric_limits<float>::epsilon();
  for (std::size_t i = 0; i < results.size(); ++i) {
    const Shaded& o = results[i];
    const float* scalars = reinterpret_cast<const float*>(&o);
    for (std::size_t s = 0; s < sizeof(Shaded) / sizeof(float); ++s)
      ASSERT_TRUE(std::isfinite(scalars[s])) << "scalar " << s << " for\n" << describe(samples[i]);
    ASSERT_GE(o.D, 0) << describe(samples[i]);
    for (const float x : {o.G, o.F.x, o.F.y, o.F.z, o.ambientF.x, o.ambientF.y, o.ambientF.z})
      ASSERT_TRUE(x >= 0 && x <= 1 + kSlack) << x << " for\n" << describe(samples[i]);
    for (const vec3& v : {o.diffuse, o.specular})
      ASSERT_TRUE(v.x >= -kSlack && v.y >= -kSlack && v.z >= -kSlack) << describe(samples[i]);
  }
}

// f(l, v) = f(v, l): Walter et al. 2007, sec. 2. The clamp of NoV at kMinNoV is not symmetric, so
// pairs where either cosine is within it, or where rounding could put it there, say nothing.
TEST_F(BrdfEvaluateLaws, SwappingViewAndLightChangesNothing) {
  std::vector<Sample> forward;
  for (const Sample& s : bulk(generated("elementsPerDomain"), caseSeed())) {
    const glm::dvec3 n = glm::normalize(glm::dvec3(s.normal));
    const auto cosine = [&](const vec3& v) { return glm::dot(n, glm::normalize(glm::dvec3(v))); };
    if (std::min(cosine(s.view), cosine(s.light)) > 2 * kMinNoV) forward.push_back(s);
  }
  ASSERT_FALSE(forward.empty());
  std::vector<Sample> backward = forward;
  for (Sample& s : backward) std::swap(s.view, s.light);
  const std::vector<Shaded> there = shade(forward), back = shade(backward);
  const Rules& rules = Session::current().bounds().spec;
  std::atomic<std::size_t> different = there.size();  // some pair that is, if any
  parallelFor(there.size(), [&](std::size_t begin, std::size_t end) {
    const UseRules scope(rules);
    for (std::size_t i = begin; i < end; ++i) {
      const auto allowed = explore([&] { return evaluate<Bounded>(forward[i]); });
      for (int c = 0; c < 3; ++c) {
        const auto component = static_cast<std::size_t>(c);
        const Bounded sum = allowed.specular[component] + allowed.diffuse[component];
        const double a = double{there[i].specular[c]} + there[i].diffuse[c];
        const double b = double{back[i].specular[c]} + back[i].diffuse[c];
        // Each side has the whole interval to itself: both may err by its width, apart.
        if (!(std::abs(a - b) <= 2 * (sum.hi - sum.lo))) different = i;
      }
    }
  });
  if (different < there.size()) ADD_FAILURE() << describe(forward[different]);
}

TEST_F(BrdfEvaluate, TurningAndMirroringTheAxesChangesNothing) {
  expectConformsOn(bulk(generated("elementsPerDomain"), caseSeed()),
                   [this](const std::vector<Sample>& samples) {
                     std::vector<Sample> turned = samples;
                     for (Sample& s : turned)
                       for (vec3 Sample::*v : {&Sample::normal, &Sample::view, &Sample::light})
                         s.*v = {-(s.*v).y, (s.*v).z, (s.*v).x};
                     return Trial{dispatch(turned), modelOf(samples)};
                   });
}

TEST_F(BrdfEvaluateLaws, AMetalHasNoDiffuse) {
  std::vector<Sample> samples = bulk(generated("elementsPerDomain"), caseSeed());
  for (Sample& s : samples) s.metallic = 1;
  for (const Shaded& o : shade(samples)) ASSERT_EQ(o.diffuse, vec3(0));
}

// F falls from 1 to F0 as VoH rises from 0 to 1. The light walks away from the view in steps wide
// enough that (1 - VoH)^5 moves by more than its rounding.
TEST_F(BrdfEvaluateLaws, FresnelRisesAsTheHalfAngleOpens) {
  constexpr int kSteps = 256;
  std::vector<Sample> samples;
  for (int i = 0; i <= kSteps; ++i) {
    // To 89.65 degrees: at 90 the light is opposite to the view.
    const double angle = std::numbers::pi / 2 * (0.25 + 0.7461 * i / kSteps);
    samples.push_back({.normal = {0, 0, 1},
                       .roughness = 0.5f,
                       .view = vec3(std::sin(angle), 0, std::cos(angle)),
                       .metallic = 0,
                       .light = vec3(-std::sin(angle), 0, std::cos(angle)),
                       .albedo = vec3(0.5f),
                       .irradiance = vec3(1)});
  }
  const std::vector<Shaded> results = shade(samples);
  for (std::size_t i = 1; i < results.size(); ++i) ASSERT_GT(results[i].F.x, results[i - 1].F.x);
}

// Directional albedo of the specular lobe at alpha = 1, NoV = 1, F = 1 by quadrature over light
// directions, against the closed form: D = 1/pi, G1(x) = 2x/(1+x), so E = int mu/(1+mu) = 1 - ln 2.
TEST_F(BrdfEvaluateLaws, SpecularAlbedoOfARoughMirrorSeenHeadOnIsOneMinusLogTwo) {
  const truth::GaussLegendre rule(64);
  std::vector<Sample> samples;
  for (const double node : rule.nodes) {
    const double mu = (node + 1) / 2;
    samples.push_back({.normal = {0, 0, 1},
                       .roughness = 1,
                       .view = {0, 0, 1},
                       .metallic = 1,
                       .light = vec3(std::sqrt(1 - mu * mu), 0, mu),
                       .albedo = vec3(1),
                       .irradiance = vec3(1)});
  }
  const std::vector<Shaded> results = shade(samples);
  const UseRules scope(Session::current().bounds().spec);
  double albedo = 0, slack = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const double weight = 2 * std::numbers::pi * rule.weights[i] / 2;
    albedo += weight * results[i].radiance.x;
    const auto allowed = explore([&] { return evaluate<Bounded>(samples[i]); });
    slack += weight * (allowed.radiance.x.hi - allowed.radiance.x.lo);
    // The light's direction itself is rounded to float, and the integrand has slope at most 1.
    slack += weight * std::numeric_limits<float>::epsilon();
  }
  EXPECT_LE(std::abs(albedo - (1 - std::numbers::ln2)), slack);
}

}  // namespace
}  // namespace gnomon::brdf
