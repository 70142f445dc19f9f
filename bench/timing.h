// The one way to time a kernel: GPU timestamps as Google Benchmark's manual time.
#pragma once

#include <string>

#include <benchmark/benchmark.h>

#include "harness/hygiene/stimulus.h"

namespace gnomon {

/// Uploads the stimulus once, runs the kernel as it is (not its twin) for every iteration, and sets
/// time, items and bytes a second and the device as label. Bytes are those of all buffers and
/// images of the contract, each once: the least that has to move. An unsupported kernel skips with
/// the reason.
void timeKernel(benchmark::State& state, const std::string& kernel, const Stimulus& given);

}  // namespace gnomon
