// The errors that reach a user. Each says what, where and what to do, in a few lines.
#pragma once

#include <stdexcept>
#include <string>

namespace gnomon {

/// The request or one of its files is wrong: bad flag, unreadable file, kernel that does not
/// compile. Exit status 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No usable device, or the machine's Vulkan is broken. Exit status 3.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A Vulkan call failed while a case ran (device lost, out of memory, time limit): that case's
/// failure, never the run's.
struct GpuError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The device lacks something a kernel needs; the text names it. Reported as unsupported.
struct Unsupported : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace gnomon
