#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/cases/case_file.h"
#include "harness/cases/hash.h"
#include "harness/cli/commands.h"
#include "harness/cli/run.h"
#include "harness/error.h"
#include "harness/isolate/worker.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"
#include "harness/verdict/waivers.h"

namespace gnomon {
namespace {

std::string failureText(const Terminal& terminal, const CaseRecord& record,
                        const SessionOptions& options) {
  std::string text =
      terminal.paint(Colour::kRed, "FAILED") + " " + record.name + " (" + record.kernel + ")\n";
  // The first message says most; a broken kernel repeats it for every size and domain.
  text += record.messages.front();
  if (text.back() != '\n') text += '\n';
  if (record.messages.size() > 1)
    text += fmt::format("... and {} more in this case; --out DIR keeps them all\n",
                        record.messages.size() - 1);
  return text + "reproduce: " + reproduceCommand(record, options) + "\n";
}

/// A line of how far the run is and what runs now.
std::string progressText(std::size_t ended, std::size_t all,
                         const std::vector<std::string>& running) {
  return fmt::format("[{}/{}] {}", ended, all, fmt::join(running, ", "));
}

const char* outcome(const CaseRecord& r) {
  return r.failed ? "failed" : r.waived ? "waived" : "passed";
}

/// The waivers of this run's device. They excuse drivers, never a kernel of the user's.
class Court {
 public:
  Court(std::vector<Waiver> w, const GpuInfo& g, const SessionOptions& s)
      : waivers(std::move(w)), gpu(g), session(s) {}

  const Waiver* waiver(const CaseRecord& r) const {
    const bool ran = !r.skipped && !r.unsupported;
    return ran && !session.kernels.contains(r.kernel)
               ? waiverFor(waivers, gpu.name, gpu.driver, r.name)
               : nullptr;
  }

  /// What the records say once their waivers are taken into account.
  std::vector<CaseRecord> judged(std::vector<CaseRecord> records) const {
    for (CaseRecord& r : records) {
      const Waiver* w = waiver(r);
      if (w == nullptr) continue;
      const Ruling ruling = rule(*w, r.failed, today());
      r.failed = ruling.failed;
      r.waived = ruling.waived;
      // In front: the first message is the one that a terminal shows.
      if (ruling.message) r.messages.insert(r.messages.begin(), *ruling.message);
    }
    return records;
  }

 private:
  std::vector<Waiver> waivers;
  const GpuInfo& gpu;
  const SessionOptions& session;
};

/// Failures as they come, but for cases with a waiver: those are told of when all has run.
RunObserver observerFor(Terminal& terminal, const Court& court, const ValidateOptions& options) {
  const auto fails = [&court](const CaseRecord& record) {
    return record.failed && court.waiver(record) == nullptr;
  };
  return {
      .progress =
          [&terminal](std::size_t ended, std::size_t all, const std::vector<std::string>& running) {
            terminal.progress(progressText(ended, all, running));
          },
      .ended =
          [&, fails](const CaseRecord& record) {
            if (fails(record)) terminal.print(failureText(terminal, record, options.session));
          },
      .enough = options.failFast ? fails : std::function<bool(const CaseRecord&)>()};
}

void tellOfWaivers(Terminal& terminal, const Court& court, const std::vector<CaseRecord>& records,
                   const SessionOptions& options) {
  for (const CaseRecord& r : records) {
    if (r.waived)
      terminal.print(fmt::format("{} {} ({}): {}", terminal.paint(Colour::kYellow, "waived"),
                                 r.name, r.kernel, *r.waived));
    if (r.failed && court.waiver(r) != nullptr) terminal.print(failureText(terminal, r, options));
  }
}

/// What each case found, and the device's measured errors where this run measured them.
void writeFindings(const std::filesystem::path& folder, const std::vector<CaseRecord>& records,
                   const Run& run, const GpuInfo& gpu) {
  for (const CaseRecord& r : records) {
    std::string text = fmt::format("{} ({}): {}\n", r.name, r.kernel, outcome(r));
    for (const Verdict& v : r.verdicts)
      for (const FieldVerdict& f : v.fields)
        text += fmt::format(
            "{:<12} budget {:<10.3g} median width {:.3g} (specification) {:.3g} "
            "(device)\n",
            f.name, f.budget, f.specWidth, f.deviceWidth);
    for (const std::string& m : r.messages) text += "\n" + m;
    writeText(folder / (r.name + ".txt"), text);
  }
  if (run.hasMeasured())
    writeText(folder / (deviceKey(gpu) + ".json"), deviceErrorsJson(gpu, run.deviceErrors()));
}

int status(const std::vector<KernelSummary>& kernels, bool require) {
  for (const KernelSummary& k : kernels) {
    if (k.failed > 0) return kWrong;
    if (require && k.skipped > 0) return kWrong;
  }
  return kGood;
}

std::string contentOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What a result depends on, but for the files of data/ that cases read. Two runs with the same one
/// may share results.
std::string fingerprint(const ValidateOptions& o, const Preparation& prepared) {
  const SessionOptions& s = o.session;
  return nlohmann::json{{"stages", o.selection.stages},
                        {"filter", o.selection.filter},
                        {"shard", {o.selection.shard, o.selection.shards}},
                        {"seed", s.seed},
                        {"cases", s.cases.value_or(0)},
                        {"timeout", s.timeout ? s.timeout->count() : 0},
                        {"shrinks", s.shrinks},
                        {"firstFailureOnly", s.firstFailureOnly},
                        {"replay", hashOf(contentOf(s.replay))},
                        {"prepared", toJson(prepared)},
                        {"policy", hashOf(contentOf(s.root / "tests/policy.json"))},
                        {"executable", hashOf(contentOf(thisExecutable()))}}
      .dump();
}

std::optional<Results> openResults(const ValidateOptions& options, const Preparation& prepared,
                                   Terminal& terminal) {
  if (options.out.empty()) return std::nullopt;
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) throw UsageError(fmt::format("--out {}: {}", options.out.string(), error.message()));
  std::optional<Results> results(std::in_place, options.out / "results.jsonl",
                                 fingerprint(options, prepared));
  if (results->replacesAnother())
    terminal.print(
        fmt::format("{}/results.jsonl was of another run: starting afresh", options.out.string()));
  return results;
}

/// The file says which case, with which seed; whatever else says so too would contradict it.
void chooseReplayed(ValidateOptions& options) {
  if (!options.selection.stages.empty() || !options.selection.filter.empty() ||
      options.selection.shards > 1 || options.session.cases)
    throw UsageError(
        "--replay runs the case of its file alone: drop STAGE, --filter, --shard and --cases");
  const std::string where = options.session.replay.string();
  const CaseFile file = readCaseFile(options.session.replay);
  const std::vector<CaseName> all = selectCases({});
  const auto found = std::ranges::find(all, file.name, &CaseName::name);
  if (found == all.end())
    throw UsageError(fmt::format("{}: there is no case '{}'; `gnomon list cases` prints them",
                                 where, file.name.substr(0, 80)));
  if (found->kernel != file.kernel)
    throw UsageError(fmt::format("{}: the case '{}' is of kernel {}, not of {}", where, file.name,
                                 found->kernel, file.kernel));
  options.selection.filter = file.name;
  options.session.seed = file.seed;
  options.session.shrinks = false;
}

/// A replay that has judged nothing is no pass.
void refuseUnusable(const ValidateOptions& options, const std::vector<CaseRecord>& records) {
  if (options.session.replay.empty()) return;
  for (const CaseRecord& r : records) {
    if (r.replayed || r.failed || r.skipped || r.unsupported) continue;
    throw UsageError(fmt::format(
        "{}: not an input of {}: {}.\nRun `gnomon validate --filter '{}'` to find another",
        options.session.replay.string(), r.name,
        r.unusable.value_or("the case judges no such input (\"judgement\")"), r.name));
  }
}

/// The files asked for and the table; the command's exit status.
int report(const ValidateOptions& options, Terminal& terminal,
           const std::vector<KernelSummary>& kernels, const GpuInfo& gpu) {
  if (!options.junit.empty()) writeText(options.junit, summaryJunit(kernels));
  if (!options.json.empty()) writeText(options.json, summaryJson(kernels, options.session, gpu));
  terminal.print(summaryTable(kernels, terminal));
  for (const KernelSummary& k : kernels) {
    if (k.unsupported)
      terminal.print(fmt::format("{} is unsupported here: {}", k.kernel, *k.unsupported));
    if (!k.unmapped.empty())
      terminal.print(fmt::format("{}: {} of its outputs are not given, and not judged: {}",
                                 k.kernel, k.unmapped.size(), fmt::join(k.unmapped, ", ")));
  }
  return status(kernels, options.require);
}

}  // namespace

