#include "harness/verdict/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace gnomon {

void parallelFor(std::size_t n, const std::function<void(std::size_t, std::size_t)>& work,
                 std::size_t grain) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, n, grain),
      [&](const tbb::blocked_range<std::size_t>& range) { work(range.begin(), range.end()); });
}

}  // namespace gnomon
