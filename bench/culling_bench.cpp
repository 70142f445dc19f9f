// Entries of stage culling on a city of a million objects.
#include "bench/culling_case.h"
#include "bench/objects.h"

namespace gnomon::culling {
namespace {

using Timer = void (*)(benchmark::State&, const std::string&, const Case&);

void add(const std::string& kernel, Timer timer, const std::string& what = {}) {
  timed(benchmark::RegisterBenchmark(
      (kernel + what + "/1000000").c_str(), [=](benchmark::State& state) {
        timer(state, kernel, caseOf(WorldKind::kCity, kMostObjects, 1));
      }));
}

const bool registered = [] {
  for (const char* ending : {"", "_subgroups"}) {
    add(std::string("culling/frustum") + ending, timeFrustum);
    add(std::string("culling/occlusion") + ending, timeOcclusion);
  }
  add("culling/occlusion", timeOcclusionOfAll, "/all");
  return true;
}();

}  // namespace
}  // namespace gnomon::culling
