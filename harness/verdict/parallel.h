// One way to spread independent work over the cores.
#pragma once

#include <cstddef>
#include <functional>

namespace gnomon {

/// Calls work(begin, end) on disjoint ranges that cover [0, n), on all cores; an exception that a
/// range throws reaches the caller. A range has up to `grain` elements, so that handing it out
/// costs little beside it.
void parallelFor(std::size_t n, const std::function<void(std::size_t, std::size_t)>& work,
                 std::size_t grain = 1024);

}  // namespace gnomon
