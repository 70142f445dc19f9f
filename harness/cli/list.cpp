#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/program/kernel.h"
#include "harness/report/summary.h"

namespace gnomon {
namespace {

struct Line {
  std::string name, note;
};

std::vector<Line> listStages(const std::vector<CaseName>& cases) {
  std::vector<Line> lines;
  for (const KernelRecord* r : catalogue()) {
    if (std::ranges::none_of(cases, [&](const CaseName& c) { return c.kernel == r->name(); }))
      continue;
    if (lines.empty() || lines.back().name != r->stage) lines.push_back({r->stage, ""});
    lines.back().note += (lines.back().note.empty() ? "" : ", ") + r->entry;
  }
  return lines;
}

std::vector<Line> listKernels(const std::vector<CaseName>& cases) {
  std::vector<Line> lines;
  for (const KernelRecord* r : catalogue())
    if (std::ranges::any_of(cases, [&](const CaseName& c) { return c.kernel == r->name(); }))
      lines.push_back({r->name(), r->summary});
  return lines;
}

void printColumns(const std::vector<Line>& lines) {
  std::size_t width = 0;
  for (const Line& l : lines) width = std::max(width, l.name.size());
  for (const Line& l : lines)
    fmt::print("{}\n", l.note.empty() ? l.name : fmt::format("{:<{}}  {}", l.name, width, l.note));
}

}  // namespace

std::vector<CaseName> casesOf(const ListOptions& options) {
  std::vector<CaseName> cases = selectCases({.stages = options.stages, .filter = {}});
  if (!options.kinds.empty())
    std::erase_if(cases, [&](const CaseName& c) {
      return std::ranges::find(options.kinds, nameOf(kindOf(c))) == options.kinds.end();
    });
  return cases;
}

int list(const ListOptions& options) {
  if (options.kills && options.what != "cases")
    throw UsageError("--kills is of cases: gnomon list cases --kills");
  if (options.kills) return listKills(options);
  const std::vector<CaseName> cases = casesOf(options);
  std::vector<Line> lines;
  if (options.what == "stages") lines = listStages(cases);
  if (options.what == "kernels") lines = listKernels(cases);
  if (options.what == "cases")
    for (const CaseName& c : cases) lines.push_back({c.name, std::string(nameOf(kindOf(c)))});
  if (options.json != "-") printColumns(lines);
  if (!options.json.empty()) {
    nlohmann::json json = {{"schema", 1}, {options.what, nlohmann::json::array()}};
    for (const Line& l : lines) json[options.what].push_back(l.name);
    if (options.what == "cases")
      for (const CaseName& c : cases) json["kind"][c.name] = nameOf(kindOf(c));
    writeText(options.json, json.dump(1) + "\n");
  }
  return kGood;
}

}  // namespace gnomon
