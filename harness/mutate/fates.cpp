#include "harness/mutate/fates.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include <nlohmann/json.hpp>

#include "harness/cases/hash.h"
#include "harness/isolate/process.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Fate fateFrom(const Json& json) {
  Fate fate{.sought = json.at("sought")};
  for (const Json& kill : json.at("kills")) fate.kills.push_back({kill.at(0), kill.at(1)});
  return fate;
}

/// Files below a folder, or the file itself.
void collect(const fs::path& from, std::vector<fs::path>& files) {
  std::error_code error;
  if (fs::is_regular_file(from, error)) files.push_back(from);
  if (!fs::is_directory(from, error)) return;
  for (const auto& entry : fs::recursive_directory_iterator(from))
    if (entry.is_regular_file()) files.push_back(entry.path());
}

}  // namespace

FateCache::FateCache(fs::path file) : path(std::move(file)) {
  if (path.empty()) return;
  std::ifstream in(path, std::ios::binary);
  for (std::string line; std::getline(in, line) && !in.eof();) try {
      const Json json = Json::parse(line);
      fates[json.at("key")] = fateFrom(json);
    } catch (const Json::exception&) {  // found out again
    }
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  out.open(path, std::ios::binary | std::ios::app);
}

std::optional<Fate> FateCache::find(std::uint64_t key, unsigned sought) const {
  const auto found = fates.find(key);
  if (found == fates.end()) return std::nullopt;
  const Fate& fate = found->second;
  if (fate.sought < sought && fate.kills.size() == fate.sought) return std::nullopt;
  return fate;
}

void FateCache::keep(std::uint64_t key, const Fate& fate) {
  fates[key] = fate;
  write(key, fate);
}

void FateCache::keepOnly(const std::set<std::uint64_t>& keys) {
  if (path.empty()) return;
  std::erase_if(fates, [&](const auto& f) { return !keys.contains(f.first); });
  out.close();
  const fs::path draft = path.string() + ".new";
  out.open(draft, std::ios::binary | std::ios::trunc);
  for (const auto& [key, fate] : fates) write(key, fate);
  std::error_code error;
  fs::rename(draft, path, error);
}

void FateCache::write(std::uint64_t key, const Fate& fate) {
  Json kills = Json::array();
  for (const Kill& k : fate.kills) kills.push_back({k.by, k.how});
  out << Json{{"key", key}, {"sought", fate.sought}, {"kills", kills}}.dump(
             -1, ' ', false, Json::error_handler_t::replace)
      << "\n"
      << std::flush;
}

std::optional<std::uint64_t> evidenceHash(const fs::path& root, const std::string& stage) {
  std::vector<fs::path> files;
  for (const std::string& part : {"tests/" + stage, "reference/" + stage, "kernels/" + stage,
                                  std::string("kernels/contract.h"), std::string("harness"),
                                  std::string("reference/bound"), std::string("reference/truth"),
                                  std::string("tests/policy.json"), std::string("data/frames")})
    collect(root / part, files);
  std::ranges::sort(files);
  std::error_code error;
  const auto built = fs::last_write_time(thisExecutable(), error);
  std::uint64_t hash = kHashBasis;
  for (const fs::path& file : files) {
    // A kernel and what it includes count by the mutant's module itself.
    const std::string kind = file.extension();
    if (kind == ".comp" || kind == ".glsl") continue;
    const std::string name = file.lexically_relative(root).generic_string();
    if (name.starts_with("harness/cli/") || name.starts_with("harness/report/")) continue;
    const bool compiled = kind == ".cpp" || kind == ".h";
    if (compiled && fs::last_write_time(file, error) > built) return std::nullopt;
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    hash = hashOf(text, hashOf(name, hash));
  }
  return hash;
}

}  // namespace gnomon
