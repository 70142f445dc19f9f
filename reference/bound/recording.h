// What a model says of its named intermediates, for whoever asks why a kernel differs.
//
//   const Recording recording;
//   explore([&] { return shade<Bounded>(inputs); });
//   for (const auto& [name, intermediate] : recording.names()) ...
//
// named() and reported() tell the recording of their thread, if there is one. Over the paths of an
// exploration what a name stands for is joined, as results are; a name that one path does not reach
// is uncertain. A name that is reached twice on one path stands for the last, as a kernel's probe
// keeps the last that was stored.
#ifndef GNOMON_REFERENCE_BOUND_RECORDING_H
#define GNOMON_REFERENCE_BOUND_RECORDING_H

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "reference/bound/bounded.h"

namespace gnomon {

namespace detail {
class Trail;
}

struct Intermediate {
  std::vector<Bounded> components{};
  bool certain = true;  // reached on every path
};

class Recording {
 public:
  using Names = std::map<std::string, Intermediate, std::less<>>;

  Recording() noexcept;
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  // Complete when no exploration is under way.
  const Names& names() const noexcept { return names_; }

  // The innermost of this thread, or null.
  static Recording* current() noexcept;

  // Told by the model and by explore().
  void note(const Bounded* components, std::size_t n, const char* name);
  void beginPath(const detail::Trail& trail);
  void endPath(const detail::Trail& trail);
  void endExploration(const detail::Trail& trail);

 private:
  struct Exploration {
    const detail::Trail* trail;
    bool first = true;
    Names joined{}, path{};
  };
  Names& here();

  Names names_;
  std::vector<Exploration> open_;  // innermost last
  Recording* outer_;
};

}  // namespace gnomon

#endif
