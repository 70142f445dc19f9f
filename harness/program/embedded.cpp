#include "harness/program/embedded.h"

#include <map>
#include <stdexcept>

#include <fmt/format.h>

namespace gnomon {
namespace {

/// Built on first use: the order in which static objects of several sources are made is open.
std::map<std::string_view, std::span<const std::uint32_t>>& registry() {
  static std::map<std::string_view, std::span<const std::uint32_t>> modules;
  return modules;
}

}  // namespace

std::span<const std::uint32_t> embeddedSpirv(std::string_view name) {
  const auto found = registry().find(name);
  if (found == registry().end())
    throw std::logic_error(fmt::format("no kernel '{}' is embedded in this binary", name));
  return found->second;
}

std::vector<std::string_view> embeddedNames() {
  std::vector<std::string_view> names;
  for (const auto& [name, module] : registry()) names.push_back(name);
  return names;
}

EmbeddedSpirv::EmbeddedSpirv(std::string_view name, const std::uint32_t* begin,
                             const std::uint32_t* end) {
  registry().emplace(name, std::span(begin, end));
}

}  // namespace gnomon
