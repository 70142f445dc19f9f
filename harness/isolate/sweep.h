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
///
/// The driver takes 1024 too and reports subgroups of 32, but never runs more than 16 lanes: what
/// it compiles is the code for 512 to the byte (22.3.6), and an operation on a subgroup gives what
/// no kernel can be blamed for.
std::vector<unsigned> otherWidths(const GpuInfo& gpu);

/// What a worker's environment is to hold, so that its subgroups have that width; 0: nothing.
std::map<std::string, std::string> environmentFor(unsigned width);
unsigned lanesOf(unsigned width);

/// How cases are to run at that width, 0: as they are. A kernel's twins alone, since nothing else
/// than contraction sets the module apart from its strict twin, and that has nothing to do with the
/// width; and nothing is shrunk, since a replay would need the environment.
SessionOptions sessionAt(unsigned width, SessionOptions session);

/// Whether the width of a subgroup may change what this case has seen: its kernel has run, and its
/// threads communicate.
bool dependsOnWidth(const CaseRecord& record);

/// Adds to a case's record what failed at another width.
void addFailures(CaseRecord& record, unsigned width, const CaseRecord& there);

}  // namespace gnomon
