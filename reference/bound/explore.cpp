#include "reference/bound/explore.h"

#include <stdexcept>

#include "reference/bound/recording.h"

namespace gnomon {
namespace {

constinit thread_local detail::Trail* currentTrail = nullptr;

}  // namespace

bool Decision::branch(const Decision& decision) {
  if (currentTrail != nullptr) return currentTrail->decide(decision);
  throw std::logic_error(
      "undecided comparison used as bool outside explore(): both outcomes conform, so choose data "
      "with select(), or run the model through explore()");
}

namespace detail {

bool Trail::decide(const Decision& decision) noexcept {
  flags_ |= decision.flags;
  if (at_ < depth_) return steps_[at_++].taken;
  if (at_ == steps_.size()) {
    overflowed_ = true;
    return decision.value;
  }
  steps_[at_] = {decision.value, false};
  depth_ = ++at_;
  return decision.value;
}

bool Trail::advance() noexcept {
  depth_ = at_;
  at_ = 0;
  while (depth_ > 0 && steps_[depth_ - 1].other) --depth_;
  if (depth_ == 0 || overflowed_) return false;
  if (++runs_ > kMaxPaths) {
    overflowed_ = true;
    return false;
  }
  steps_[depth_ - 1] = {!steps_[depth_ - 1].taken, true};
  return true;
}

Trail::~Trail() {
  if (Recording* recording = Recording::current()) recording->endExploration(*this);
}

FollowTrail::FollowTrail(Trail& trail) noexcept : trail_(&trail), outer_(currentTrail) {
  currentTrail = &trail;
  if (Recording* recording = Recording::current()) recording->beginPath(trail);
}
FollowTrail::~FollowTrail() {
  currentTrail = outer_;
  if (Recording* recording = Recording::current()) recording->endPath(*trail_);
}

void throwPlainDiffers() {
  throw std::logic_error(
      "explore(): a plain member of the result differs between branches that both conform; make "
      "it a Bounded or an IntRange");
}

}  // namespace detail
}  // namespace gnomon
