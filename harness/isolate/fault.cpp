#include "harness/isolate/fault.h"

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>

namespace gnomon {
namespace {

bool asked(const char* fault, std::string_view name) {
  const char* wanted = std::getenv("GNOMON_FAULT");
  return wanted != nullptr && std::string(fault) + ":" + std::string(name) == wanted;
}

void useAllMemory() {
  constexpr std::size_t kStep = std::size_t{1} << 26;
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  for (;;) {
    [[maybe_unused]] void* volatile kept = ::operator new(kStep);  // pages that nobody touches
  }
}

}  // namespace

void commitFault(std::string_view name) {
  if (asked("crash", name)) raise(SIGSEGV);
  if (asked("exit", name)) _exit(7);
  if (asked("memory", name)) useAllMemory();
  static bool lost = false;
  while (lost || asked("hang", name)) pause();
  lost = losesDevice(name);
}

bool losesDevice(std::string_view name) { return asked("lose", name); }

}  // namespace gnomon
