#include "tests/brdf/domains.h"

#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "harness/cases/special_floats.h"

namespace gnomon::brdf {
namespace {

vec3 colour(Random& random) {
  return {static_cast<float>(random.uniform()), static_cast<float>(random.uniform()),
          static_cast<float>(random.uniform())};
}

/// Dielectric, metal and everything between, a third each.
float metalness(Random& random) {
  const double u = random.uniform(0, 3);
  return u < 1 ? 0.0f : u < 2 ? 1.0f : static_cast<float>(u - 2);
}

Sample shaded(Random& random, const glm::dvec3& n, const glm::dvec3& v, const glm::dvec3& l,
              double roughness) {
  return {.normal = vec3(n),
          .roughness = static_cast<float>(roughness),
          .view = vec3(v),
          .metallic = metalness(random),
          .light = vec3(l),
          .albedo = colour(random),
          .irradiance = colour(random) * static_cast<float>(random.logUniform(0.01, 100))};
}

template <class Make>
std::vector<Sample> repeat(std::size_t n, std::uint64_t seed, Make make) {
  Random random(seed);
  std::vector<Sample> all;
  all.reserve(n);
  for (std::size_t i = 0; i < n; ++i) all.push_back(make(random));
  return all;
}

/// A direction whose cosine with n is near 0: half of them within the clamp kMinNoV of it.
glm::dvec3 nearHorizon(Random& random, const glm::dvec3& n) {
  const double cosine =
      random.chance(0.5) ? random.uniform(-0.01, 0.05) : random.uniform(-2 * kMinNoV, 2 * kMinNoV);
  return around(n, std::acos(cosine), random.uniform(0, 2 * std::numbers::pi));
}

/// Every member that a special value is put into.
constexpr std::size_t kScalars = sizeof(Sample) / sizeof(float);

float& scalar(Sample& sample, std::size_t index) {
  return reinterpret_cast<float*>(&sample)[index];
}

}  // namespace

std::vector<Sample> bulk(std::size_t n, std::uint64_t seed) {
  return repeat(n, seed, [](Random& random) {
    return shaded(random, random.direction(), random.direction(), random.direction(),
                  random.uniform(0.2, 1));
  });
}

std::vector<Sample> lobe(std::size_t n, std::uint64_t seed) {
  return repeat(n, seed, [](Random& random) {
    const double r = random.uniform(0, 0.2), clamped = std::max(r, double{kMinRoughness});
    const double alpha = clamped * clamped;
    const double u = random.uniform();
    const glm::dvec3 normal = random.direction();
    const glm::dvec3 h = around(normal, std::atan(alpha * std::sqrt(u / (1 - u))),
                                random.uniform(0, 2 * std::numbers::pi));
    const glm::dvec3 v =
        around(normal, std::acos(random.uniform(0.1, 1)), random.uniform(0, 2 * std::numbers::pi));
    return shaded(random, normal, v, 2 * glm::dot(v, h) * h - v, r);
  });
}

std::vector<Sample> grazing(std::size_t n, std::uint64_t seed) {
  return repeat(n, seed, [](Random& random) {
    const glm::dvec3 normal = random.direction();
    const bool view = random.chance(0.6), light = !view || random.chance(0.2);
    const glm::dvec3 v = view ? nearHorizon(random, normal) : random.direction();
    const glm::dvec3 l = light ? nearHorizon(random, normal) : random.direction();
    return shaded(random, normal, v, l, random.uniform(0, 1));
  });
}

std::vector<Sample> rough(std::size_t n, std::uint64_t seed) {
  return repeat(n, seed, [](Random& random) {
    return shaded(random, random.direction(), random.direction(), random.direction(),
                  random.uniform(0.8, 1.2));
  });
}

std::vector<Sample> degenerate() {
  // The last four: squares of 1e-30 and 1e30 are beyond a float's 1e-38 and 3e38, of 1e-10 and 1e10
  // within.
  const std::vector<float> special =
      specialFloats({kMinRoughness, kShortestHalf, kMinNoV, 1e-10f, 1e10f, 1e-30f, 1e30f});
  const Sample ordinary{.normal = glm::normalize(vec3(0.1f, 0.2f, 0.9f)),
                        .roughness = 0.4f,
                        .view = glm::normalize(vec3(0.3f, -0.2f, 0.8f)),
                        .metallic = 0.3f,
                        .light = glm::normalize(vec3(-0.5f, 0.1f, 0.7f)),
                        .albedo = {0.9f, 0.5f, 0.2f},
                        .irradiance = {3.0f, 2.0f, 1.0f}};
  std::vector<Sample> all = {ordinary};
  for (std::size_t i = 0; i < kScalars; ++i)
    for (const float a : special) {
      Sample one = ordinary;
      scalar(one, i) = a;
      all.push_back(one);
      for (const float b : special) {
        Sample two = one;
        scalar(two, (i + 1) % kScalars) = b;
        all.push_back(two);
      }
    }
  for (const float a : special)
    for (vec3 Sample::*vector :
         {&Sample::normal, &Sample::view, &Sample::light, &Sample::albedo, &Sample::irradiance}) {
      Sample whole = ordinary;
      whole.*vector = vec3(a);
      all.push_back(whole);
      Sample same = ordinary;
      same.normal = same.view = same.light = whole.*vector;
      all.push_back(same);
    }
  Sample opposite = ordinary;
  opposite.light = -opposite.view;
  all.push_back(opposite);
  // The half vector's largest component at its least length, next to it, and a little above it. The
  // sum of -1 and 1 is 0 to the bit, so it is the light's x.
  for (const float x : {kShortestHalf, std::nextafter(kShortestHalf, 0.0f),
                        std::nextafter(kShortestHalf, 1.0f), 1.00005f * kShortestHalf}) {
    Sample shortest = ordinary;
    shortest.normal = {1, 0, 0};
    shortest.view = {0, 0, -1};
    shortest.light = {x, 0, 1};
    all.push_back(shortest);
  }
  Sample behind = ordinary;
  behind.view = behind.light = -behind.normal;  // NoH = -1, where a clamped cosine leaves d = 0
  all.push_back(behind);
  return all;
}

void parts(Parts& p, std::vector<Sample>& samples) { p.elements("samples", samples); }

std::string describe(const Sample& s) {
  const auto vector = [](const char* name, const vec3& v) {
    return fmt::format("    {:<11}({:.9g}, {:.9g}, {:.9g})\n", name, v.x, v.y, v.z);
  };
  return vector("normal", s.normal) + fmt::format("    {:<11}{:.9g}\n", "roughness", s.roughness) +
         vector("view", s.view) + fmt::format("    {:<11}{:.9g}\n", "metallic", s.metallic) +
         vector("light", s.light) + vector("albedo", s.albedo) + vector("irradiance", s.irradiance);
}

}  // namespace gnomon::brdf