int validate(const ValidateOptions& given) {
  ValidateOptions options = given;
  options.session.root = sourceRoot();
  if (!options.session.replay.empty()) chooseReplayed(options);
  options.session.firstFailureOnly = options.failFast;
  options.session.failures =
      options.out.empty() ? failuresCache() : std::filesystem::absolute(options.out) / "failures";
  for (const auto& [kernel, file] : options.session.kernels) findKernel(kernel);
  const std::vector<CaseName> cases = selectCases(options.selection);
  const Policy policy = Policy::load(options.session.root / "tests/policy.json");
  std::vector<Waiver> waivers = loadWaivers(options.session.root / "tests/waivers.json");
  Terminal terminal(options.json == "-" ? stderr : stdout);

  const Preparation prepared = prepare(options.session, policy);
  const GpuInfo& gpu = prepared.gpu;
  terminal.print(fmt::format("{}, {}, Vulkan {}, seed {}", gpu.name, gpu.driver, gpu.api,
                             options.session.seed));
  const Court court(std::move(waivers), gpu, options.session);
  std::optional<Results> results = openResults(options, prepared, terminal);
  Run run({.session = options.session,
           .policy = policy,
           .prepared = prepared,
           .jobs = options.jobs.value_or(defaultJobs()),
           .results = results ? &*results : nullptr,
           .observer = observerFor(terminal, court, options)},
          cases);
  if (run.takenFromFile() > 0)
    terminal.print(
        fmt::format("{} of {} cases are taken from {}/results.jsonl, where the last run "
                    "was interrupted",
                    run.takenFromFile(), cases.size(), options.out.string()));
  run.judge();
  if (const std::size_t left = cases.size() - run.records().size(); left > 0)
    terminal.print(fmt::format("stopped at the first failure: {} of {} cases have not run", left,
                               cases.size()));
  refuseUnusable(options, run.records());
  const std::vector<CaseRecord> records = court.judged(run.records());
  tellOfWaivers(terminal, court, records, options.session);
  if (results) writeFindings(options.out, records, run, gpu);
  if (run.hasMeasured()) cacheDeviceErrors(gpu, run.deviceErrors());
  std::vector<KernelSummary> kernels = summarise(records);
  for (KernelSummary& k : kernels)
    if (const auto found = prepared.unmapped.find(k.kernel); found != prepared.unmapped.end())
      k.unmapped = found->second;
  const int verdict = report(options, terminal, kernels, gpu);
  if (results) results->finish();
  return verdict;
}

}  // namespace gnomon
