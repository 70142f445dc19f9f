// How truth and law tests call a model, so that an operation of it can be altered under them.
//
// A test calls modelled() instead of the model's template. That is the plain model, unless this
// process counts what can be altered (CountedModels) or has altered one operation (AlteredModel).
// A test that compares with the model's own bound calls the template itself: the bound is the same
// formula, so it would tell every altered one apart, and the formula would have judged itself.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/cases/kernel_case.h"
#include "reference/bound/altered.h"

namespace gnomon {

/// A model's function with one operation altered.
struct ModelMutant {
  std::string entry{};  ///< label of the function: "D_GGX"
  AlterableOperation operation{};
  /// Of the operation when it was first met: what a reader finds it by.
  Operands operands{};

  /// "D_GGX:3:multiply"; "view.cascades:ny:40:multiply" where the second of two `if`s held.
  std::string id() const;
};

/// While one lives, modelled() lists what can be altered. One at a time; not beside AlteredModel.
class CountedModels {
 public:
  CountedModels();
  ~CountedModels();
  CountedModels(const CountedModels&) = delete;
  CountedModels& operator=(const CountedModels&) = delete;

  /// Everything that was met in any evaluation so far, by entry and operation.
  std::vector<ModelMutant> mutants() const;
  /// Entries that were evaluated since this was last asked.
  std::set<std::string> takeEntries() const;

  /// Called by modelled(), from any thread.
  static void add(const std::string& entry, const std::vector<AlterableStep>& steps);
};

/// While one lives, modelled() evaluates the mutant's entry with its operation altered.
class AlteredModel {
 public:
  explicit AlteredModel(ModelMutant mutant);
  ~AlteredModel();
  AlteredModel(const AlteredModel&) = delete;
  AlteredModel& operator=(const AlteredModel&) = delete;
};

namespace detail {

/// What this process does with models: changed only while no case runs.
struct Modelling {
  bool counts = false;
  std::optional<ModelMutant> mutant{};
};
extern Modelling modelling;

/// A model's result of altered numbers as one of doubles.
template <class Plain, class Result>
Plain plainOf(Result altered) {
  Plain plain{};
  std::vector<double> values;
  auto take = [&](const Altered& x) { values.push_back(x.value); };
  forEachScalar(altered, take);
  auto give = [at = values.begin()](double& x) mutable { x = *at++; };
  forEachScalar(plain, give);
  return plain;
}

/// Counts, and checks that an Altered of which nothing is altered is the double.
template <class Model, class Plain>
void count(const std::string& entry, const Model& model, Plain plain) {
  std::vector<AlterableStep> steps;
  Plain again{};
  {
    const AlteredEvaluation evaluation(steps);
    again = plainOf<Plain>(model.template operator()<Altered>());
  }
  CountedModels::add(entry, steps);
  std::vector<double> expected;
  auto take = [&](double x) { expected.push_back(x); };
  forEachScalar(plain, take);
  auto compare = [&, at = expected.begin()](double x) mutable {
    const double y = *at++;
    if (x != y && (x == x || y == y))
      throw std::logic_error(entry + ": Altered differs from double, unaltered");
  };
  forEachScalar(again, compare);
}

}  // namespace detail

/// The double result of `model.template operator()<T>()`, which is a number or has scalars().
/// `entry` labels the model's function, one label for all tests of it; for a function that switches
/// on a number, "curve.hill", one for each: else what counts as one operation is several.
template <class Model>
auto modelled(const std::string& entry, const Model& model) {
  using Plain = decltype(model.template operator()<double>());
  const detail::Modelling& modelling = detail::modelling;
  if (modelling.mutant && modelling.mutant->entry == entry) {
    const AlteredEvaluation evaluation(modelling.mutant->operation);
    return detail::plainOf<Plain>(model.template operator()<Altered>());
  }
  Plain plain = model.template operator()<double>();
  if (modelling.counts) detail::count(entry, model, plain);
  return plain;
}

/// What a test hands to a model's function: an argument, not an operation.
template <class T>
T given(double x) {
  if constexpr (std::is_same_v<T, double>) {
    return x;
  } else {
    return T::input(x);
  }
}
template <class T>
Vec3<T> given(const Vec3<double>& v) {
  return {given<T>(v.x), given<T>(v.y), given<T>(v.z)};
}

}  // namespace gnomon
