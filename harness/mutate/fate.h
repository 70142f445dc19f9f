// What has become of a mutant.
#pragma once

#include <string>
#include <vector>

namespace gnomon {

/// A case that failed on a mutant.
struct Kill {
  std::string by{};   ///< the case's name
  std::string how{};  ///< first line of its message, or how its worker died

  /// Without the size of the subgroups in which it failed.
  std::string caseName() const { return by.substr(0, by.find(' ')); }
};

struct Fate {
  std::vector<Kill> kills{};  ///< in the order in which they were found; none: it survives
  unsigned sought = 1;  ///< so many kills were looked for: fewer means that no other case kills
  bool survived() const { return kills.empty(); }
};

}  // namespace gnomon
