// What `mutate` and `list cases --kills` share: the device, workers, and progress.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "harness/isolate/worker.h"
#include "harness/mutate/inquiry.h"
#include "harness/report/terminal.h"

namespace gnomon {

class Mutation {
 public:
  /// Opens the device in a worker and says which it is. `json` as given to --json: where it is "-",
  /// people read standard error. Throws UsageError, DeviceError.
  Mutation(SessionOptions session, std::optional<unsigned> jobs, const std::string& json);

  /// Of the kernel, with progress on the terminal.
  Answer ask(const Question& question);

  const SessionOptions& session() const { return options; }
  const Policy& policy() const { return choices; }
  const GpuInfo& gpu() const { return prepared.gpu; }
  Terminal& terminal() { return out; }

 private:
  using Clock = std::chrono::steady_clock;

  InquiryObserver observer(const std::string& what);
  std::string timeLeft(std::size_t known, std::size_t all) const;

  SessionOptions options;
  Policy choices;
  Terminal out;
  Preparation prepared;
  Schedule schedule;
  Clock::time_point begin{};
  std::optional<std::size_t> remembered{};  ///< fates that cost nothing
};

}  // namespace gnomon
