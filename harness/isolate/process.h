// Runs a command as a child process whose end is certain: for code that may crash, hang, print
// without end or eat memory, and for settings that a driver reads only when a process starts.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gnomon {

struct ProcessOptions {
  std::vector<std::string> arguments{};              ///< after the name of the executable
  std::map<std::string, std::string> environment{};  ///< on top of ours

  /// From the start to the end of the child. Then it gets SIGTERM, and a second later SIGKILL.
  std::chrono::milliseconds limit{60'000};

  /// In place of the limit: until when the child may go on, asked again whenever it has said
  /// something. For a child that does one thing after another, each with a limit of its own.
  std::function<std::chrono::steady_clock::time_point()> until{};

  /// Private writable memory of the child, 0: unlimited. An allocation past it fails. This is
  /// RLIMIT_DATA, not RLIMIT_AS: LLVM and drivers reserve far more addresses than they ever use,
  /// and a limit on those would kill the innocent. It holds for each process alone, does not see
  /// shared mappings, and sees the shadow of an address sanitizer: leave such a child unlimited.
  std::uint64_t memoryBytes = 0;

  /// Kept of each stream: its beginning and its end, half each, with a note of what was cut.
  std::size_t maxOutputBytes = std::size_t{1} << 20;

  /// Gets each line of standard output as it comes, without its newline, in the calling thread; the
  /// last one even if it has no newline, and a line past maxOutputBytes in pieces. What it throws
  /// stops the child and reaches the caller.
  std::function<void(std::string_view line)> onLine{};
};

struct ProcessResult {
  enum class End { kExited, kSignalled, kTimedOut };

  End end = End::kExited;
  int status = 0;  ///< exit status or signal; after a timeout 0, or -1 if even SIGKILL did not help
  std::string output{};  ///< standard output
  std::string errors{};  ///< standard error
  std::chrono::duration<double> seconds{};
  std::chrono::milliseconds limit{};  ///< as asked

  bool succeeded() const { return end == End::kExited && status == 0; }

  /// To follow the name of what ran: "was killed by signal 11 (Segmentation fault)", "did not end
  /// within 60 s and was stopped", "exited with status 3".
  std::string inWords() const;
};

/// Runs `executable` (a path: PATH is not searched) and returns once it has ended. May be called
/// from many threads at once. Throws std::system_error, naming the file, if it cannot be started.
///
/// The child leads a process group of its own; what is left of the group dies when the child ends,
/// so it cannot leave processes behind, unless they leave the group: those live on, but nobody
/// waits for them. The child itself dies with the calling process. It has no standard input, no
/// descriptor of ours, default signals, and leaves no core dump.
///
/// A child that hangs inside a driver may survive SIGKILL; it is given up 10 s later (status -1).
ProcessResult runProcess(const std::filesystem::path& executable, const ProcessOptions& options);

/// The file of the running program, for a worker that is the program itself.
std::filesystem::path thisExecutable();

}  // namespace gnomon
