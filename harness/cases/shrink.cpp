#include "harness/cases/shrink.h"

#include <algorithm>
#include <exception>
#include <memory>

#include <rapidcheck/seq/Create.h>
#include <rapidcheck/seq/Transform.h>
#include <rapidcheck/shrinkable/Create.h>

#include "harness/cases/simpler.h"

namespace gnomon {
namespace {

using Clock = std::chrono::steady_clock;
using Tree = rc::Shrinkable<CaseInput>;

// Where judging many costs as much as judging one: more than any field has candidates.
constexpr std::size_t kAtOnce = 256;

class Descent {
 public:
  Descent(const CaseInput& failing, const Trials& t, const ShrinkLimits& l)
      : trials(t), limits(l), simplifier(failing), until(Clock::now() + duration(l)) {
    best.input = failing;
  }

  Shrunk run() {
    try {
      while (pass()) {
      }
      best.finished = !exhausted();
    } catch (const std::exception&) {  // a lost device, a bug: what was found so far stays
    }
    return std::move(best);
  }

 private:
  static Clock::duration duration(const ShrinkLimits& l) {
    return std::chrono::duration_cast<Clock::duration>(l.time);
  }

  bool exhausted() const { return Clock::now() >= until || best.trials >= limits.trials; }

  /// Every place once; begins anew where the input has become smaller, since then it has others.
  bool pass() {
    bool stepped = false;
    for (const Site& site : simplifier.sites(best.input)) {
      if (exhausted()) return false;
      const std::size_t numbers = best.input.numbers();
      stepped |= descend(site);
      if (best.input.numbers() != numbers) return true;
    }
    return stepped;
  }

  bool descend(const Site& site) {
    const auto simpler = [&](const CaseInput& input) {
      const auto shared = std::make_shared<const CaseInput>(input);
      const Complexity now = simplifier.complexity(input);
      return rc::seq::mapMaybe(rc::seq::fromContainer(site.candidates(shared)),
                               [this, now](const Candidate& make) -> rc::Maybe<CaseInput> {
                                 auto fitted = trials.fitted(make());
                                 if (!fitted || !(simplifier.complexity(*fitted) < now))
                                   return rc::Nothing;
                                 return *fitted;
                               });
    };
    Tree at = rc::shrinkable::shrinkRecur(best.input, simpler);
    bool stepped = false;
    while (auto next = firstFailing(at)) {
      at = std::move(*next);
      best.input = at.value();
      ++best.steps;
      stepped = true;
    }
    return stepped;
  }

  std::optional<Tree> firstFailing(const Tree& at) {
    rc::Seq<Tree> candidates = at.shrinks();
    const std::size_t some = trials.atOnce(at.value()) ? kAtOnce : 1;
    while (!exhausted()) {
      std::vector<Tree> trees;
      std::vector<CaseInput> values;
      while (values.size() < some) {
        const auto next = candidates.next();
        if (!next) break;
        trees.push_back(*next);
        values.push_back(next->value());
      }
      if (values.empty()) return std::nullopt;
      best.trials += values.size();
      if (const auto found = trials.firstFailing(values)) return trees[*found];
    }
    return std::nullopt;
  }

  const Trials& trials;
  const ShrinkLimits& limits;
  Simplifier simplifier;
  Clock::time_point until;
  Shrunk best{};
};

}  // namespace

Shrunk shrink(const CaseInput& failing, const Trials& trials, const ShrinkLimits& limits) {
  return Descent(failing, trials, limits).run();
}

}  // namespace gnomon
