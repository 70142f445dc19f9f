#include <algorithm>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/cli/mutation.h"
#include "harness/error.h"
#include "harness/mutate/explained.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

/// A mutant that no case tells from the kernel.
struct Survivor {
  const Mutant* mutant = nullptr;            ///< of the outcome's answer
  std::optional<Explanation> explanation{};  ///< on record
};

/// What a run says of one kernel, against what is on record.
struct Outcome {
  Answer answer{};
  Score score{};
  std::vector<Survivor> survivors{};
  std::vector<std::string> problems{};  ///< each makes the command fail
};

constexpr std::string_view kModel = " model";  // ends the name of a model that is mutated

bool isModel(const std::string& name) { return name.ends_with(kModel); }

std::string stageOf(const std::string& kernel) { return kernel.substr(0, kernel.find('/')); }

fs::path recordFile(const fs::path& root, const std::string& kernel) {
  return root / "tests/mutants" / (stageOf(kernel) + ".json");
}

std::string scoreText(const Score& s) {
  return fmt::format("{:.3f} ({} of {})", s.value(), s.killed, s.mutants - s.equivalent);
}

/// An explanation holds for the line and the change that it was written for.
std::optional<Explanation> explanationOf(const MutantRecord& record, const Mutant& m) {
  const Explanation* e = record.find(m.id);
  if (e == nullptr || e->text != m.place.text || e->change != m.change) return std::nullopt;
  return *e;
}

Outcome outcomeOf(Answer answer, const MutantRecord& record, const Policy& policy, bool whole) {
  Outcome outcome{.answer = std::move(answer)};
  const Answer& a = outcome.answer;
  std::size_t unexplained = 0;
  for (std::size_t i = 0; i < a.mutants.size(); ++i) {
    const auto explanation = explanationOf(record, a.mutants[i]);
    if (!a.fates[i].survived() && !(explanation && explanation->race)) continue;
    outcome.survivors.push_back({&a.mutants[i], explanation});
    unexplained += !explanation;
  }
  outcome.score = {.mutants = a.mutants.size() + a.equivalent.size(),
                   .equivalent = a.equivalent.size(),
                   .killed = a.mutants.size() - outcome.survivors.size()};
  if (unexplained > 0)
    outcome.problems.push_back(fmt::format(
        "{}: {} of its mutants survive and nobody has explained why", a.kernel, unexplained));
  if (!whole) return outcome;
  // Most of what survives in a model cannot be seen by anybody: a clamp behind a clamp.
  if (!isModel(a.kernel) && outcome.score.value() < policy["mutationScore"])
    outcome.problems.push_back(fmt::format("{}: its score is {:.3f}, below the policy's {:g}",
                                           a.kernel, outcome.score.value(),
                                           policy["mutationScore"]));
  for (const Explanation& e : record.survivors) {
    const bool needed = std::ranges::any_of(outcome.survivors, [&](const Survivor& s) {
      return s.explanation && s.mutant->id == e.id;
    });
    if (!needed)
      outcome.problems.push_back(fmt::format(
          "{}: tests/mutants/{}.json explains {}, which does not survive, or is another now",
          a.kernel, stageOf(a.kernel), e.id));
  }
  return outcome;
}

std::string describe(const Survivor& s) {
  const Mutant& m = *s.mutant;
  const std::string why = s.explanation ? "explained: " + s.explanation->reason : "NOT EXPLAINED";
  if (m.place.file.empty()) return fmt::format("  {}\n    {}\n", m.id, why);
  return fmt::format("  kernels/{}:{}  {}\n    {}\n    {}\n    {}\n", m.place.file, m.place.line,
                     m.id, m.place.text, m.change, why);
}

/// Of a model only those that nobody has explained: the rest would fill pages.
void printSurvivors(Terminal& terminal, const Outcome& outcome) {
  std::string text;
  for (const Survivor& s : outcome.survivors)
    if (!s.explanation || !isModel(outcome.answer.kernel)) text += describe(s);
  if (!text.empty())
    terminal.print(fmt::format("survivors of {}\n{}", outcome.answer.kernel, text));
}

