#include "harness/program/adapter.h"

#include <fstream>
#include <functional>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 1u << 20;
constexpr int kMaxDepth = 8;  // no key goes deeper than 2; what is printed is printed recursively

/// One value of the file, with the name that a message gives it.
class Value {
 public:
  Value(const Json& j, std::string n, const fs::path& f) : json(j), name(std::move(n)), file(f) {}

  UsageError wrong(const std::string& expected) const {
    std::string found = json.dump(-1, ' ', true, Json::error_handler_t::replace);
    if (found.size() > 60) found = found.substr(0, 60) + "...";
    return UsageError(
        fmt::format("{}: '{}' must be {}, not {}", file.string(), name, expected, found));
  }

  std::string text() const {
    if (!json.is_string()) throw wrong("a text");
    return json.get<std::string>();
  }

  double number() const {
    if (!json.is_number()) throw wrong("a number");
    return json.get<double>();
  }

  unsigned small() const {
    if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 65535)
      throw wrong("a whole number from 0 to 65535");
    return json.get<unsigned>();
  }

  template <std::size_t N>
  std::array<unsigned, N> numbers() const {
    if (!json.is_array() || json.size() != N)
      throw wrong(fmt::format("a list of {} whole numbers", N));
    std::array<unsigned, N> all{};
    for (std::size_t i = 0; i < N; ++i) all[i] = Value(json[i], name, file).small();
    return all;
  }

  std::vector<std::string> texts() const {
    if (!json.is_array()) throw wrong("a list of texts");
    std::vector<std::string> all;
    for (const Json& j : json) all.push_back(Value(j, name, file).text());
    return all;
  }

  /// Each member by `read`.
  template <class T>
  std::map<std::string, T> members(const std::function<T(const Value&)>& read) const {
    if (!json.is_object()) throw wrong("an object");
    std::map<std::string, T> all;
    for (const auto& [key, value] : json.items())
      all.emplace(key, read(Value(value, name + "." + key, file)));
    return all;
  }

 private:
  const Json& json;
  std::string name;
  const fs::path& file;
};

Json parsed(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw UsageError(fmt::format("{}: no such file", file.string()));
  if (fs::file_size(file, error) > kMaxBytes)
    throw UsageError(fmt::format("{}: larger than {} bytes", file.string(), kMaxBytes));
  std::ifstream stream(file, std::ios::binary);
  try {
    Json json = Json::parse(stream, [&](int depth, Json::parse_event_t, Json&) {
      if (depth > kMaxDepth)
        throw UsageError(fmt::format("{}: nested more than {} deep", file.string(), kMaxDepth));
      return true;
    });
    if (!json.is_object())
      throw UsageError(fmt::format("{}: an adapter is a JSON object", file.string()));
    return json;
  } catch (const Json::exception& e) {
    throw UsageError(fmt::format("{}: no JSON: {}", file.string(), e.what()));
  }
}

std::string language(const Value& value) {
  const std::string name = value.text();
  if (name != "glsl" && name != "hlsl" && name != "spirv")
    throw value.wrong("\"glsl\", \"hlsl\" or \"spirv\"");
  return name;
}

fs::path computeFile(const Value& value, const fs::path& folder) {
  const auto files = value.members<std::string>([](const Value& v) { return v.text(); });
  const auto comp = files.find("comp");
  if (comp == files.end() || files.size() != 1)
    throw value.wrong("an object with comp alone: entries that draw are not there yet");
  return folder / comp->second;
}

}  // namespace

Adapter readAdapter(const fs::path& file) {
  const Json json = parsed(file);
  const fs::path folder = file.parent_path();
  Adapter a{.file = file};
  const auto texts = [](const Value& v) {
    return v.members<std::string>([](const Value& m) { return m.text(); });
  };
  const auto numbers = [](const Value& v) {
    return v.members<double>([](const Value& m) { return m.number(); });
  };
  const std::map<std::string, std::function<void(const Value&)>> keys = {
      {"language", [&](const Value& v) { a.language = language(v); }},
      {"files", [&](const Value& v) { a.compute = computeFile(v, folder); }},
      {"entry", [&](const Value& v) { a.entry = v.text(); }},
      {"include",
       [&](const Value& v) {
         for (const std::string& name : v.texts()) a.include.push_back(folder / name);
       }},
      {"defines", [&](const Value& v) { a.defines = texts(v); }},
      {"specialization", [&](const Value& v) { a.specialization = numbers(v); }},
      {"bindings",
       [&](const Value& v) {
         a.bindings =
             v.members<std::array<unsigned, 2>>([](const Value& m) { return m.numbers<2>(); });
       }},
      {"fields", [&](const Value& v) { a.fields = texts(v); }},
      {"constants", [&](const Value& v) { a.constants = numbers(v); }},
      {"grid", [&](const Value& v) { a.grid = v.numbers<3>(); }},
      {"conventions", [&](const Value& v) { a.conventions = texts(v); }},
      {"functions", [&](const Value& v) { a.functions = texts(v); }},
  };
  for (const auto& [key, value] : json.items()) {
    const auto known = keys.find(key);
    if (known == keys.end()) {
      std::vector<std::string> names;
      for (const auto& k : keys) names.push_back(k.first);
      throw UsageError(fmt::format("{}: nobody knows the key '{}'.\nKeys: {}", file.string(), key,
                                   fmt::join(names, ", ")));
    }
    known->second(Value(value, key, file));
  }
  if (a.compute.empty()) throw UsageError(file.string() + ": it names no \"files\"");
  if (a.grid)
    for (const unsigned n : *a.grid)
      if (n == 0) throw UsageError(file.string() + ": a group of 'grid' covers nothing");
  return a;
}

}  // namespace gnomon
