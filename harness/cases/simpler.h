// Which numbers are simpler for a person than others, and how simple an input is altogether.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "harness/cases/case_input.h"

namespace gnomon {

/// The simplest first, each simpler than x: 0, 1, 1/2, then fewer decimal digits, an exponent
/// nearer to 0, smaller leading digits.
std::vector<float> simplerThan(float x);

/// Towards 0.
std::vector<std::uint32_t> simplerThan(std::uint32_t x);

/// Of length one but for the rounding of its components.
bool isUnit(const vec3& v);

/// Unit vectors, the simplest first: axes, then those of few exact decimals ((0.6, 0, 0.8), ...),
/// then in a plane of two axes, with few digits.
std::vector<vec3> simplerDirections(const vec3& unit);

/// How simple an input is: fewer numbers, then simpler ones. A descent by it comes to an end,
/// whatever is asked of its steps.
struct Complexity {
  std::size_t numbers = 0;
  std::uint64_t digits = 0;
  auto operator<=>(const Complexity&) const = default;
};

/// Made when it is asked for: there may be many of a large input.
using Candidate = std::function<CaseInput()>;

/// One place where an input may become simpler, and its candidates there, the simplest first.
struct Site {
  std::string name{};  ///< "samples[0].roughness"
  std::function<std::vector<Candidate>(const std::shared_ptr<const CaseInput>&)> candidates{};
};

/// Makes inputs simpler by what their contract structs say. A vec3 that is a unit vector in every
/// element stays one: shortened, it would leave the contract's domain.
class Simplifier {
 public:
  explicit Simplifier(const CaseInput& original);

  Complexity complexity(const CaseInput& input) const;

  /// Every place of this input, in the order in which to try them: sizes, directions together,
  /// then number by number.
  std::vector<Site> sites(const CaseInput& input) const;

 private:
  bool isDirection(const std::string& block, const Field& field) const {
    return directions.contains(block + "." + field.name);
  }
  std::uint64_t digits(const CaseInput::Block& block) const;

  std::set<std::string> directions{};  ///< "samples.normal"
};

}  // namespace gnomon
