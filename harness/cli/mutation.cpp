#include "harness/cli/mutation.h"

#include <fmt/format.h>

#include "harness/cli/commands.h"

namespace gnomon {
namespace {

SessionOptions rooted(SessionOptions session) {
  session.root = sourceRoot();
  for (const auto& [kernel, file] : session.kernels) findKernel(kernel);
  return session;
}

}  // namespace

Mutation::Mutation(SessionOptions session, std::optional<unsigned> jobs, const std::string& json)
    : options(rooted(std::move(session))),
      choices(Policy::load(options.root / "tests/policy.json")),
      out(json == "-" ? stderr : stdout),
      prepared(prepare(options, choices)),
      schedule{options, choices, jobs.value_or(defaultJobs()), prepared.errors} {
  out.print(
      fmt::format("{}, {}, Vulkan {}, seed {}", gpu().name, gpu().driver, gpu().api, options.seed));
}

Answer Mutation::ask(const Question& question) {
  begin = Clock::now();
  remembered.reset();
  return inquire(schedule, prepared, question, observer(question.kernel));
}

InquiryObserver Mutation::observer(const std::string& what) {
  return {
      [this, what](std::size_t known, std::size_t all, std::size_t killed, const std::string& now) {
        if (!remembered && all > 0) remembered = known;
        out.progress(fmt::format("{} [{}/{}] {} killed{}: {}", what, known, all, killed,
                                 timeLeft(known, all), now));
      }};
}

std::string Mutation::timeLeft(std::size_t known, std::size_t all) const {
  constexpr std::size_t kFew = 8;  // tell nothing yet
  constexpr double kMinute = 60;
  const std::size_t done = known - remembered.value_or(known);
  if (done < kFew) return "";
  const double spent = std::chrono::duration<double>(Clock::now() - begin).count();
  const double seconds = spent / static_cast<double>(done) * static_cast<double>(all - known);
  return seconds < kMinute ? fmt::format(", about {:.0f} s left", seconds)
                           : fmt::format(", about {:.0f} min left", seconds / kMinute);
}

}  // namespace gnomon
