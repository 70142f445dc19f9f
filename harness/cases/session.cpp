#include "harness/cases/session.h"

#include <algorithm>
#include <stdexcept>

#include "harness/error.h"
#include "harness/program/embedded.h"

namespace gnomon {
namespace {

Session* theSession = nullptr;

}  // namespace

Session::Session(SessionOptions options)
    : settings(std::move(options)), choices(Policy::load(settings.root / "tests/policy.json")) {
  theSession = this;
}

Session& Session::current() {
  if (theSession == nullptr) throw std::logic_error("a case runs outside a session");
  return *theSession;
}

Gpu& Session::gpu() {
  if (device && !device->alive()) {  // a case lost it: the next one starts afresh
    subjects.clear();
    device.reset();
  }
  if (!device)
    device = std::make_unique<Gpu>(
        Gpu::Options{.device = settings.device, .validation = settings.validation});
  return *device;
}

const Subject& Session::subject(const std::string& kernel) {
  Gpu& on = gpu();
  std::unique_ptr<Subject>& slot = subjects[kernel];
  if (!slot) {
    const KernelRecord& record = findKernel(kernel);
    slot = std::make_unique<Subject>(on, record, load(record));
  }
  return *slot;
}

KernelModule Session::load(const KernelRecord& record) const {
  const auto foreign = settings.kernels.find(record.name());
  if (foreign != settings.kernels.end())
    return loadKernel(foreign->second, record, settings.root / "kernels");
  const auto words = embeddedSpirv(record.file);
  return {.words = SpirvWords(words.begin(), words.end()), .origin = "kernels/" + record.file};
}

const Bounds& Session::bounds() {
  if (!rules) {
    rules = Bounds::specification(gpu().info().roundingRteFloat32);
    if (!deviceErrors().empty()) rules->device = deviceRules(rules->spec, deviceErrors());
  }
  return *rules;
}

const DeviceErrors& Session::deviceErrors() {
  if (!errors) errors = loadDeviceErrors(gpu().info(), settings.root).value_or(DeviceErrors{});
  return *errors;
}

void Session::measured(Operation operation, const MeasuredError& error) {
  // A few arguments, or somebody's own kernel, say nothing about the device.
  const bool foreign = std::ranges::any_of(
      settings.kernels, [](const auto& k) { return k.first.starts_with("precision/"); });
  if (settings.cases || foreign) return;
  deviceErrors();
  merge(*errors, operation, error);
  measuredAny = true;
  rules.reset();
}

std::chrono::milliseconds Session::limit() const {
  if (settings.timeout) return *settings.timeout;
  return std::chrono::milliseconds(static_cast<long>(1000 * choices["caseSeconds"]));
}

void Session::beginCase(std::string name, std::string kernel) {
  records.push_back({.name = std::move(name), .kernel = std::move(kernel)});
}

CaseRecord& Session::currentCase() {
  if (records.empty()) throw std::logic_error("no case has begun");
  return records.back();
}

const CaseRecord& Session::addFailure(const std::string& caseName, std::string message) {
  const auto found = std::ranges::find(records, caseName, &CaseRecord::name);
  if (found == records.end()) throw std::logic_error("no case has run as " + caseName);
  found->failed = true;
  found->messages.push_back(std::move(message));
  return *found;
}

}  // namespace gnomon
