// `gnomon list cases --kills`: what each case tells from the kernel, and what it alone does.
//
// Alone among the cases of its kind. Whatever breaks a law of a kernel also leaves the model's
// interval; the law is there for the mistake that kernel and model share, and for a kernel that
// is another algorithm: then the other laws are all there is beside it. Likewise truth of a model
// is there for the mistake that the model shares with its parts.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/cli/mutation.h"
#include "harness/error.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

/// What a case does against mutants that its kind can see, of which two killers each were sought.
struct Worth {
  CaseName name{};
  std::size_t first = 0;            ///< mutants that no cheaper case kills
  std::size_t kills = 0;            ///< mutants that at most one cheaper case kills
  std::vector<std::string> only{};  ///< mutants that no other case of its kind kills
};

std::vector<Worth> worthOf(const std::vector<CaseName>& cases, const std::vector<Answer>& answers) {
  std::vector<Worth> all;
  for (const CaseName& c : cases) {
    Worth worth{.name = c};
    for (const Answer& a : answers)
      for (std::size_t i = 0; i < a.mutants.size(); ++i) {
        const std::vector<Kill>& kills = a.fates[i].kills;
        const auto isIt = [&](const Kill& k) { return k.caseName() == c.name; };
        if (std::ranges::none_of(kills, isIt)) continue;
        ++worth.kills;
        worth.first += isIt(kills.front());
        if (std::ranges::all_of(kills, isIt)) worth.only.push_back(a.mutants[i].id);
      }
    all.push_back(std::move(worth));
  }
  return all;
}

std::string worthTable(const std::vector<Worth>& all, const Terminal& terminal) {
  std::vector<std::vector<std::string>> rows = {
      {"case", "kind", "kernel", "kills", "first", "only it"}};
  for (const Worth& w : all) {
    const Colour colour = w.kills == 0 ? Colour::kYellow : Colour::kNone;
    rows.push_back({terminal.paint(colour, w.name.name), std::string(nameOf(kindOf(w.name))),
                    w.name.kernel, grouped(w.kills), grouped(w.first), grouped(w.only.size())});
  }
  return table(rows, "   rrr");
}

std::string worthJson(const std::vector<Worth>& all) {
  auto list = nlohmann::json::array();
  for (const Worth& w : all)
    list.push_back({{"case", w.name.name},
                    {"kind", nameOf(kindOf(w.name))},
                    {"kernel", w.name.kernel},
                    {"kills", w.kills},
                    {"first", w.first},
                    {"only", w.only}});
  return nlohmann::json{{"schema", 1}, {"cases", list}}.dump(1) + "\n";
}

/// An answer from each kind that has cases of this kernel.
std::vector<Answer> answersOf(Mutation& mutation, const std::string& kernel,
                              const std::vector<CaseName>& cases,
                              const std::vector<std::string>& mutants) {
  std::vector<Answer> answers;
  for (const Kind kind : {Kind::kComparison, Kind::kLaw, Kind::kTruth, Kind::kComposition})
    if (std::ranges::any_of(
            cases, [&](const CaseName& c) { return c.kernel == kernel && kindOf(c) == kind; }))
      answers.push_back(mutation.ask({.kernel = kernel,
                                      .mutants = {mutants.begin(), mutants.end()},
                                      .ofModel = judgesModel(kind),
                                      .by = kind,
                                      .sought = 2}));
  return answers;
}

void refuseUnknown(const std::vector<std::string>& mutants, const std::vector<Answer>& answers) {
  for (const std::string& id : mutants)
    if (std::ranges::none_of(answers, [&](const Answer& a) {
          return std::ranges::find(a.mutants, id, &Mutant::id) != a.mutants.end();
        }))
      throw UsageError(
          fmt::format("--mutants {}: these cases are asked about no such mutant.\n"
                      "`gnomon mutate --json -` gives every id",
                      id));
}

}  // namespace

int listKills(const ListOptions& options) {
  Mutation mutation(options.session, options.jobs, options.json);
  const std::vector<std::string> kernels = mutatedKernels(options.stages);
  std::vector<CaseName> cases = casesOf(options);
  std::erase_if(cases, [&](const CaseName& c) {
    return kindOf(c) == Kind::kBound || std::ranges::find(kernels, c.kernel) == kernels.end();
  });
  std::vector<Answer> answers;
  for (const std::string& kernel : kernels)
    for (Answer& a : answersOf(mutation, kernel, cases, options.mutants))
      answers.push_back(std::move(a));
  refuseUnknown(options.mutants, answers);
  const std::vector<Worth> all = worthOf(cases, answers);
  if (!options.json.empty()) writeText(options.json, worthJson(all));
  Terminal& terminal = mutation.terminal();
  terminal.print(worthTable(all, terminal));
  terminal.print(
      "A case is measured against those of its kind. kills: mutants that at most one cheaper one "
      "tells;\nonly it: mutants that no other one does.");
  return kGood;
}

}  // namespace gnomon
