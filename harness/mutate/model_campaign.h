// Which mutants of a kernel's model its truth and law tests tell from the model. No GPU.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/isolate/schedule.h"
#include "harness/mutate/fate.h"
#include "harness/mutate/models.h"

namespace gnomon {

/// Every mutant of the model, found in a worker that counts operations under the model's tests;
/// none where no test calls the model so. Throws CaseFailure where a test fails on the model as it
/// is.
std::vector<NamedModelMutant> listModelMutants(const Schedule& schedule, const std::string& kernel);

/// The tests, or those of one kind, on each of these mutants, cheapest first, in workers. `told` is
/// called once for each, by one thread at a time.
void judgeModelMutants(const Schedule& schedule, const std::string& kernel,
                       const std::vector<std::string>& ids, std::optional<Kind> kind,
                       unsigned sought,
                       const std::function<void(const std::string& id, const Fate&)>& told);

}  // namespace gnomon
