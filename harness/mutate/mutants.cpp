#include "harness/mutate/mutants.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/mutate/normal_form.h"
#include "harness/mutate/operators.h"
#include "harness/verdict/parallel.h"

namespace gnomon {
namespace {

/// Calls `take` with every edit, named; the edit is applied only by who wants it.
template <class Take>
void forEachEdit(const ModuleView& view, const Take& take) {
  std::map<std::string, unsigned> counts;
  for (const std::size_t index : view.code()) {
    std::optional<SourcePlace> place;  // looked up only where there is something to change
    proposeEdits(view, index, [&](std::string_view operatorName, const Edit& edit) {
      if (!place) place = view.placeOf(index);
      const std::string group = fmt::format("{}:{}:{}", place->file, place->function, operatorName);
      take(Mutant{.id = fmt::format("{}:{}", group, ++counts[group]),
                  .operatorName = std::string(operatorName),
                  .place = *place,
                  .change = edit.change},
           edit);
    });
  }
}

/// What classification finds of a mutant.
struct Form {
  bool valid = false;
  std::uint64_t normal = 0;
};

std::vector<Form> formsOf(const std::vector<Mutant>& mutants) {
  std::vector<Form> forms(mutants.size());
  parallelFor(
      mutants.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          forms[i].valid = validateSpirv(mutants[i].module).empty();
          if (forms[i].valid) forms[i].normal = normalForm(mutants[i].module);
        }
      },
      /*grain=*/1);
  return forms;
}

}  // namespace

MutantSet mutantsOf(std::span<const std::uint32_t> module, const std::set<std::string>& operators,
                    const std::vector<std::string>& parts) {
  const auto isPart = [&](const std::string& id) {
    return parts.empty() ||
           std::ranges::any_of(parts, [&](const std::string& p) { return id.starts_with(p); });
  };
  const ModuleView view(module);
  std::vector<Mutant> all;
  forEachEdit(view, [&](Mutant mutant, const Edit& edit) {
    if (!operators.empty() && !operators.contains(mutant.operatorName)) return;
    if (!isPart(mutant.id)) return;
    mutant.module = edit.applied();
    mutant.hash = hashWithoutDebug(mutant.module);
    all.push_back(std::move(mutant));
  });
  const std::vector<Form> forms = formsOf(all);
  const std::uint64_t original = normalForm(module);
  std::set<std::uint64_t> seen;
  MutantSet found;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!forms[i].valid)
      ++found.invalid;
    else if (forms[i].normal == original)
      found.equivalent.push_back(std::move(all[i]));
    else if (!seen.insert(forms[i].normal).second)
      ++found.duplicates;
    else
      found.mutants.push_back(std::move(all[i]));
  }
  return found;
}

std::vector<Mutant> mutantsNamed(std::span<const std::uint32_t> module,
                                 const std::vector<std::string>& ids) {
  const ModuleView view(module);
  std::map<std::string, Mutant> wanted;
  forEachEdit(view, [&](Mutant mutant, const Edit& edit) {
    if (std::ranges::find(ids, mutant.id) == ids.end()) return;
    mutant.module = edit.applied();
    wanted[mutant.id] = std::move(mutant);
  });
  std::vector<Mutant> all;
  for (const std::string& id : ids) {
    const auto found = wanted.find(id);
    if (found == wanted.end()) throw UsageError(fmt::format("there is no mutant '{}'", id));
    all.push_back(found->second);
  }
  return all;
}

}  // namespace gnomon
