// Faults on demand, so that tests can see what a worker's parent makes of them. Read by workers
// alone:
//   GNOMON_FAULT=crash:NAME   dies of a segmentation fault when it comes to NAME
//   GNOMON_FAULT=hang:NAME    never goes on
//   GNOMON_FAULT=exit:NAME    exits with status 7
//   GNOMON_FAULT=memory:NAME  asks for memory until there is none; nothing where no limit is set
//   GNOMON_FAULT=lose:NAME    goes on as if the case had lost the device, and hangs at the next one
// NAME is a case, or a kernel ("brdf/evaluate") whose foreign file is loaded.
#pragma once

#include <string_view>

namespace gnomon {

/// Commits the fault that is asked for here, but for "lose".
void commitFault(std::string_view name);

/// Whether the device is to count as lost here.
bool losesDevice(std::string_view name);

}  // namespace gnomon
