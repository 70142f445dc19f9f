// Host side of stage precision: one entry for each operation, all from one shader.
#include "precision.h"

#include <fmt/format.h>

#include "harness/program/kernel.h"

namespace gnomon::precision {
namespace {

KernelRecord entry(const char* name, uint operation) {
  return {
      .order = 0,
      .stage = "precision",
      .entry = name,
      .file = "precision/operation.comp",
      .buffers = {{"arguments", kArguments, Access::kRead,
                   describe<Arguments>("Arguments", field("x", &Arguments::x),
                                       field("y", &Arguments::y))},
                  {"results", kResults, Access::kWrite,
                   describe<Result>("Result", field("value", &Result::value))}},
      .push = describe<Measure>("Measure", field("count", &Measure::count)),
      .groupSize = {kGroupSize, 1, 1},
      .grid = coveringGrid({kGroupSize, 1, 1}),
      .features = {"scalarBlockLayout"},
      .specialization = {{kOperationId, operation}},
      .deterministic = true,
      .summary = fmt::format("the built-in {} over its domain, and its worst error here", name),
  };
}

const bool registered =
    registerKernel(entry("divide", kDivide)) &&
    registerKernel(entry("inversesqrt", kInverseSqrt)) && registerKernel(entry("sqrt", kSqrt)) &&
    registerKernel(entry("exp", kExp)) && registerKernel(entry("exp2", kExp2)) &&
    registerKernel(entry("log", kLog)) && registerKernel(entry("log2", kLog2)) &&
    registerKernel(entry("pow", kPow)) && registerKernel(entry("sin", kSin)) &&
    registerKernel(entry("cos", kCos)) && registerKernel(entry("tan", kTan)) &&
    registerKernel(entry("asin", kAsin)) && registerKernel(entry("acos", kAcos)) &&
    registerKernel(entry("atan", kAtan)) && registerKernel(entry("atan2", kAtan2)) &&
    registerKernel(entry("add", kAdd)) && registerKernel(entry("multiply", kMultiply)) &&
    registerKernel(entry("fma", kFma));

}  // namespace
}  // namespace gnomon::precision
