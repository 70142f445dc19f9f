// The one way to time a kernel, or what the CPU does in its place: as Google Benchmark's manual
// time.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "harness/hygiene/stimulus.h"

namespace gnomon {

/// Manual time, in microseconds.
benchmark::internal::Benchmark* timed(benchmark::internal::Benchmark* benchmark);

/// What a kernel has written, by the contract's names.
using Written = std::map<std::string, std::vector<std::byte>>;

/// Uploads the stimulus once, runs the kernel as it is (not its twin) several times with cold
/// caches (bench/stopwatch.h), the median being the time of one iteration, and sets items and bytes
/// a second, what share the latter is of a copy's ("share_of_copy"), and the device as label.
/// `bytes` is the least that has to move; left out: all buffers and images of the contract, each
/// once. An unsupported kernel skips with the reason, and has written nothing.
Written timeKernel(benchmark::State& state, const std::string& kernel, const Stimulus& given,
                   std::optional<std::size_t> bytes = {});

/// The same of work on one core of the CPU, whose caches are as the work leaves them.
void timeCpu(benchmark::State& state, std::size_t items, const std::function<void()>& work);

}  // namespace gnomon
