#include "harness/mutate/inquiry.h"

#include <algorithm>
#include <chrono>
#include <random>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/cache.h"
#include "harness/cases/hash.h"
#include "harness/error.h"
#include "harness/mutate/model_campaign.h"
#include "harness/mutate/operators.h"

namespace gnomon {
namespace {

using Clock = std::chrono::steady_clock;

void refuseUnknownOperators(const std::set<std::string>& names) {
  std::vector<std::string_view> known;
  for (const OperatorInfo& o : mutationOperators()) known.push_back(o.name);
  for (const std::string& name : names)
    if (std::ranges::find(known, name) == known.end())
      throw UsageError(
          fmt::format("there is no operator '{}'.\nOperators: {}", name, fmt::join(known, ", ")));
}

/// So many of them, in their order; the same ones for a seed.
void keepSample(std::vector<Mutant>& mutants, std::size_t count, std::uint64_t seed) {
  if (count >= mutants.size()) return;
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < count; ++i)  // Fisher and Yates, the first `count` steps
    std::swap(mutants[i], mutants[i + random() % (mutants.size() - i)]);
  mutants.resize(count);
  std::ranges::sort(mutants, {}, &Mutant::id);
}

std::filesystem::path cacheFile(const Preparation& prepared, std::string kernel) {
  const std::filesystem::path folder = cacheFolder();
  if (folder.empty()) return {};
  for (char& c : kernel)
    if (c == '/' || c == ' ') c = '-';
  return folder / "mutants" / deviceKey(prepared.gpu) / (kernel + ".jsonl");
}

/// What a fate depends on besides the mutant.
std::optional<std::uint64_t> circumstances(const Schedule& schedule, const Preparation& prepared,
                                           const std::string& kernel) {
  const auto evidence = evidenceHash(schedule.session.root, kernel.substr(0, kernel.find('/')));
  if (!evidence) return std::nullopt;
  return hashOf(fmt::format("{} {} {} {}", *evidence, schedule.session.seed,
                            schedule.session.cases.value_or(0), toJson(prepared)));
}

class Inquiry {
 public:
  Inquiry(const Schedule& s, const Preparation& p, const Question& q, const InquiryObserver& o)
      : schedule(s), prepared(p), question(q), observer(o) {}

  Answer ask() {
    const auto begin = Clock::now();
    refuseUnknownOperators(question.operators);
    answer.kernel = question.kernel + (question.ofModel ? " model" : "");
    tell("finding mutants");
    question.ofModel ? listModel() : makeMutants();
    if (!question.mutants.empty())
      std::erase_if(answer.mutants,
                    [&](const Mutant& m) { return !question.mutants.contains(m.id); });
    if (question.sample) keepSample(answer.mutants, *question.sample, schedule.session.seed);
    const auto about = circumstances(schedule, prepared, question.kernel);
    FateCache cache(about ? cacheFile(prepared, title()) : std::filesystem::path());
    std::vector<Mutant> open = takeKnown(cache, about.value_or(0));
    if (!open.empty() && question.ofModel) judgeModel(open, cache, about.value_or(0));
    if (!open.empty() && !question.ofModel) judge(open, cache, about.value_or(0));
    if (!question.sample && question.operators.empty() && question.mutants.empty())
      cache.keepOnly(keys);
    answer.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    return std::move(answer);
  }

 private:
  /// What the fates are of, and by whom.
  std::string title() const {
    return answer.kernel + (question.by ? fmt::format(" by {}", nameOf(*question.by)) : "");
  }

  void makeMutants() {
    const KernelRecord& record = findKernel(question.kernel);
    const bool foreign = schedule.session.kernels.contains(question.kernel);
    const KernelModule module = moduleOf(schedule.session, record);
    MutantSet found = mutantsOf(module.words, question.operators,
                                foreign ? std::vector<std::string>{} : record.ownCode);
    answer.mutants = std::move(found.mutants);
    answer.equivalent = std::move(found.equivalent);
    answer.invalid = found.invalid;
    answer.duplicates = found.duplicates;
    if (question.sample) answer.equivalent.clear();
  }

