// What a worker and its parent tell each other, as JSON.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/cases/session.h"

namespace gnomon {

/// What a worker is to run.
struct WorkerTask {
  SessionOptions session{};
  std::vector<std::string> cases{};      ///< by name, in this order; none: to prepare only, or list
  std::optional<DeviceErrors> errors{};  ///< of the device; none: as a file says
  std::string mutated{};               ///< the kernel whose mutants the cases are to tell; or none
  std::vector<std::string> mutants{};  ///< by id (harness/mutate/mutants.h): one after another
  bool models = false;  ///< the mutants are of that kernel's model; none: to list them only
  unsigned kills = 1;   ///< cases that have to fail before the next mutant's turn
};

/// What a worker without cases has found: the device, and that the foreign kernels can be loaded.
struct Preparation {
  GpuInfo gpu{};                                   ///< name, driver, api and subgroupSize alone
  DeviceErrors errors{};                           ///< known before this run
  std::map<std::string, std::uint64_t> foreign{};  ///< Session::foreignHash
  std::map<std::string, std::vector<std::string>> unmapped{};  ///< Interface::unmapped, of foreign
};

std::string toJson(const WorkerTask& task);
/// Throws UsageError for any other text.
WorkerTask workerTask(std::string_view json);

/// A whole record but for each verdict's worst elements, which its messages name.
std::string toJson(const CaseRecord& record);
CaseRecord caseRecord(std::string_view json);

std::string toJson(const Preparation& preparation);
Preparation preparation(std::string_view json);

}  // namespace gnomon
