// Chooses cases, runs them under GoogleTest and leaves what they found in the session.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/cases/session.h"

namespace gnomon {

/// A case as `gnomon list cases` prints it.
struct CaseName {
  std::string name{};    ///< "BrdfEvaluate.LobeStaysInsideTheBound"
  std::string kernel{};  ///< "brdf/evaluate"
};

struct Selection {
  std::vector<std::string> stages{};  ///< STAGE or STAGE/ENTRY; empty: all
  std::string filter{};               ///< shell pattern on the name; empty: all
  unsigned shard = 1, shards = 1;     ///< the shard-th of so many parts, from 1
};

/// The cases chosen, in order of stages. Throws UsageError naming a stage that does not exist, or
/// the pattern if it matches nothing.
std::vector<CaseName> selectCases(const Selection& selection);

/// Told of every case as it begins and ends.
struct Observer {
  std::function<void(const CaseName&, std::size_t index, std::size_t count)> begin;
  std::function<void(const CaseRecord&)> end;
  bool endsCaseAtFailure = false;  ///< the first failure of a case is all that is asked of it
};

/// What a case judges, and by what: the end of its suite's name says it.
enum class Kind {
  kComparison,   ///< a kernel by its model
  kLaw,          ///< ...Laws: a kernel by what holds without its model
  kTruth,        ///< ...Model: a model by what does not come from it; no kernel runs
  kComposition,  ///< ...Parts: a whole model by its own parts; no kernel runs
  kBound         ///< ...Bound: how wide a model's intervals are; no kernel runs
};
Kind kindOf(const CaseName& c);
std::string_view nameOf(Kind kind);  ///< "comparison", "law", ...
bool runsKernel(Kind kind);
/// Whether it can tell an altered model: an interval is no number that could be altered.
bool judgesModel(Kind kind);

/// Runs the cases in this process, kernel by kernel; the session holds the records afterwards.
void runCases(Session& session, const std::vector<CaseName>& cases, const Observer& observer);

}  // namespace gnomon
