#include "harness/isolate/worker.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/runner.h"
#include "harness/error.h"
#include "harness/isolate/fault.h"
#include "harness/mutate/models.h"
#include "harness/mutate/mutants.h"

namespace gnomon {
namespace {

using Clock = std::chrono::steady_clock;

// A driver may print too: lines of ours begin so.
constexpr std::string_view kLoading = "@loading ";
constexpr std::string_view kPrepared = "@prepared ";
constexpr std::string_view kBegun = "@begun ";
constexpr std::string_view kFurther = "@further ";
constexpr std::string_view kEnded = "@ended ";
constexpr std::string_view kMutant = "@mutant ";
constexpr std::string_view kTold = "@told ";
constexpr std::string_view kPlan = "@plan ";

constexpr int kUsageStatus = 2, kDeviceStatus = 3;  // of the command

// ---- in the worker --------------------------------------------------------------------------

/// On a line of its own, whatever a driver has left on this one.
void say(std::string_view what, const std::string& text) {
  fmt::print("\n{}{}\n", what, text);
  std::fflush(stdout);  // what a crash would take along
}

/// Who cannot get memory dies at once and says why: what is left would only fail strangely.
void dieWithoutMemory() {
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  std::array<char, 128> text{};
  const int length = limit.rlim_cur == RLIM_INFINITY
                         ? std::snprintf(text.data(), text.size(), "gnomon: out of memory\n")
                         : std::snprintf(text.data(), text.size(),
                                         "gnomon: out of memory, of which it has %g GiB\n",
                                         static_cast<double>(limit.rlim_cur) / (1 << 30));
  [[maybe_unused]] const auto written =
      write(STDERR_FILENO, text.data(), static_cast<std::size_t>(length));
  _exit(1);
}

/// What a case gives back the next one takes: images of a whole frame come and go, and pages that
/// the system takes and clears anew cost a tenth of a run.
void keepMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most that it can be
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

std::vector<CaseName> namedCases(const std::vector<std::string>& names) {
  const std::vector<CaseName> all = selectCases({});
  std::vector<CaseName> chosen;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(all, name, &CaseName::name);
    if (found == all.end()) throw UsageError("a worker was asked for cases that do not exist");
    chosen.push_back(*found);
  }
  return chosen;
}

/// A mistake in --kernel is the user's, so it is found before the first case.
void loadForeignKernels(Session& session, Preparation& found) {
  for (const auto& [kernel, file] : session.options().kernels) {
    say(kLoading, file.string());
    commitFault(kernel);
    try {
      const Subject& subject = session.subject(kernel);
      found.unmapped[kernel] = subject.interface().unmapped;
      subject.plain();              // a driver that chokes on it does so here
    } catch (const Unsupported&) {  // the case will say so
    }
    found.foreign[kernel] = session.foreignHash(kernel);
  }
}

void prepareHere(Session& session) {
  Preparation found;
  found.gpu = session.gpu().info();
  loadForeignKernels(session, found);
  session.bounds();  // a file of measured errors that cannot be read is no kernel's fault
  found.errors = session.deviceErrors();
  say(kPrepared, toJson(found));
}

void begin(const std::string& name) {
  say(kBegun, name);
  commitFault(name);
  if (losesDevice(name)) ADD_FAILURE() << "VK_ERROR_DEVICE_LOST, as GNOMON_FAULT asks";
}

void end(const Session& session, const CaseRecord& record) {
  say(kEnded, toJson(record));
  // Without destructors: those of a device that hangs may wait for it.
  if (session.deviceLost() || losesDevice(record.name)) _exit(0);
}

/// What became of cases that were run until enough of them had failed.
struct Round {
  unsigned failures = 0;
  std::vector<CaseName> observing{};  ///< those that see more where more is watched
};

Round runUntil(unsigned enough, Session& session, const std::vector<CaseName>& cases,
               const Observer& observer) {
  Round round;
  for (const CaseName& c : cases) {
    if (round.failures == enough) break;
    runCases(session, {c}, observer);
    round.failures += session.currentCase().failed;
    // Laws look at the strict twin alone.
    if (session.currentCase().observed && kindOf(c) != Kind::kLaw) round.observing.push_back(c);
  }
  return round;
}

/// The strict twin alone is what most mutants fail by, at a third of the time that compiling all of
/// it takes. One that fails by nothing there is watched whole.
void runToFailures(Session& session, const std::vector<CaseName>& cases, unsigned failures,
                   const Observer& observer) {
  session.watchOnly(Watch::kTwinAlone);
  const Round twinAlone = runUntil(failures, session, cases, observer);
  if (twinAlone.failures > 0) return;
  session.watchOnly(session.options().watch);
  runUntil(failures, session, twinAlone.observing, observer);
}

void judgeMutants(Session& session, const WorkerTask& task, const std::vector<CaseName>& cases,
                  const Observer& observer) {
  const KernelModule module = moduleOf(task.session, findKernel(task.mutated));
  for (Mutant& m : mutantsNamed(module.words, task.mutants)) {
    say(kMutant, m.id);
    session.mutate(task.mutated, std::move(m.module));
    runToFailures(session, cases, task.kills, observer);
    session.forgetCases();
    say(kTold, m.id);
  }
}

/// All cases of the model count what can be altered; those of the task are to tell.
void judgeModels(Session& session, const WorkerTask& task) {
  ModelPlan plan = planModel(session, task.mutated);
  if (task.mutants.empty()) return say(kPlan, toJson(plan.mutants));
  std::erase_if(plan.cases, [&](const ModelPlan::Case& c) {
    return std::ranges::find(task.cases, c.name.name) == task.cases.end();
  });
  for (const std::string& id : task.mutants) {
    const auto m = std::ranges::find(plan.mutants, id, &ModelMutant::id);
    if (m == plan.mutants.end()) throw UsageError("there is no mutant '" + id + "' of the model");
    say(kMutant, id);
    say(kTold, toJson(judgeMutant(session, plan, *m, task.kills)));
  }
}

}  // namespace

