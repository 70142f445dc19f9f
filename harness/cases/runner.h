// Chooses cases, runs them under GoogleTest and leaves what they found in the session.
#pragma once

#include <functional>
#include <string>
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

/// Whether a case judges a model against truth, and runs no kernel: its suite is called ...Model.
bool judgesModel(const CaseName& c);

/// Runs the cases in this process, kernel by kernel; the session holds the records afterwards.
void runCases(Session& session, const std::vector<CaseName>& cases, const Observer& observer);

}  // namespace gnomon
