// What a worker and its parent tell each other, as JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/cases/session.h"

namespace gnomon {

/// What a worker is to run.
struct WorkerTask {
  SessionOptions session{};
  std::vector<std::string> cases{};  ///< by name, in this order
};

std::string toJson(const WorkerTask& task);
/// Throws UsageError for any other text.
WorkerTask workerTask(std::string_view json);

/// A whole record but for each verdict's worst elements, which its messages name.
std::string toJson(const CaseRecord& record);
CaseRecord caseRecord(std::string_view json);

}  // namespace gnomon