void serve(const WorkerTask& task) {
  std::set_new_handler(dieWithoutMemory);
  keepMemory();
  const std::vector<CaseName> cases = namedCases(task.cases);
  Session session(task.session);
  if (task.errors) session.know(*task.errors);
  if (task.models) return judgeModels(session, task);
  if (cases.empty()) return prepareHere(session);
  session.onProgress = [] { say(kFurther, ""); };
  const Observer observer{
      .begin = [](const CaseName& c, std::size_t, std::size_t) { begin(c.name); },
      .end = [&](const CaseRecord& r) { end(session, r); },
      .endsCaseAtFailure = task.session.firstFailureOnly || !task.mutants.empty()};
  if (task.mutants.empty()) return runCases(session, cases, observer);
  judgeMutants(session, task, cases, observer);
}

// ---- in the parent --------------------------------------------------------------------------

namespace {

/// How long a step may take: a case, or what comes before and after it.
std::chrono::milliseconds patience(const WorkerOptions& options, const std::string& running) {
  if (options.limitOf && !running.empty()) return options.limitOf(running);
  return options.limit + kGrace;
}

/// Follows what a worker says, and until when its present step may take.
class Listener {
 public:
  explicit Listener(const WorkerOptions& o) : options(o) { startAgain(); }

  void hear(std::string_view line) try {
    if (take(line, kLoading)) report.running = line;
    if (take(line, kPrepared)) report.preparation = preparation(line);
    if (take(line, kBegun)) beginCase(std::string(line));
    if (take(line, kFurther)) startAgain();
    if (take(line, kEnded)) endCase(caseRecord(line));
    if (take(line, kMutant)) beginMutant(std::string(line));
    if (take(line, kTold)) endMutant(std::string(line));
    if (take(line, kPlan)) report.plan = line;
  } catch (const UsageError&) {  // it lost its mind: what it does not say well, it has not said
  }

  Clock::time_point until() const {
    return options.stopped && options.stopped() ? Clock::now() : deadline;
  }
  WorkerReport report{};

