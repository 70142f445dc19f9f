#include "harness/cases/modelled.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include <fmt/format.h>

namespace gnomon {
namespace {

struct Counts {
  std::mutex mutex{};
  std::map<std::string, std::map<AlterableOperation, Operands>> met{};
  std::set<std::string> entries{};
};

Counts& counts() {
  static Counts all;
  return all;
}

}  // namespace

detail::Modelling detail::modelling;

std::string ModelMutant::id() const {
  std::string path;
  for (std::uint64_t bits = operation.path; bits > 1; bits >>= 1) path += bits & 1 ? 'y' : 'n';
  std::ranges::reverse(path);
  return fmt::format("{}:{}{}{}:{}", entry, path, path.empty() ? "" : ":", operation.number,
                     nameOf(operation.kind));
}

CountedModels::CountedModels() {
  counts().met.clear();
  counts().entries.clear();
  detail::modelling.counts = true;
}

CountedModels::~CountedModels() { detail::modelling.counts = false; }

void CountedModels::add(const std::string& entry, const std::vector<AlterableStep>& steps) {
  Counts& all = counts();
  const std::scoped_lock lock(all.mutex);
  all.entries.insert(entry);
  auto& met = all.met[entry];
  // Most evaluations take a known path, whose operations stand in this order.
  auto at = met.begin();
  for (const AlterableStep& s : steps) {
    while (at != met.end() && at->first < s.operation) ++at;
    if (at == met.end() || at->first != s.operation)
      at = met.emplace_hint(at, s.operation, s.operands);
  }
}

std::vector<ModelMutant> CountedModels::mutants() const {
  std::vector<ModelMutant> all;
  for (const auto& [entry, met] : counts().met)
    for (const auto& [operation, operands] : met) all.push_back({entry, operation, operands});
  return all;
}

std::set<std::string> CountedModels::takeEntries() const {
  return std::exchange(counts().entries, {});
}

AlteredModel::AlteredModel(ModelMutant mutant) { detail::modelling.mutant = std::move(mutant); }

AlteredModel::~AlteredModel() { detail::modelling.mutant.reset(); }

}  // namespace gnomon