  void listModel() {
    for (const NamedModelMutant& m : listModelMutants(schedule, question.kernel))
      answer.mutants.push_back({.id = m.id,
                                .operatorName = m.kind,
                                .place = {.function = m.entry, .text = m.entry},
                                .change = m.kind,
                                .hash = hashOf(m.id)});
  }

  static std::uint64_t keyOf(const Mutant& m, std::uint64_t about) {
    return hashOf(fmt::format("{} {}", m.hash, about));
  }

  /// Fates that are known; returns the mutants whose are not.
  std::vector<Mutant> takeKnown(const FateCache& cache, std::uint64_t about) {
    std::vector<Mutant> open;
    answer.fates.resize(answer.mutants.size());
    for (std::size_t i = 0; i < answer.mutants.size(); ++i) {
      const std::uint64_t key = keyOf(answer.mutants[i], about);
      keys.insert(key);
      if (const auto fate = cache.find(key, question.sought)) {
        answer.fates[i] = *fate;
        ++answer.remembered;
        killed += !fate->survived();
      } else {
        open.push_back(answer.mutants[i]);
      }
    }
    known = answer.remembered;
    return open;
  }

  void judge(const std::vector<Mutant>& open, FateCache& cache, std::uint64_t about) {
    tell("the kernel itself");
    const std::vector<Witness> witnesses = witnessesOf(schedule, question.kernel, question.by);
    SessionOptions session = schedule.session;
    session.shrinks = session.probes = false;  // that it fails is all that is asked
    judgeMutants(
        {session, schedule.policy, schedule.jobs, schedule.errors}, prepared.gpu, question.kernel,
        open, witnesses, question.sought,
        {.begun = [this](const Mutant& m) { tell(m.id); },
         .told = [&](const Mutant& m, const Fate& fate) { settle(m.id, fate, cache, about); }});
  }

  void judgeModel(const std::vector<Mutant>& open, FateCache& cache, std::uint64_t about) {
    std::vector<std::string> ids;
    for (const Mutant& m : open) ids.push_back(m.id);
    judgeModelMutants(
        schedule, question.kernel, ids, question.by, question.sought,
        [&](const std::string& id, const Fate& fate) { settle(id, fate, cache, about); });
  }

  void settle(const std::string& id, const Fate& fate, FateCache& cache, std::uint64_t about) {
    const auto at = std::ranges::find(answer.mutants, id, &Mutant::id);
    answer.fates[static_cast<std::size_t>(at - answer.mutants.begin())] = fate;
    cache.keep(keyOf(*at, about), fate);
    ++known;
    killed += !fate.survived();
    tell(id);
  }

  void tell(const std::string& now) const {
    if (observer.progress) observer.progress(known, answer.mutants.size(), killed, now);
  }

  const Schedule& schedule;
  const Preparation& prepared;
  const Question& question;
  const InquiryObserver& observer;
  Answer answer{};
  std::set<std::uint64_t> keys{};
  std::size_t known = 0, killed = 0;
};

}  // namespace

std::vector<std::string> mutatedKernels(const std::vector<std::string>& stages) {
  std::set<std::string> chosen;
  for (const CaseName& c : selectCases({.stages = stages})) chosen.insert(c.kernel);
  std::vector<std::string> kernels;
  for (const KernelRecord* r : catalogue())
    if (r->mutates && chosen.contains(r->name())) kernels.push_back(r->name());
  if (kernels.empty())
    throw UsageError(fmt::format("{} has no kernel to mutate: its kernels are generated",
                                 fmt::join(stages, ", ")));
  return kernels;
}

Answer inquire(const Schedule& schedule, const Preparation& prepared, const Question& question,
               const InquiryObserver& observer) {
  return Inquiry(schedule, prepared, question, observer).ask();
}

}  // namespace gnomon