 private:
  static bool take(std::string_view& line, std::string_view word) {
    if (!line.starts_with(word)) return false;
    line.remove_prefix(word.size());
    return true;
  }

  void startAgain() { deadline = Clock::now() + patience(options, report.running); }

  void beginCase(std::string name) {
    report.running = std::move(name);
    startAgain();
    if (options.begun) options.begun(report.running);
  }

  void endCase(CaseRecord record) {
    report.running.clear();
    startAgain();
    ++report.ended;
    if (options.ended) options.ended(std::move(record));
  }

  void beginMutant(std::string id) {
    startAgain();
    report.mutant = std::move(id);
    if (options.mutant) options.mutant(report.mutant);
  }

  void endMutant(const std::string& outcome) {
    startAgain();
    if (options.told) options.told(report.mutant, outcome);
    report.mutant.clear();
  }

  const WorkerOptions& options;
  Clock::time_point deadline{};
};

std::string lastLines(const std::string& text) {
  constexpr std::size_t kEnough = 600;
  return text.size() <= kEnough ? text : "..." + text.substr(text.size() - kEnough);
}

/// What the command printed before it exited.
std::string complaint(const ProcessResult& end) {
  constexpr std::string_view kName = "gnomon: ";
  const std::size_t at = end.errors.find(kName);
  std::string text = end.errors.substr(at == std::string::npos ? 0 : at + kName.size());
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string patienceInWords(const WorkerOptions& options, const std::string& running) {
  const auto seconds = [](std::chrono::milliseconds t) {
    return std::chrono::duration<double>(t).count();
  };
  if (options.limitOf && !running.empty())
    return fmt::format("{:g} s", seconds(options.limitOf(running)));
  return fmt::format("{:g} s (and {} s of grace)", seconds(options.limit), kGrace.count());
}

}  // namespace

std::string WorkerReport::death(const WorkerOptions& options) const {
  if (process.end == ProcessResult::End::kTimedOut)
    return fmt::format("did not end within {} and {}", patienceInWords(options, running),
                       process.status == 0 ? "was stopped" : "could not be stopped");
  std::string why = process.inWords();
  if (!process.errors.empty()) why += "; it said last:\n" + lastLines(process.errors);
  return why;
}

WorkerReport runWorker(const WorkerTask& task, const WorkerOptions& options) {
  // A record may quote many messages: one line, but more than a page.
  constexpr std::size_t kLongestLine = std::size_t{64} << 20;
  Listener listener(options);
  ProcessResult end =
      runProcess(thisExecutable(), {.arguments = {"worker", toJson(task)},
                                    .environment = options.environment,
                                    .until = [&] { return listener.until(); },
                                    .memoryBytes = options.memoryBytes,
                                    .maxOutputBytes = kLongestLine,
                                    .onLine = [&](std::string_view line) { listener.hear(line); }});
  listener.report.process = std::move(end);
  return std::move(listener.report);
}

void throwWhatItExitedWith(const WorkerReport& report) {
  const ProcessResult& end = report.process;
  if (end.end != ProcessResult::End::kExited) return;
  if (end.status == kUsageStatus) throw UsageError(complaint(end));
  if (end.status == kDeviceStatus) throw DeviceError(complaint(end));
}

std::uint64_t memoryLimit([[maybe_unused]] const Policy& policy,
                          [[maybe_unused]] const char* name) {
#ifdef GNOMON_SANITIZE
  return 0;
#else
  return static_cast<std::uint64_t>(policy[name] * (std::uint64_t{1} << 30));
#endif
}

Preparation prepare(const SessionOptions& session, const Policy& policy) {
  WorkerOptions options{.limit = caseLimit(session, policy)};
  if (!session.kernels.empty()) options.memoryBytes = memoryLimit(policy, "compileGibibytes");
  const WorkerReport report = runWorker({.session = session}, options);
  if (report.preparation && report.process.succeeded()) return *report.preparation;
  throwWhatItExitedWith(report);
  if (report.running.empty())
    throw DeviceError("the worker that opened the device " + report.death(options));
  throw UsageError(report.running + ": the worker that compiled it " + report.death(options));
}

}  // namespace gnomon
