// Where cases run: the device, the kernels under test, and what every case has found so far.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/cases/device_rules.h"
#include "harness/hygiene/observe.h"
#include "harness/hygiene/probed.h"
#include "harness/hygiene/subject.h"
#include "harness/verdict/policy.h"
#include "harness/verdict/verdict.h"

namespace gnomon {

struct SessionOptions {
  std::filesystem::path root{};  ///< of the source tree: kernels/, tests/policy.json, data/
  std::string device{};          ///< as Gpu::Options::device
  std::uint64_t seed = 1;
  std::optional<std::size_t> cases{};  ///< generated inputs a case, instead of the policy's number
  std::optional<std::chrono::seconds> timeout{};  ///< a case, instead of the policy's number
  std::map<std::string, std::filesystem::path> kernels{};  ///< replaced: "stage/entry" -> file
  bool shrinks = true;               ///< failing generated inputs, before they are shown
  std::filesystem::path failures{};  ///< folder that they are written to; empty: nowhere
  std::filesystem::path replay{};    ///< such a file: its input alone, in place of the case's own
  bool validation = true;            ///< Vulkan's validation layer; off for timing only
  bool probes = true;                ///< a failure names the first intermediate that is wrong
  Watch watch = Watch::kAll;         ///< how much of every run is watched
  bool firstFailureOnly = false;     ///< a case ends with its first failure
};

/// The longest time that a case may take.
std::chrono::milliseconds caseLimit(const SessionOptions& options, const Policy& policy);

/// The module of a kernel, ours or the one that replaces it. Throws UsageError.
KernelModule moduleOf(const SessionOptions& options, const KernelRecord& record);

/// What one case has found.
struct CaseRecord {
  std::string name{};    ///< "BrdfEvaluate.LobeStaysInsideTheBound"
  std::string kernel{};  ///< "brdf/evaluate"
  bool failed = false;
  std::optional<std::string> skipped{};      ///< why
  std::optional<std::string> unsupported{};  ///< what the device lacks
  std::optional<std::string> waived{};       ///< why its failure is excused
  bool threadsCommunicate = false;           ///< in its kernel, as Subject says
  bool observed = false;                     ///< it ran the kernel as Session::watch() says
  std::size_t elements = 0;                  ///< checked, by a verdict or by a law
  double seconds = 0;
  std::vector<Verdict> verdicts{};
  DeviceErrors measured{};              ///< of the device, by this case
  std::vector<std::string> messages{};  ///< one for each failure
  std::optional<std::string> shrunk{};  ///< file of the smallest input that fails as the first does
  bool replayed = false;                ///< SessionOptions::replay was judged
  std::optional<std::string> unusable{};  ///< why that file says nothing of this case
};

class Session {
 public:
  explicit Session(SessionOptions options);

  /// The session that cases run in. Programmer error if there is none.
  static Session& current();

  const SessionOptions& options() const { return settings; }
  const Policy& policy() const { return choices; }

  /// The device, opened at first use.
  Gpu& gpu();

  /// A kernel, ours or the one that replaces it, compiled and checked at first use. Throws
  /// Unsupported, UsageError, DeviceError.
  const Subject& subject(const std::string& kernel);

  /// From now on the kernel is this module, under its own interface: a mutant of it.
  void mutate(const std::string& kernel, SpirvWords module);

  /// How much of every run is watched from now on, in place of what the options say.
  void watchOnly(Watch watch) { watched = watch; }
  Watch watch() const { return watched; }
  /// The same kernel with its probes on, compiled at first use; null where it names none. Throws as
  /// subject() does.
  const Subject* probed(const std::string& kernel);

  /// Changes with what a kernel of the user's comes to, by its file or what that includes.
  std::uint64_t foreignHash(const std::string& kernel) const;

  /// The rules of this device: what the specification allows, and what was measured if it was.
  const Bounds& bounds();

  /// Takes in what a case has measured; from now on part of bounds().
  void measured(Operation operation, const MeasuredError& error);
  /// What is known of this device: measured before, and by this run.
  const DeviceErrors& deviceErrors();
  /// Takes this for known, and reads no file.
  void know(DeviceErrors known) { errors = std::move(known); }

  /// A case went beyond what a device can do in time, or the device did: whoever goes on needs
  /// another one.
  bool deviceLost() const { return device && !device->alive(); }

  /// Called by a case that takes long, whenever it has come further: its time starts again.
  void cameFurther() const {
    if (onProgress) onProgress();
  }
  std::function<void()> onProgress{};

  /// Time limit of a case, and of one wait for the device in it.
  std::chrono::milliseconds limit() const;

  void beginCase(std::string name, std::string kernel);
  void forgetCases() { records.clear(); }
  CaseRecord& currentCase();
  const std::vector<CaseRecord>& cases() const { return records; }

 private:
  KernelModule load(const KernelRecord& record) const;

  SessionOptions settings;
  Policy choices;
  std::unique_ptr<Gpu> device;
  std::optional<Bounds> rules;
  std::optional<DeviceErrors> errors;
  std::map<std::string, std::unique_ptr<Subject>> subjects;
  std::map<std::string, SpirvWords> mutated;
  Watch watched;
  std::map<std::string, std::unique_ptr<ProbedKernel>> probedKernels;
  std::vector<CaseRecord> records;
};

}  // namespace gnomon