std::string outcomeTable(const std::vector<Outcome>& outcomes, const Terminal& terminal) {
  std::vector<std::vector<std::string>> rows = {
      {"mutants of", "mutants", "equivalent", "killed", "survived", "explained", "score", "time"}};
  for (const Outcome& o : outcomes) {
    const std::size_t explained = static_cast<std::size_t>(std::ranges::count_if(
        o.survivors, [](const Survivor& s) { return s.explanation.has_value(); }));
    rows.push_back({o.answer.kernel, grouped(o.score.mutants), grouped(o.score.equivalent),
                    grouped(o.score.killed), grouped(o.survivors.size()), grouped(explained),
                    terminal.paint(o.problems.empty() ? Colour::kGreen : Colour::kRed,
                                   fmt::format("{:.3f}", o.score.value())),
                    fmt::format("{:.1f} s", o.answer.seconds)});
  }
  return table(rows, " rrrrrrr");
}

nlohmann::json jsonOf(const Mutant& m) {
  return {{"id", m.id},           {"operator", m.operatorName}, {"file", m.place.file},
          {"line", m.place.line}, {"text", m.place.text},       {"change", m.change}};
}

std::string outcomesJson(const std::vector<Outcome>& outcomes, const MutateOptions& options,
                         const GpuInfo& gpu) {
  auto stages = nlohmann::json::array();
  bool failed = false;
  for (const Outcome& o : outcomes) {
    auto survived = nlohmann::json::array(), killed = nlohmann::json::array();
    for (const Survivor& s : o.survivors) {
      survived.push_back(jsonOf(*s.mutant));
      survived.back()["reason"] =
          s.explanation ? nlohmann::json(s.explanation->reason) : nlohmann::json(nullptr);
    }
    for (std::size_t i = 0; i < o.answer.mutants.size(); ++i) {
      const Fate& fate = o.answer.fates[i];
      if (fate.survived()) continue;
      killed.push_back(jsonOf(o.answer.mutants[i]));
      killed.back()["by"] = fate.kills.front().by;
      killed.back()["how"] = fate.kills.front().how;
    }
    stages.push_back({{"stage", stageOf(o.answer.kernel)},
                      {"kernel", o.answer.kernel},
                      {"mutants", o.score.mutants},
                      {"equivalent", o.score.equivalent},
                      {"invalid", o.answer.invalid},
                      {"duplicates", o.answer.duplicates},
                      {"killed", o.score.killed},
                      {"kills", killed},
                      {"survived", survived},
                      {"score", o.score.value()},
                      {"seconds", o.answer.seconds},
                      {"problems", o.problems}});
    failed |= !o.problems.empty();
  }
  return nlohmann::json{{"schema", 1},
                        {"device", {{"name", gpu.name}, {"driver", gpu.driver}, {"api", gpu.api}}},
                        {"seed", options.session.seed},
                        {"sample", options.sample ? nlohmann::json(*options.sample) : nullptr},
                        {"stages", stages},
                        {"failed", failed}}
             .dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

std::string contentOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What the README says of a kernel: its score, and its model's.
std::string cellOf(const MutantRecords& records, const std::string& kernel) {
  std::string text;
  if (const auto r = records.find(kernel); r != records.end() && r->second.score)
    text = scoreText(*r->second.score);
  const auto model = records.find(kernel + std::string(kModel));
  if (model != records.end() && model->second.score)
    text +=
        fmt::format("; model {} of {}", model->second.score->killed, model->second.score->mutants);
  return text;
}

std::string kernelOf(const std::string& name) {
  return isModel(name) ? name.substr(0, name.size() - kModel.size()) : name;
}

/// The scores of this run on record, in tests/mutants/ and in the README's table of stages.
void bless(const std::vector<Outcome>& outcomes, const fs::path& root) {
  std::map<std::string, std::string> cells;
  for (const Outcome& o : outcomes) {
    const fs::path file = recordFile(root, o.answer.kernel);
    MutantRecords records = loadMutantRecords(file);
    records[o.answer.kernel].score = o.score;
    saveMutantRecords(file, records);
    cells[kernelOf(o.answer.kernel)] = cellOf(records, kernelOf(o.answer.kernel));
  }
  const fs::path readme = root / "README.md";
  writeText(readme, withScores(contentOf(readme), cells));
}

/// What is on record has to be true, as far as this run can tell.
void compareWithRecord(Outcome& outcome, const MutantRecords& records, const fs::path& root,
                       bool sampled) {
  const std::string& name = outcome.answer.kernel;
  const char* remedy = "`gnomon mutate --bless` writes it anew";
  const auto record = records.find(name);
  if (record == records.end() || !record->second.score) {
    outcome.problems.push_back(fmt::format("{} has no score on record: {}", name, remedy));
    return;
  }
  if (!sampled && *record->second.score != outcome.score)
    outcome.problems.push_back(fmt::format("{}: the score on record is {}, this one {}: {}", name,
                                           scoreText(*record->second.score),
                                           scoreText(outcome.score), remedy));
  const std::string readme = contentOf(root / "README.md");
  const std::string kernel = kernelOf(name), cell = cellOf(records, kernel);
  if (withScores(readme, {{kernel, cell}}) != readme)
    outcome.problems.push_back(
        fmt::format("{}: README.md does not say '{}' of it: {}", kernel, cell, remedy));
}

}  // namespace

