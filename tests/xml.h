// Whether a text is an XML document, as far as what we write needs.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace gnomon {

/// The first thing that is wrong, or nothing: elements that nest and close, one root, attributes in
/// double quotes and not twice, no bare & or <.
inline std::string xmlFault(std::string_view text) {
  std::vector<std::string> open;
  int roots = 0;
  const auto checkText = [](std::string_view part) -> std::string {
    for (std::size_t at = part.find('&'); at != part.npos; at = part.find('&', at + 1)) {
      const std::string_view rest = part.substr(at);
      const auto is = [&](std::string_view entity) { return rest.starts_with(entity); };
      if (!is("&amp;") && !is("&lt;") && !is("&gt;") && !is("&quot;"))
        return "bare & in " + std::string(part);
    }
    return "";
  };
  const auto checkAttributes = [&](std::string_view rest) -> std::string {
    std::vector<std::string> seen;
    while (true) {
      const std::size_t begin = rest.find_first_not_of(" \n\t");
      if (begin == rest.npos) return "";
      const std::size_t equals = rest.find("=\"", begin);
      if (equals == rest.npos) return "no attribute: " + std::string(rest);
      const std::size_t end = rest.find('"', equals + 2);
      if (end == rest.npos) return "no end of " + std::string(rest);
      seen.emplace_back(rest.substr(begin, equals - begin));
      if (std::count(seen.begin(), seen.end(), seen.back()) > 1) return "twice: " + seen.back();
      if (std::string fault = checkText(rest.substr(equals + 2, end - equals - 2)); !fault.empty())
        return fault;
      rest.remove_prefix(end + 1);
    }
  };
  while (!text.empty()) {
    const std::size_t tag = text.find('<');
    if (std::string fault = checkText(text.substr(0, tag)); !fault.empty()) return fault;
    if (tag == text.npos) break;
    const std::size_t end = text.find('>', tag);
    if (end == text.npos) return "a tag without end";
    std::string_view inside = text.substr(tag + 1, end - tag - 1);
    text.remove_prefix(end + 1);
    if (inside.starts_with('?')) continue;
    if (inside.find('<') != inside.npos) return "< inside " + std::string(inside);
    if (inside.starts_with('/')) {
      if (open.empty() || open.back() != inside.substr(1)) return "closes " + std::string(inside);
      open.pop_back();
      continue;
    }
    const bool alone = inside.ends_with('/');
    if (alone) inside.remove_suffix(1);
    const std::string name(inside.substr(0, inside.find_first_of(" \n\t")));
    if (std::string fault = checkAttributes(inside.substr(name.size())); !fault.empty())
      return fault;
    roots += open.empty();
    if (!alone) open.push_back(name);
  }
  if (!open.empty()) return "open: " + open.back();
  return roots == 1 ? "" : std::to_string(roots) + " roots";
}

}  // namespace gnomon
