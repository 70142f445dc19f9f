// Cases again at other widths of a subgroup, on a driver whose width is a setting.
#pragma once

#include <functional>

#include "harness/cases/session.h"

namespace gnomon {

/// Told of every width as it begins, and of every case that fails only there.
struct SweepObserver {
  std::function<void(unsigned subgroupSize, std::size_t cases)> begin{};
  std::function<void(const CaseRecord&)> failed{};
};

/// lavapipe makes subgroups of LP_NATIVE_VECTOR_WIDTH / 32 lanes and reads that when it starts, so
/// every width needs a worker. Runs again each case that the session has run of a kernel whose
/// threads communicate, and adds what fails there to the case's record. Does nothing on another
/// driver, whose width is what it is, and where the variable is set, by a worker's parent or by
/// the user.
///
/// A width of 1024 is left out for kernels with subgroup operations: lavapipe 22.3 then reports
/// subgroups of 32 and runs 16 lanes, which no kernel can be blamed for.
void sweepWidths(Session& session, const SweepObserver& observer);

}  // namespace gnomon
