#include "bench/timing.h"

#include <chrono>

#include "bench/stopwatch.h"
#include "harness/error.h"

namespace gnomon {
namespace {

// Google Benchmark would run what is quick thousands of times, each with its sweep of the caches:
// as many runs for everything instead, in one iteration.
constexpr int kRuns = 9;

Written named(const Resources& resources, Aftermath after) {
  Written written;
  for (std::size_t i = 0; i < resources.outputs().size(); ++i)
    written[resources.outputs()[i].name] = std::move(after.outputs[i]);
  return written;
}

void setRates(benchmark::State& state, std::size_t items, std::size_t bytes) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(items));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
  const double copied = Stopwatch::current().copyBytesPerSecond();
  const double moved = static_cast<double>(state.iterations()) * static_cast<double>(bytes);
  state.counters["share_of_copy"] = {moved / copied, benchmark::Counter::kIsRate};
}

}  // namespace

benchmark::internal::Benchmark* timed(benchmark::internal::Benchmark* benchmark) {
  return benchmark->Unit(benchmark::kMicrosecond)->UseManualTime();
}

Written timeKernel(benchmark::State& state, const std::string& kernel, const Stimulus& given,
                   std::optional<std::size_t> bytes) {
  Session& session = Session::current();
  Stimulus stimulus = given;
  stimulus.limit = session.limit();
  try {
    const Subject& subject = session.subject(kernel);
    if (subject.gpu().info().timestampPeriodNs == 0) throw Unsupported("no GPU timestamps");
    Resources resources(subject, stimulus, Target::kContract);
    resources.upload();
    // The first run pays for what the driver does once.
    Written written = named(resources, resources.run(subject.plain(), 0));
    Stopwatch::current().wake();
    for (auto _ : state)
      state.SetIterationTime(
          leastOf(kRuns, [&] { return Stopwatch::current().cold(resources, subject.plain()); }));
    setRates(state, stimulus.extent.count(), bytes.value_or(resources.bytes()));
    state.SetLabel(subject.gpu().info().name);
    return written;
  } catch (const Unsupported& why) {
    state.SkipWithError(why.what());
    return {};
  }
}

void timeCpu(benchmark::State& state, std::size_t items, const std::function<void()>& work) {
  using Clock = std::chrono::steady_clock;
  work();
  const auto run = [&] {
    const auto begin = Clock::now();
    work();
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  for (auto _ : state) state.SetIterationTime(leastOf(kRuns, run));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(items));
  state.SetLabel("one core of the CPU");
}

}  // namespace gnomon
