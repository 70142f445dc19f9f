#include <fmt/format.h>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/isolate/sweep.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

/// A mistake in --kernel is the user's, so it is found before the first case.
void loadForeignKernels(Session& session) {
  for (const auto& [kernel, file] : session.options().kernels) {
    try {
      session.subject(kernel);
    } catch (const Unsupported&) {  // the case will say so
    }
  }
}

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
  return text + "reproduce: " + reproduceCommand(record.name, options) + "\n";
}

Observer observerFor(Terminal& terminal, const SessionOptions& options) {
  return {.begin =
              [&terminal](const CaseName& c, std::size_t index, std::size_t count) {
                terminal.progress(fmt::format("[{}/{}] {}", index + 1, count, c.name));
              },
          .end =
              [&terminal, &options](const CaseRecord& record) {
                if (record.failed) terminal.print(failureText(terminal, record, options));
              }};
}

SweepObserver sweepObserver(Terminal& terminal, const SessionOptions& options) {
  return {.begin =
              [&terminal](unsigned subgroupSize, std::size_t cases) {
                terminal.progress(
                    fmt::format("{} cases again in subgroups of {}", cases, subgroupSize));
              },
          .failed =
              [&terminal, &options](const CaseRecord& record) {
                terminal.print(failureText(terminal, record, options));
              }};
}

/// What each case found, and the device's measured errors where this run measured them.
void writeFindings(const std::filesystem::path& folder, Session& session, const GpuInfo& gpu) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw UsageError(fmt::format("--out {}: {}", folder.string(), error.message()));
  for (const CaseRecord& r : session.cases()) {
    std::string text =
        fmt::format("{} ({}): {}\n", r.name, r.kernel, r.failed ? "failed" : "passed");
    for (const Verdict& v : r.verdicts)
      for (const FieldVerdict& f : v.fields)
        text += fmt::format(
            "{:<12} budget {:<10.3g} median width {:.3g} (specification) {:.3g} "
            "(device)\n",
            f.name, f.budget, f.specWidth, f.deviceWidth);
    for (const std::string& m : r.messages) text += "\n" + m;
    writeText(folder / (r.name + ".txt"), text);
  }
  if (session.hasMeasured())
    writeText(folder / (deviceKey(gpu) + ".json"), deviceErrorsJson(gpu, session.deviceErrors()));
}

int status(const std::vector<KernelSummary>& kernels, bool require) {
  for (const KernelSummary& k : kernels) {
    if (k.failed > 0) return kWrong;
    if (require && k.skipped > 0) return kWrong;
  }
  return kGood;
}

}  // namespace

int validate(const ValidateOptions& given) {
  ValidateOptions options = given;
  options.session.root = sourceRoot();
  for (const auto& [kernel, file] : options.session.kernels) findKernel(kernel);
  const std::vector<CaseName> cases = selectCases(options.selection);
  Session session(options.session);
  const GpuInfo gpu = session.gpu().info();
  Terminal terminal(options.json == "-" ? stderr : stdout);
  terminal.print(fmt::format("{}, {}, Vulkan {}, seed {}", gpu.name, gpu.driver, gpu.api,
                             options.session.seed));
  loadForeignKernels(session);
  session.bounds();  // a file of measured errors that cannot be read is no kernel's fault
  runCases(session, cases, observerFor(terminal, options.session));
  sweepWidths(session, sweepObserver(terminal, options.session));

  const std::vector<KernelSummary> kernels = summarise(session.cases());
  if (!options.out.empty()) writeFindings(options.out, session, gpu);
  if (session.hasMeasured()) cacheDeviceErrors(gpu, session.deviceErrors());
  if (!options.junit.empty()) writeText(options.junit, summaryJunit(kernels));
  if (!options.json.empty()) writeText(options.json, summaryJson(kernels, session, gpu));
  terminal.print(summaryTable(kernels, terminal));
  for (const KernelSummary& k : kernels)
    if (k.unsupported)
      terminal.print(fmt::format("{} is unsupported here: {}", k.kernel, *k.unsupported));
  return status(kernels, options.require);
}

}  // namespace gnomon
