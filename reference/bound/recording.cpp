#include "reference/bound/recording.h"

#include <utility>

#include "reference/bound/explore.h"

namespace gnomon {
namespace {

constinit thread_local Recording* currentRecording = nullptr;

// `into` has been on other paths than `path`.
void joinPath(Recording::Names& into, Recording::Names path) {
  for (auto& [name, intermediate] : into) {
    const auto other = path.find(name);
    if (other == path.end() || other->second.components.size() != intermediate.components.size()) {
      intermediate.certain = false;
      continue;
    }
    intermediate.certain = intermediate.certain && other->second.certain;
    for (std::size_t i = 0; i < intermediate.components.size(); ++i)
      intermediate.components[i] = join(intermediate.components[i], other->second.components[i]);
  }
  for (auto& [name, intermediate] : path) {
    intermediate.certain = false;
    into.try_emplace(name, std::move(intermediate));  // where no other path came by
  }
}

}  // namespace

void detail::report(const Bounded* components, std::size_t n, const char* name) noexcept {
  if (currentRecording != nullptr) [[unlikely]]
    currentRecording->note(components, n, name);
}

Recording::Recording() noexcept : outer_(std::exchange(currentRecording, this)) {}
Recording::~Recording() { currentRecording = outer_; }

Recording* Recording::current() noexcept { return currentRecording; }

Recording::Names& Recording::here() { return open_.empty() ? names_ : open_.back().path; }

void Recording::note(const Bounded* components, std::size_t n, const char* name) {
  here()[name] = {.components = std::vector<Bounded>(components, components + n)};
}

void Recording::beginPath(const detail::Trail& trail) {
  if (open_.empty() || open_.back().trail != &trail) open_.push_back({.trail = &trail});
  open_.back().path.clear();
}

void Recording::endPath(const detail::Trail& trail) {
  if (open_.empty() || open_.back().trail != &trail) return;  // it began before this recording
  Exploration& now = open_.back();
  if (std::exchange(now.first, false))
    now.joined = std::move(now.path);
  else
    joinPath(now.joined, std::move(now.path));
  now.path.clear();
}

void Recording::endExploration(const detail::Trail& trail) {
  if (open_.empty() || open_.back().trail != &trail) return;
  Names joined = std::move(open_.back().joined);
  open_.pop_back();
  // As explore() does with results: too many paths say nothing, and what was decided on a value
  // that is not specified depends on it.
  for (auto& [name, intermediate] : joined) {
    for (Bounded& x : intermediate.components) {
      if (trail.overflowed()) x = withoutLimits(x, kAmbiguous | kNotJudged);
      x.flags |= trail.flags() & kFromConditions;
    }
    here()[name] = std::move(intermediate);
  }
}

}  // namespace gnomon
