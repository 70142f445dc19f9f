// `gnomon list cases --kills`: what each case tells from the kernel, and what it alone does.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/cli/mutation.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

/// What a case does against mutants that it can see, of which two killers each were sought.
struct Worth {
  CaseName name{};
  std::size_t first = 0;            ///< mutants that no cheaper case kills
  std::size_t kills = 0;            ///< mutants that at most one cheaper case kills
  std::vector<std::string> only{};  ///< mutants that no other case kills
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
  std::vector<std::vector<std::string>> rows = {{"case", "kernel", "kills", "first", "only it"}};
  for (const Worth& w : all) {
    const Colour colour = w.kills == 0 ? Colour::kYellow : Colour::kNone;
    rows.push_back({terminal.paint(colour, w.name.name), w.name.kernel, grouped(w.kills),
                    grouped(w.first), grouped(w.only.size())});
  }
  return table(rows, "  rrr");
}

std::string worthJson(const std::vector<Worth>& all) {
  auto list = nlohmann::json::array();
  for (const Worth& w : all)
    list.push_back({{"case", w.name.name},
                    {"kernel", w.name.kernel},
                    {"kills", w.kills},
                    {"first", w.first},
                    {"only", w.only}});
  return nlohmann::json{{"schema", 1}, {"cases", list}}.dump(1) + "\n";
}

}  // namespace

int listKills(const ListOptions& options) {
  Mutation mutation(options.session, options.jobs, options.json);
  std::vector<Answer> answers;
  std::vector<CaseName> cases;
  for (const std::string& kernel : mutatedKernels(options.stages)) {
    for (const bool ofModel : {false, true})
      answers.push_back(mutation.ask({.kernel = kernel, .ofModel = ofModel, .sought = 2}));
    for (CaseName& c : selectCases({.stages = {kernel}})) cases.push_back(std::move(c));
  }
  const std::vector<Worth> all = worthOf(cases, answers);
  if (!options.json.empty()) writeText(options.json, worthJson(all));
  Terminal& terminal = mutation.terminal();
  terminal.print(worthTable(all, terminal));
  terminal.print(
      "kills: mutants that at most one cheaper case tells from the kernel; only it: that no other "
      "case does.\nA case in the last place with nothing is not needed against these mutants; it "
      "may be against others.");
  return kGood;
}

}  // namespace gnomon