int mutate(const MutateOptions& options) {
  const std::vector<std::string> kernels = mutatedKernels(options.stages);
  const bool whole = !options.sample && options.operators.empty();
  if (options.bless && !whole)
    throw UsageError(
        "--bless records the score of a whole run: leave out --sample and --operators");
  if (options.bless && !options.session.kernels.empty())
    throw UsageError("--bless records the scores of the project's own kernels: leave out --kernel");
  Mutation mutation(options.session, options.jobs, options.json);
  const fs::path& root = mutation.session().root;
  Terminal& terminal = mutation.terminal();

  std::vector<Outcome> outcomes;
  const auto add = [&](const Question& question) {
    const bool ours = !options.session.kernels.contains(question.kernel);
    MutantRecords records;
    if (ours) records = loadMutantRecords(recordFile(root, question.kernel));
    Answer answer = mutation.ask(question);
    // Entries may share a model: it is mutated under the one whose suites call it.
    if (question.ofModel && answer.mutants.empty()) return;
    const MutantRecord record = records[answer.kernel];
    outcomes.push_back(outcomeOf(std::move(answer), record, mutation.policy(), whole));
    printSurvivors(terminal, outcomes.back());
    if (ours && !options.bless && options.operators.empty())
      compareWithRecord(outcomes.back(), records, root, options.sample.has_value());
  };
  for (const std::string& kernel : kernels) {
    add({.kernel = kernel,
         .operators = {options.operators.begin(), options.operators.end()},
         .sample = options.sample});
    // Operators are those of kernels, and a kernel of the user's has our model.
    if (options.operators.empty() && !options.session.kernels.contains(kernel))
      add({.kernel = kernel, .sample = options.sample, .ofModel = true});
  }
  if (options.bless) bless(outcomes, root);
  if (!options.json.empty())
    writeText(options.json, outcomesJson(outcomes, options, mutation.gpu()));
  terminal.print(outcomeTable(outcomes, terminal));
  int status = kGood;
  for (const Outcome& o : outcomes)
    for (const std::string& problem : o.problems) {
      terminal.print(terminal.paint(Colour::kRed, problem));
      status = kWrong;
    }
  return status;
}

}  // namespace gnomon
