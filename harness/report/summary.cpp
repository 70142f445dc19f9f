#include "harness/report/summary.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"
#include "harness/report/xml.h"

namespace gnomon {
namespace {

void add(KernelSummary& sum, const CaseRecord& record) {
  sum.records.push_back(&record);
  sum.cases += 1;
  sum.failed += record.failed;
  sum.skipped += record.skipped || record.unsupported;
  sum.waived += record.waived.has_value();
  sum.elements += record.elements;
  sum.seconds += record.seconds;
  if (record.unsupported) sum.unsupported = record.unsupported;
  for (const Verdict& v : record.verdicts) {
    sum.outside += v.outside;
    sum.ambiguous += v.ambiguous;
    sum.reassociated += v.reassociated;
    if (record.waived) continue;  // the driver's fault is not the kernel's class
    sum.verdict = std::max(sum.verdict, v.verdict);
    sum.widening = std::max(sum.widening, v.widening);
    // Half of what a narrow format stores is an end of its interval, which says nothing.
    if (v.storage != Storage::float32 && v.maxBudget() <= 1) continue;
    sum.maxBudget = std::max(sum.maxBudget.value_or(0), v.maxBudget());
    sum.exact &= std::ranges::all_of(v.fields, [](const auto& f) { return f.specWidth == 0; });
  }
  if (record.failed) sum.verdict = Class::kWrong;
}

bool judged(const KernelSummary& k) { return k.failed > 0 || k.maxBudget.has_value(); }

std::string className(const KernelSummary& k) {
  if (k.unsupported) return "unsupported";
  if (!judged(k)) return "not judged";
  if (k.verdict == Class::kEquivalent) return fmt::format("equivalent (k = {})", k.widening);
  return std::string(nameOf(k.verdict));
}

std::string budgetText(const KernelSummary& k) {
  // Under the bound that is not widened an equivalent arrangement exceeds it: k tells more.
  if (!k.maxBudget || k.verdict == Class::kEquivalent) return "";
  return k.exact ? "exact" : fmt::format("{:.3g}", *k.maxBudget);
}

std::string casesText(const KernelSummary& k) {
  std::string text = fmt::format("{}", k.cases);
  if (k.failed > 0) text = fmt::format("{} of {} failed", k.failed, k.cases);
  if (k.failed == 0 && k.skipped > 0) text += fmt::format(" ({} skipped)", k.skipped);
  if (k.waived > 0) text += fmt::format(" ({} waived)", k.waived);
  return text;
}

Colour colourOf(const KernelSummary& k) {
  if (k.unsupported || !judged(k) || k.verdict == Class::kEquivalent) return Colour::kYellow;
  return k.verdict == Class::kConforms ? Colour::kGreen : Colour::kRed;
}

/// JSON has no infinity: a budget beyond all bounds is 1e300, which stays a number for scripts.
nlohmann::json finite(const std::optional<double>& x) {
  if (!x) return nullptr;
  return std::isfinite(*x) ? *x : 1e300;
}

nlohmann::json domainsOf(const KernelSummary& k) {
  auto list = nlohmann::json::array();
  for (const CaseRecord* r : k.records)
    for (const Verdict& v : r->verdicts)
      for (const FieldVerdict& f : v.fields)
        list.push_back({{"case", r->name},
                        {"output", v.output},
                        {"field", f.name},
                        {"elements", v.elements},
                        {"judgedByIntervals", v.bounded},
                        {"budget", finite(f.budget)},
                        {"specBudget", finite(f.specBudget)},
                        {"plainBudget", finite(v.plainBudget)},
                        {"specWidth", f.specWidth},
                        {"deviceWidth", f.deviceWidth}});
  return list;
}

nlohmann::json failuresOf(const KernelSummary& k, const SessionOptions& options) {
  auto list = nlohmann::json::array();
  for (const CaseRecord* r : k.records) {
    if (r->waived) continue;
    for (const std::string& message : r->messages)
      list.push_back(
          {{"case", r->name}, {"reproduce", reproduceCommand(*r, options)}, {"message", message}});
  }
  return list;
}

nlohmann::json waivedOf(const KernelSummary& k) {
  auto list = nlohmann::json::array();
  for (const CaseRecord* r : k.records)
    if (r->waived)
      list.push_back({{"case", r->name}, {"reason", *r->waived}, {"messages", r->messages}});
  return list;
}

std::string junitCase(const KernelSummary& k, const CaseRecord& r) {
  std::string text = fmt::format(R"(    <testcase classname="{}" name="{}" time="{:.3f}">)",
                                 escapedXml(k.kernel), escapedXml(r.name), r.seconds);
  if (r.waived)
    text += fmt::format("\n      <skipped message=\"waived: {}\"/>", escapedXml(*r.waived));
  for (const std::string& m : r.waived ? std::vector<std::string>{} : r.messages)
    text += fmt::format("\n      <failure message=\"{}\">{}</failure>",
                        escapedXml(m.substr(0, m.find('\n'))), escapedXml(m));
  if (r.unsupported)
    text +=
        fmt::format("\n      <skipped message=\"unsupported: {}\"/>", escapedXml(*r.unsupported));
  else if (r.skipped)
    text += fmt::format("\n      <skipped message=\"{}\"/>", escapedXml(*r.skipped));
  return text + "</testcase>\n";
}

}  // namespace

std::vector<KernelSummary> summarise(const std::vector<CaseRecord>& records) {
  std::vector<KernelSummary> all;
  for (const CaseRecord& r : records) {
    auto found = std::ranges::find(all, r.kernel, &KernelSummary::kernel);
    if (found == all.end()) {
      all.push_back({.stage = r.kernel.substr(0, r.kernel.find('/')), .kernel = r.kernel});
      found = all.end() - 1;
    }
    add(*found, r);
  }
  return all;
}

std::string reproduceCommand(const CaseRecord& record, const SessionOptions& options) {
  std::string command = "./gnomon validate";
  const std::string input = record.shrunk.value_or(options.replay.string());
  if (!input.empty()) {
    command += fmt::format(" --replay '{}'", input);
  } else {
    command += fmt::format(" --filter '{}' --seed {}", record.name, options.seed);
    if (options.cases) command += fmt::format(" --cases {}", *options.cases);
  }
  if (!options.device.empty()) command += fmt::format(" --device '{}'", options.device);
  if (options.timeout) command += fmt::format(" --timeout {}", options.timeout->count());
  for (const auto& [kernel, file] : options.kernels)
    command += fmt::format(" --kernel '{}={}'", kernel, file.string());
  return command;
}

std::string summaryTable(const std::vector<KernelSummary>& kernels, const Terminal& terminal) {
  std::vector<std::vector<std::string>> rows = {
      {"kernel", "class", "cases", "elements", "worst budget", "time"}};
  for (const KernelSummary& k : kernels) {
    rows.push_back({k.kernel, terminal.paint(colourOf(k), className(k)), casesText(k),
                    grouped(k.elements), budgetText(k), fmt::format("{:.1f} s", k.seconds)});
  }
  return table(rows, "llrrrr");
}

std::string summaryJson(const std::vector<KernelSummary>& kernels, const SessionOptions& options,
                        const GpuInfo& gpu) {
  auto stages = nlohmann::json::array();
  std::size_t failed = 0, waived = 0;
  for (const KernelSummary& k : kernels) {
    failed += k.failed;
    waived += k.waived;
    stages.push_back({{"stage", k.stage},
                      {"kernel", k.kernel},
                      {"class", k.unsupported ? "unsupported"
                                : !judged(k)  ? "not judged"
                                              : nameOf(k.verdict)},
                      {"widening", k.widening},
                      {"cases", k.cases},
                      {"failed", k.failed},
                      {"skipped", k.skipped},
                      {"waived", k.waived},
                      {"elements", k.elements},
                      {"outside", k.outside},
                      {"ambiguous", k.ambiguous},
                      {"reassociated", k.reassociated},
                      {"maxBudget", k.exact ? nullptr : finite(k.maxBudget)},
                      {"seconds", k.seconds},
                      {"unsupported", k.unsupported ? nlohmann::json(*k.unsupported) : nullptr},
                      {"unmapped", k.unmapped},
                      {"domains", domainsOf(k)},
                      {"failures", failuresOf(k, options)},
                      {"waivers", waivedOf(k)}});
  }
  const nlohmann::json json = {{"schema", 1},
                               {"device",
                                {{"name", gpu.name},
                                 {"driver", gpu.driver},
                                 {"api", gpu.api},
                                 {"subgroupSize", gpu.subgroupSize}}},
                               {"seed", options.seed},
                               {"stages", stages},
                               {"waived", waived},
                               {"failed", failed}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string summaryJunit(const std::vector<KernelSummary>& kernels) {
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";
  for (const KernelSummary& k : kernels) {
    text += fmt::format(
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" skipped=\"{}\" time=\"{:.3f}\">\n",
        escapedXml(k.kernel), k.cases, k.failed, k.skipped + k.waived, k.seconds);
    for (const CaseRecord* r : k.records) text += junitCase(k, *r);
    text += "  </testsuite>\n";
  }
  return text + "</testsuites>\n";
}

void writeText(const std::filesystem::path& file, const std::string& text) {
  if (file == "-") {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return;
  }
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw UsageError(fmt::format("{}: cannot be written", file.string()));
}

}  // namespace gnomon
