// What a benchmark's time is measured with, and what it is compared with: the device's own costs.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "harness/cases/session.h"
#include "harness/hygiene/resources.h"

namespace gnomon {

/// The least of several times. What disturbs a run only ever adds to its time, so the least is
/// nearest to the work itself (Chen and Revels 2016, "Robust benchmarking in noisy environments").
double leastOf(int runs, const std::function<double()>& run);

/// One lives while benchmarks run.
class Stopwatch {
 public:
  /// Compiles bench/copy.comp and bench/empty.comp, and times them; on a device without timestamps
  /// nothing can be timed, and both are 0.
  explicit Stopwatch(Session& session);
  ~Stopwatch();
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

  /// Programmer error if there is none.
  static Stopwatch& current();

  /// Keeps the device busy until an empty dispatch takes no longer than it ever has: one that has
  /// waited for the host runs at a low clock, took three times as long for the same work, and after
  /// seconds of waiting needed two to wake. Gives up after five.
  void wake();

  /// Seconds on the device that one run takes with cold caches: another dispatch, in the same
  /// submission, has read and written more than they hold just before.
  double cold(Resources& resources, const GpuProgram& program) const;

  /// Seconds that a dispatch takes which does nothing.
  double emptySeconds() const { return empty; }

  /// Bytes read and written in a second by a copy of a buffer onto another.
  double copyBytesPerSecond() const { return copied; }

 private:
  Dispatch copyOf(std::size_t bytes) const;
  double seconds(const Dispatch& dispatch, int runs) const;

  Session& session;
  GpuBuffer from, to;
  GpuProgram copying, nothing;
  std::vector<Dispatch> sweep;  ///< one
  double empty = 0, copied = 0;
};

}  // namespace gnomon
