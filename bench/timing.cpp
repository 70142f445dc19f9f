#include "bench/timing.h"

#include <algorithm>

#include "harness/cases/session.h"
#include "harness/error.h"

namespace gnomon {
namespace {

struct Timed {
  std::vector<GpuBuffer> buffers;
  Dispatch dispatch;
  std::size_t bytes = 0;
};

Timed prepare(const Subject& subject, const Stimulus& stimulus) {
  Timed timed;
  Gpu& gpu = subject.gpu();
  const auto bind = [&](const std::string& name, std::size_t bytes) {
    timed.buffers.push_back(gpu.allocate(std::max<std::size_t>(bytes, 4)));
    timed.dispatch.buffers.push_back(
        {.slot = {.set = 0, .binding = subject.record().buffer(name).binding},
         .range = timed.buffers.back().size()});
    timed.bytes += bytes;
  };
  for (const InputBytes& in : stimulus.inputs) {
    bind(in.buffer, in.bytes.size());
    gpu.upload(timed.buffers.back(), 0, in.bytes);
  }
  for (const OutputCount& out : stimulus.outputs)
    bind(out.buffer, out.elements * subject.record().buffer(out.buffer).element.size);
  for (std::size_t i = 0; i < timed.buffers.size(); ++i)
    timed.dispatch.buffers[i].buffer = &timed.buffers[i];
  timed.dispatch.program = &subject.plain();
  timed.dispatch.push.assign(stimulus.push.begin(), stimulus.push.end());
  timed.dispatch.groups = subject.record().grid(stimulus.items);
  return timed;
}

}  // namespace

void timeKernel(benchmark::State& state, const std::string& kernel, const Stimulus& stimulus) {
  Session& session = Session::current();
  try {
    const Subject& subject = session.subject(kernel);
    if (subject.gpu().info().timestampPeriodNs == 0) throw Unsupported("no GPU timestamps");
    const Timed timed = prepare(subject, stimulus);
    // The first run pays for what the driver does once.
    subject.gpu().run({&timed.dispatch, 1}, session.limit());
    for (auto _ : state)
      state.SetIterationTime(subject.gpu().run({&timed.dispatch, 1}, session.limit()).front() *
                             1e-9);
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(stimulus.items));
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(timed.bytes));
    state.SetLabel(subject.gpu().info().name);
  } catch (const Unsupported& why) {
    state.SkipWithError(why.what());
  }
}

}  // namespace gnomon
