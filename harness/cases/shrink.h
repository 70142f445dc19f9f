// From an input that fails to the simplest one that still fails in the same way.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <span>

#include "harness/cases/case_input.h"

namespace gnomon {

/// What is asked of candidates.
struct Trials {
  /// The candidate as the case would take it; nothing where it cannot be, or the contract does not
  /// admit it.
  std::function<std::optional<CaseInput>(const CaseInput&)> fitted{};
  /// Which of the candidates is the first that fails in the same way, if any. What it throws ends
  /// the descent.
  std::function<std::optional<std::size_t>(std::span<const CaseInput>)> firstFailing{};
  /// Whether it judges many candidates for the price of one.
  std::function<bool(const CaseInput&)> atOnce{};
};

struct ShrinkLimits {
  std::chrono::duration<double> time{};
  std::size_t trials = 0;  ///< candidates asked about
};

struct Shrunk {
  CaseInput input{};
  std::size_t steps = 0;   ///< each to a simpler input
  std::size_t trials = 0;  ///< candidates asked about
  bool finished = false;   ///< nothing simpler fails; else a limit or an error ended the descent
};

/// Descends greedily: place by place (harness/cases/simpler.h) through a RapidCheck tree, until no
/// place has a simpler candidate that fails. The same for the same input and answers. Every step
/// is to a strictly simpler input, so it ends even where the answers contradict each other.
Shrunk shrink(const CaseInput& failing, const Trials& trials, const ShrinkLimits& limits);

}  // namespace gnomon
