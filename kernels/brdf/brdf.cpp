// Host side of stage brdf.
#include "brdf.h"

#include "harness/program/kernel.h"

namespace gnomon::brdf {
namespace {

Struct sample() {
  return describe<Sample>("Sample", field("normal", &Sample::normal),
                          field("roughness", &Sample::roughness, "roughness"),
                          field("view", &Sample::view), field("metallic", &Sample::metallic),
                          field("light", &Sample::light), field("albedo", &Sample::albedo),
                          field("irradiance", &Sample::irradiance));
}

Struct shaded() {
  return describe<Shaded>("Shaded", field("D", &Shaded::D), field("G", &Shaded::G),
                          field("F", &Shaded::F), field("ambientF", &Shaded::ambientF),
                          field("diffuse", &Shaded::diffuse), field("specular", &Shaded::specular),
                          field("radiance", &Shaded::radiance));
}

Struct probes() {
  return describe<EvaluateProbes>(
      "EvaluateProbes", field("n", &EvaluateProbes::n), field("v", &EvaluateProbes::v),
      field("l", &EvaluateProbes::l), field("halfway", &EvaluateProbes::halfway),
      field("r", &EvaluateProbes::r), field("metallic", &EvaluateProbes::metallic),
      field("albedo", &EvaluateProbes::albedo), field("irradiance", &EvaluateProbes::irradiance),
      field("nxh", &EvaluateProbes::nxh), field("NoV", &EvaluateProbes::NoV),
      field("NoL", &EvaluateProbes::NoL), field("VoH", &EvaluateProbes::VoH),
      field("F0", &EvaluateProbes::F0), field("NoH", &EvaluateProbes::NoH),
      field("D", &EvaluateProbes::D), field("G", &EvaluateProbes::G),
      field("F", &EvaluateProbes::F), field("ambientF", &EvaluateProbes::ambientF),
      field("denominator", &EvaluateProbes::denominator));
}

const bool registered = registerKernel({
    .order = 1,
    .stage = "brdf",
    .entry = "evaluate",
    .file = "brdf/evaluate.comp",
    .buffers = {{"samples", kSamples, Access::kRead, sample()},
                {"results", kResults, Access::kWrite, shaded()}},
    .push = describe<Evaluate>("Evaluate", field("count", &Evaluate::count)),
    .features = {"scalarBlockLayout"},
    .deterministic = true,
    .conventions = {{"roughness", {"perceptual", "alpha"}}},
    .functions = {.file = "brdf/evaluate.functions.glsl",
                  .slots = {{.name = "D", .output = "results.D"},
                            {.name = "G", .output = "results.G"},
                            {.name = "F", .output = "results.F"},
                            {.name = "ambientF", .output = "results.ambientF"},
                            {.name = "diffuse", .output = "results.diffuse"},
                            {.name = "specular", .output = "results.specular"},
                            {.name = "radiance", .output = "results.radiance"}}},
    .probes = probes(),
    .summary = "Cook-Torrance D, G, F, lobes and shaded radiance for arrays of inputs",
});

}  // namespace
}  // namespace gnomon::brdf
