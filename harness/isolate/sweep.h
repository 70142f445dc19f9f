// Cases again at other widths of a subgroup, on a driver whose width is a setting.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "harness/cases/session.h"

namespace gnomon {

/// lavapipe makes subgroups of LP_NATIVE_VECTOR_WIDTH / 32 lanes and reads that when it starts, so
/// every width needs workers of its own. These are the widths, in bits, besides the device's own.
/// None on another driver, whose width is what it is, and where the user has set the variable.
std::vector<unsigned> otherWidths(const GpuInfo& gpu);

/// What a worker's environment is to hold, so that its subgroups have that width.
std::map<std::string, std::string> environmentFor(unsigned width);
unsigned lanesOf(unsigned width);

/// Whether the width of a subgroup may change what this case has seen: its kernel has run, and its
/// threads communicate. A width of 1024 is left out for kernels with subgroup operations: lavapipe
/// 22.3 then reports subgroups of 32 and runs 16 lanes, which no kernel can be blamed for.
bool dependsOnWidth(const CaseRecord& record, unsigned width);

/// Adds to a case's record what failed at another width.
void addFailures(CaseRecord& record, unsigned width, const CaseRecord& there);

}  // namespace gnomon
