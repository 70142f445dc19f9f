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
  /// So many kills were looked for: fewer means that no other of the cases asked kills it, watched
  /// as closely as these: what shows in the strict twin is not sought in the module as it is.
  unsigned sought = 1;
  bool survived() const { return kills.empty(); }
};

}  // namespace gnomon
