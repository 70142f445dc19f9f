#include "harness/mutate/explained.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Json = nlohmann::ordered_json;

std::string textAt(const Json& json, const char* key, const std::string& where) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_string() ||
      json[key].get<std::string>().empty())
    throw UsageError(fmt::format("{}: \"{}\" is missing or no text", where, key));
  return json[key];
}

std::size_t countAt(const Json& json, const char* key, const std::string& where) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_number_unsigned())
    throw UsageError(fmt::format("{}: \"{}\" is missing or no count", where, key));
  return json[key];
}

MutantRecord recordFrom(const Json& json, const std::string& where) {
  if (!json.is_object()) throw UsageError(where + ": not an object");
  MutantRecord record;
  if (json.contains("score")) {
    const Json& score = json["score"];
    const std::string at = where + ", score";
    record.score = Score{.mutants = countAt(score, "mutants", at),
                         .equivalent = countAt(score, "equivalent", at),
                         .killed = countAt(score, "killed", at)};
  }
  if (!json.contains("survivors")) return record;
  if (!json["survivors"].is_array()) throw UsageError(where + ": \"survivors\" is not a list");
  for (const Json& s : json["survivors"]) {
    const std::string id = textAt(s, "id", where + ", survivors");
    const std::string at = where + ", " + id;
    record.survivors.push_back({.id = id,
                                .text = textAt(s, "text", at),
                                .change = textAt(s, "change", at),
                                .reason = textAt(s, "reason", at),
                                .race = s.contains("race") && s["race"] == true});
  }
  return record;
}

std::vector<std::string> cellsOf(const std::string& row) {
  std::vector<std::string> cells;
  std::string cell;
  for (std::size_t i = 1; i < row.size(); ++i) {
    if (row[i] == '|' && row[i - 1] != '\\') {
      cells.push_back(cell);
      cell.clear();
    } else {
      cell += row[i];
    }
  }
  for (std::string& c : cells) {
    c.erase(0, c.find_first_not_of(' '));
    c.erase(c.find_last_not_of(' ') + 1);
  }
  return cells;
}

}  // namespace

double Score::value() const {
  const std::size_t judged = mutants - equivalent;
  return judged == 0 ? 1 : static_cast<double>(killed) / static_cast<double>(judged);
}

const Explanation* MutantRecord::find(const std::string& id) const {
  const auto found = std::ranges::find(survivors, id, &Explanation::id);
  return found == survivors.end() ? nullptr : &*found;
}

MutantRecords loadMutantRecords(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return {};
  std::ifstream in(file);
  const Json json = Json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object())
    throw UsageError(fmt::format("{}: not a file of explained survivors", file.string()));
  MutantRecords records;
  for (const auto& [name, entry] : json.items())
    records[name] = recordFrom(entry, fmt::format("{}: {}", file.string(), name));
  return records;
}

void saveMutantRecords(const std::filesystem::path& file, const MutantRecords& records) {
  Json json = Json::object();
  for (const auto& [name, record] : records) {
    Json& entry = json[name] = Json::object();
    if (record.score)
      entry["score"] = {{"mutants", record.score->mutants},
                        {"equivalent", record.score->equivalent},
                        {"killed", record.score->killed}};
    entry["survivors"] = Json::array();
    for (const Explanation& e : record.survivors) {
      Json survivor = {{"id", e.id}, {"change", e.change}, {"text", e.text}, {"reason", e.reason}};
      if (e.race) survivor["race"] = true;
      entry["survivors"].push_back(std::move(survivor));
    }
  }
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  std::ofstream out(file);
  out << json.dump(2) << "\n" << std::flush;
  if (!out) throw UsageError(fmt::format("{}: cannot be written", file.string()));
}

std::string withScores(const std::string& readme, const std::map<std::string, std::string>& cells) {
  std::istringstream in(readme);
  std::string text, line;
  bool inTable = false, found = false;
  while (std::getline(in, line)) {
    if (line.starts_with("| stage | entries |")) inTable = found = true;
    if (line.empty()) inTable = false;
    if (inTable && line.starts_with("| ")) {
      const std::vector<std::string> row = cellsOf(line);
      const std::string name =
          row.size() < 2 ? "" : row[0] + "/" + row[1].substr(0, row[1].find_first_of(":,( "));
      if (const auto cell = cells.find(name); cell != cells.end()) {
        const std::size_t end = line.rfind('|'), begin = line.rfind('|', end - 1);
        line = line.substr(0, begin) + "| " + cell->second + " |";
      }
    }
    text += line + "\n";
  }
  if (!found) throw UsageError("README.md has no table that begins with '| stage | entries |'");
  return text;
}

}  // namespace gnomon
