#include "bench/timing.h"

#include "harness/cases/session.h"
#include "harness/error.h"
#include "harness/hygiene/resources.h"

namespace gnomon {

void timeKernel(benchmark::State& state, const std::string& kernel, const Stimulus& given) {
  Session& session = Session::current();
  Stimulus stimulus = given;
  stimulus.limit = session.limit();
  try {
    const Subject& subject = session.subject(kernel);
    if (subject.gpu().info().timestampPeriodNs == 0) throw Unsupported("no GPU timestamps");
    Resources resources(subject, stimulus, Target::kContract);
    resources.upload();
    resources.time(subject.plain());  // pays for what the driver does once
    for (auto _ : state) state.SetIterationTime(resources.time(subject.plain()));
    state.SetItemsProcessed(state.iterations() *
                            static_cast<std::int64_t>(stimulus.extent.count()));
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(resources.bytes()));
    state.SetLabel(subject.gpu().info().name);
  } catch (const Unsupported& why) {
    state.SkipWithError(why.what());
  }
}

}  // namespace gnomon
