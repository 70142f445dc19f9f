#include "harness/cases/session.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "harness/cases/hash.h"
#include "harness/error.h"
#include "harness/program/embedded.h"

namespace gnomon {
namespace {

Session* theSession = nullptr;

}  // namespace

std::chrono::milliseconds caseLimit(const SessionOptions& options, const Policy& policy) {
  if (options.timeout) return *options.timeout;
  return std::chrono::milliseconds(static_cast<long>(1000 * policy["caseSeconds"]));
}

KernelModule moduleOf(const SessionOptions& options, const KernelRecord& record) {
  const auto foreign = options.kernels.find(record.name());
  if (foreign != options.kernels.end())
    return loadKernel(foreign->second, record, options.root / "kernels");
  const auto words = embeddedSpirv(record.file);
  return {.words = SpirvWords(words.begin(), words.end()), .origin = "kernels/" + record.file};
}

Session::Session(SessionOptions options)
    : settings(std::move(options)),
      choices(Policy::load(settings.root / "tests/policy.json")),
      watched(settings.watch) {
  theSession = this;
}

Session& Session::current() {
  if (theSession == nullptr) throw std::logic_error("a case runs outside a session");
  return *theSession;
}

Gpu& Session::gpu() {
  if (device && !device->alive()) {  // a case lost it: the next one starts afresh
    subjects.clear();
    probedKernels.clear();
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
  KernelModule module = moduleOf(settings, record);
  const auto mutant = mutated.find(record.name());
  if (mutant != mutated.end()) module.words = mutant->second;
  return module;
}

void Session::mutate(const std::string& kernel, SpirvWords module) {
  mutated[kernel] = std::move(module);
  subjects.erase(kernel);
}

const Subject* Session::probed(const std::string& kernel) {
  const Subject& usual = subject(kernel);
  std::unique_ptr<ProbedKernel>& slot = probedKernels[kernel];
  if (!slot) {
    const auto foreign = settings.kernels.find(kernel);
    const std::filesystem::path kernels = settings.root / "kernels";
    slot = std::make_unique<ProbedKernel>(
        usual, foreign == settings.kernels.end() ? kernels / usual.record().file : foreign->second,
        kernels);
  }
  return slot->subject();
}

std::uint64_t Session::foreignHash(const std::string& kernel) const {
  const std::filesystem::path& file = settings.kernels.at(kernel);
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const SpirvWords words = load(findKernel(kernel)).words;
  return hashOf({reinterpret_cast<const char*>(words.data()), words.size() * sizeof(words[0])},
                hashOf(text));
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
  currentCase().measured[operation] = error;
  rules.reset();
}

std::chrono::milliseconds Session::limit() const { return caseLimit(settings, choices); }

void Session::beginCase(std::string name, std::string kernel) {
  records.push_back({.name = std::move(name), .kernel = std::move(kernel)});
}

CaseRecord& Session::currentCase() {
  if (records.empty()) throw std::logic_error("no case has begun");
  return records.back();
}

}  // namespace gnomon
