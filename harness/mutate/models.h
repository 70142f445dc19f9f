// Mutation of the CPU models: each operation of a model altered in turn (reference/bound/altered.h)
// under the model's own truth and law tests. What no test notices is a mistake that the model could
// hold. No GPU.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "harness/cases/modelled.h"
#include "harness/cases/runner.h"

namespace gnomon {

/// What a kernel's model can be altered in, and what may notice.
struct ModelPlan {
  struct Case {
    CaseName name{};
    double seconds = 0;               ///< that the counting run took
    std::set<std::string> entries{};  ///< that it evaluates: it cannot notice others
  };
  std::string kernel{};
  std::vector<Case> cases{};  ///< the cheapest first
  std::vector<ModelMutant> mutants{};
};

/// Runs all cases of a kernel's model, counting its operations. No mutants where no case calls
/// modelled(). Throws std::runtime_error, with the case and its message, unless all pass.
ModelPlan planModel(Session& session, const std::string& kernel);

/// What became of one mutant.
struct ModelOutcome {
  std::vector<std::string> killers{};  ///< cases that failed, in the order of running
  std::string message{};               ///< the first one's, its first line
  bool killed() const { return !killers.empty(); }
};

/// Runs the cases that evaluate the mutant's entry, each to its first failure, until `sought` have
/// failed.
ModelOutcome judgeMutant(Session& session, const ModelPlan& plan, const ModelMutant& mutant,
                         std::size_t sought = 1);

/// How a worker tells its parent: ids with what they alter, and an outcome. The readers throw
/// UsageError for any other text.
std::string toJson(const std::vector<ModelMutant>& mutants);
std::string toJson(const ModelOutcome& outcome);

/// A mutant as a person and a cache know it.
struct NamedModelMutant {
  std::string id{}, entry{}, kind{};
};
std::vector<NamedModelMutant> modelMutants(std::string_view json);
ModelOutcome modelOutcome(std::string_view json);

}  // namespace gnomon
