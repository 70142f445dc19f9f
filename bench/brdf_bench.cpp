// brdf/evaluate over the bulk domain: ALU-bound where the arrays are large.
#include "bench/timing.h"
#include "tests/brdf/domains.h"

namespace gnomon::brdf {
namespace {

void evaluateBulk(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const std::vector<Sample> samples = bulk(n, 1);
  const Evaluate push{.count = static_cast<uint>(n)};
  timeKernel(state, "brdf/evaluate",
             {.inputs = {{"samples", std::as_bytes(std::span(samples))}},
              .outputs = {{"results", n}},
              .push = std::as_bytes(std::span(&push, 1)),
              .extent = {n}});
}

BENCHMARK(evaluateBulk)
    ->Name("brdf/evaluate")
    ->RangeMultiplier(16)
    ->Range(1 << 12, 1 << 20)
    ->Apply([](benchmark::internal::Benchmark* b) { timed(b); });

}  // namespace
}  // namespace gnomon::brdf
