// Stimulus of stage brdf: named domains, each with what it is for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "harness/cases/case_input.h"
#include "harness/cases/random.h"
#include "kernels/brdf/brdf.h"

namespace gnomon::brdf {

/// Directions all around, r in [0.2, 1]: what a scene is made of.
std::vector<Sample> bulk(std::size_t n, std::uint64_t seed);

/// The half vector drawn from the GGX lobe itself at r in [0, 0.2], where D is steep.
std::vector<Sample> lobe(std::size_t n, std::uint64_t seed);

/// NoV or NoL within 0.05 of the horizon, on both sides of it and of the clamps.
std::vector<Sample> grazing(std::size_t n, std::uint64_t seed);

/// r in [0.8, 1.2], dielectric and metal, so that the clamp at 1 acts.
std::vector<Sample> rough(std::size_t n, std::uint64_t seed);

/// Every field at every special value that floats have, one or two at a time, in an otherwise
/// ordinary sample.
std::vector<Sample> degenerate();

/// The parts of an input, for whoever shrinks and replays it.
void parts(Parts& p, std::vector<Sample>& samples);

/// One sample in words, a line for each field.
std::string describe(const Sample& sample);

}  // namespace gnomon::brdf
