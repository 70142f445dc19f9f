#include "harness/isolate/results.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"
#include "harness/isolate/messages.h"

namespace gnomon {
namespace {

using Json = nlohmann::json;

std::string lineOf(const Result& r) {
  return fmt::format(R"({{"width":{},"record":{}}})", r.width, toJson(r.record));
}

}  // namespace

Results::Results(std::filesystem::path file, const std::string& fingerprint)
    : path(std::move(file)) {
  read(fingerprint);
  // Written anew and renamed into place: without the line that was cut off, and never half a file.
  const std::filesystem::path draft = path.string() + ".new";
  out.open(draft, std::ios::binary | std::ios::trunc);
  write(Json{{"fingerprint", fingerprint}}.dump());
  for (const Result& r : earlier) write(lineOf(r));
  std::error_code error;
  std::filesystem::rename(draft, path, error);
  if (error) throw UsageError(fmt::format("{}: {}", path.string(), error.message()));
}

void Results::read(const std::string& fingerprint) try {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  bool ours = false;
  while (std::getline(in, line) && !in.eof()) {  // at the end without a newline: cut off
    const Json json = Json::parse(line);
    if (json.contains("fingerprint")) {
      ours = json.at("fingerprint") == fingerprint;
      another = !ours;
    } else if (json.contains("finished")) {
      earlier.clear();
      another = false;
      return;
    } else if (ours) {
      earlier.push_back({json.at("width"), caseRecord(json.at("record").dump())});
    }
  }
} catch (const std::exception&) {  // what cannot be read runs again
}

void Results::append(const Result& result) { write(lineOf(result)); }

void Results::finish() { write(R"({"finished":true})"); }

void Results::write(const std::string& line) {
  out << line + "\n" << std::flush;
  if (!out) throw UsageError(fmt::format("{}: cannot be written", path.string()));
}

}  // namespace gnomon
