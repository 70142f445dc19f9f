#include "harness/isolate/sweep.h"

#include <array>
#include <cstdlib>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/isolate/worker.h"
#include "harness/report/summary.h"

namespace gnomon {
namespace {

constexpr const char* kWidthVariable = "LP_NATIVE_VECTOR_WIDTH";
constexpr unsigned kBitsPerLane = 32;
constexpr std::array kWidths = {128u, 256u, 512u, 1024u};
constexpr unsigned kMisreported = 1024;

/// Null where the kernel cannot run here.
const Subject* subjectOf(Session& session, const std::string& kernel) {
  try {
    return &session.subject(kernel);
  } catch (const Unsupported&) {
    return nullptr;
  }
}

std::vector<std::string> casesFor(Session& session, unsigned width) {
  std::vector<std::string> names;
  for (const CaseRecord& r : session.cases()) {
    const Subject* subject = subjectOf(session, r.kernel);
    if (subject == nullptr || r.unsupported || !subject->threadsCommunicate()) continue;
    if (width == kMisreported && subject->usesSubgroups()) continue;
    names.push_back(r.name);
  }
  return names;
}

void addFindings(Session& session, const WorkerReport& report, unsigned width,
                 const std::vector<std::string>& cases, const SweepObserver& observer) {
  const std::string setting = fmt::format("{}={}", kWidthVariable, width);
  const auto add = [&](const std::string& name, const std::string& what) {
    const CaseRecord& r = session.addFailure(
        name, fmt::format("in subgroups of {} ({}):\n{}", width / kBitsPerLane, setting, what));
    if (r.messages.size() == 1) observer.failed(r);
  };
  for (const CaseRecord& r : report.records)
    for (const std::string& m : r.messages) add(r.name, m);
  if (report.death)
    add(report.running.empty() ? cases.front() : report.running, "the worker " + *report.death);
}

}  // namespace

void sweepWidths(Session& session, const SweepObserver& observer) {
  const GpuInfo& gpu = session.gpu().info();
  if (!gpu.driver.starts_with("llvmpipe") || std::getenv(kWidthVariable) != nullptr) return;
  for (const unsigned width : kWidths) {
    if (width == gpu.subgroupSize * kBitsPerLane) continue;
    const std::vector<std::string> cases = casesFor(session, width);
    if (cases.empty()) continue;
    observer.begin(width / kBitsPerLane, cases.size());
    const WorkerReport report =
        runWorker({.session = session.options(), .cases = cases},
                  {.environment = {{kWidthVariable, std::to_string(width)}},
                   .limit = session.limit() * static_cast<long>(cases.size())});
    addFindings(session, report, width, cases, observer);
  }
}

}  // namespace gnomon
