#include "bench/stopwatch.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "harness/program/compile.h"

namespace gnomon {
namespace {

Stopwatch* running = nullptr;

constexpr std::size_t kMiB = 1u << 20;
constexpr std::size_t kGroupBytes = 16 * 1024;  // of copy.comp
constexpr int kCopies = 9, kEmpties = 31;

// A fifth of a second of work at a time; an empty dispatch differs by 6 % from run to run.
constexpr std::chrono::milliseconds kAwake{200};
constexpr std::chrono::seconds kMostAwake{5};
constexpr double kSameTime = 1.1;

// Five times the largest cache of a GPU so far (50 MiB of L2).
constexpr std::size_t kCopied = 256 * kMiB;

// A software device copies at a few GB/s, and its host's last level of cache may hold hundreds of
// MiB: what is swept is what its cores have of their own. "Cold" is half of the truth there.
constexpr std::size_t kCopiedInSoftware = 64 * kMiB, kSweptInSoftware = 8 * kMiB;

}  // namespace

double leastOf(int runs, const std::function<double()>& run) {
  double least = run();
  for (int i = 1; i < runs; ++i) least = std::min(least, run());
  return least;
}

Stopwatch::Stopwatch(Session& s) : session(s) {
  if (running != nullptr) throw std::logic_error("there is a stopwatch already");
  Gpu& gpu = session.gpu();
  const bool software = gpu.info().software;
  // The specification promises 128 MiB in a binding.
  const std::size_t most = gpu.info().maxStorageRange / kGroupBytes * kGroupBytes;
  const std::size_t bytes = std::min(software ? kCopiedInSoftware : kCopied, most);
  const auto build = [&](const char* file, std::vector<BindingSlot> slots) {
    return gpu.build({.spirv = compileShader(session.options().root / "bench" / file, {}),
                      .slots = std::move(slots)});
  };
  copying = build("copy.comp", {{.binding = 0}, {.binding = 1}});
  nothing = build("empty.comp", {});
  from = gpu.allocate(bytes);
  to = gpu.allocate(bytes);
  gpu.fill(from, 1);
  gpu.fill(to, 0);
  sweep = {copyOf(software ? kSweptInSoftware : bytes)};
  running = this;
  if (gpu.info().timestampPeriodNs == 0) return;
  empty = seconds({.program = &nothing}, kEmpties);
  wake();
  copied = 2 * static_cast<double>(bytes) / seconds(copyOf(bytes), kCopies);
}

Stopwatch::~Stopwatch() { running = nullptr; }

Stopwatch& Stopwatch::current() {
  if (running == nullptr) throw std::logic_error("there is no stopwatch");
  return *running;
}

double Stopwatch::cold(Resources& resources, const GpuProgram& program) const {
  return resources.time(program, sweep);
}

void Stopwatch::wake() {
  if (session.gpu().info().software) return;
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  for (bool awake = false; !awake && Clock::now() - begin < kMostAwake;) {
    const auto round = Clock::now();
    while (Clock::now() - round < kAwake) session.gpu().run(sweep, session.limit());
    const double now = seconds({.program = &nothing}, kEmpties);
    awake = now <= kSameTime * empty && now >= empty / kSameTime;
    empty = std::min(empty, now);
  }
}

Dispatch Stopwatch::copyOf(std::size_t bytes) const {
  return {.program = &copying,
          .buffers = {{.slot = {.binding = 0}, .buffer = &from},
                      {.slot = {.binding = 1}, .buffer = &to}},
          .groups = {static_cast<std::uint32_t>(bytes / kGroupBytes), 1, 1}};
}

double Stopwatch::seconds(const Dispatch& dispatch, int runs) const {
  Gpu& gpu = session.gpu();
  gpu.run({&dispatch, 1}, session.limit());  // pays for what the driver does once
  return leastOf(runs, [&] { return gpu.run({&dispatch, 1}, session.limit()).front() * 1e-9; });
}

}  // namespace gnomon
