#include "harness/isolate/process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace gnomon {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kGrace = 1s;    // from SIGTERM to SIGKILL: time to remove temporary files
constexpr auto kGiveUp = 10s;  // from SIGKILL: only a call that hangs in the kernel takes longer
constexpr auto kDrain = 1s;  // for what the pipes still hold, 64 KiB or a little more: milliseconds

[[noreturn]] void fail(const std::string& what, int error = errno) {
  throw std::system_error(error, std::generic_category(), what);
}

/// Owns a descriptor; -1: none.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : fd(number) {}
  Descriptor(Descriptor&& other) noexcept : fd(std::exchange(other.fd, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd, other.fd);
    return *this;
  }
  ~Descriptor() { close(); }
  int get() const { return fd; }
  bool open() const { return fd >= 0; }
  void close() {
    if (fd >= 0) ::close(std::exchange(fd, -1));
  }

 private:
  int fd = -1;
};

/// Out of the way of 0, 1 and 2, which the child replaces one after the other.
Descriptor aboveStandard(Descriptor low) {
  if (low.get() > STDERR_FILENO) return low;
  Descriptor high(fcntl(low.get(), F_DUPFD_CLOEXEC, STDERR_FILENO + 1));
  if (!high.open()) fail("fcntl");
  return high;
}

struct Pipe {
  Descriptor reading, writing;

  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail("pipe2");
    reading = Descriptor(ends[0]);
    writing = Descriptor(ends[1]);
    writing = aboveStandard(std::move(writing));
  }
};

/// Beginning and end of a text, so that memory stays bounded.
class Excerpt {
 public:
  explicit Excerpt(std::size_t maximum) : half(maximum / 2) {}

  void append(std::string_view text) {
    const std::size_t n = std::min(text.size(), half - head.size());
    head.append(text.substr(0, n));
    tail.append(text.substr(n));
    if (tail.size() > 2 * half) trim();  // not at each append: that would be quadratic
  }

  std::string text() {
    trim();
    return cut == 0 ? head + tail : fmt::format("{}\n[... {} bytes cut ...]\n{}", head, cut, tail);
  }

 private:
  void trim() {
    if (tail.size() <= half) return;
    cut += tail.size() - half;
    tail.erase(0, tail.size() - half);
  }

  std::size_t half, cut = 0;
  std::string head{}, tail{};
};

/// Cuts a stream into lines for ProcessOptions::onLine.
class Lines {
 public:
  Lines(std::function<void(std::string_view)> callback, std::size_t maximum)
      : onLine(std::move(callback)), longest(std::max<std::size_t>(maximum, 1)) {}

  void append(std::string_view text) {
    if (!onLine) return;
    for (std::size_t end; (end = text.find('\n')) != text.npos; text.remove_prefix(end + 1)) {
      add(text.substr(0, end));
      emit();
    }
    add(text);
  }

  void finish() {
    if (!rest.empty()) emit();
  }

 private:
  void add(std::string_view text) {
    while (rest.size() + text.size() > longest) {
      const std::size_t n = longest - rest.size();
      rest.append(text.substr(0, n));
      text.remove_prefix(n);
      emit();
    }
    rest.append(text);
  }

  void emit() {
    onLine(rest);
    rest.clear();
  }

  std::function<void(std::string_view)> onLine;
  std::size_t longest;
  std::string rest{};
};

/// `NAME=value` of our environment with `added` on top.
std::vector<std::string> environmentWith(std::map<std::string, std::string> added) {
  std::vector<std::string> all;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    if (!added.contains(std::string(text.substr(0, text.find('='))))) all.emplace_back(text);
  }
  for (const auto& [name, value] : added) all.push_back(name + "=" + value);
  return all;
}

/// The null-terminated array that execve wants; valid as long as `texts`.
std::vector<char*> pointersTo(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// All that the child needs between fork and exec, where it may not allocate.
struct Launch {
  const char* path;
  char* const* arguments;
  char* const* environment;
  int input, output, errors;
  int report;  ///< takes a Refusal
  pid_t parent;
  rlimit data;
};

/// Which call of the child failed; `call` is a literal, so it means the same in the parent.
struct Refusal {
  const char* call = nullptr;
  int error = 0;
};

/// The calls of the child up to exec, all async-signal-safe; returns the one that failed.
const char* prepareAndExec(const Launch& launch) {
  if (setpgid(0, 0) != 0) return "setpgid";
  // The signal is tied to the thread that forked; that one waits until the child has ended.
  if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return "prctl";
  if (getppid() != launch.parent) _exit(1);  // died before it could be tied
  const rlimit none{0, 0};
  if (setrlimit(RLIMIT_CORE, &none) != 0) return "setrlimit";
  if (setrlimit(RLIMIT_DATA, &launch.data) != 0) return "setrlimit";
  if (dup2(launch.input, STDIN_FILENO) < 0) return "dup2";
  if (dup2(launch.output, STDOUT_FILENO) < 0) return "dup2";
  if (dup2(launch.errors, STDERR_FILENO) < 0) return "dup2";
  if (close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC) != 0) return "close_range";
  for (int number = 1; number < NSIG; ++number) std::signal(number, SIG_DFL);
  sigset_t nothing;
  sigemptyset(&nothing);
  if (sigprocmask(SIG_SETMASK, &nothing, nullptr) != 0) return "sigprocmask";
  execve(launch.path, launch.arguments, launch.environment);
  return "execve";
}

/// Forks and becomes the command; returns in the parent only. Our signal handlers never run in the
/// child; _Fork also leaves out the handlers of pthread_atfork, which may wait for other threads.
pid_t launchChild(const Launch& launch) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = _Fork();
  if (pid == 0) {
    const char* call = prepareAndExec(launch);
    const Refusal refusal{call, errno};
    [[maybe_unused]] const auto written = write(launch.report, &refusal, sizeof refusal);
    _exit(127);
  }
  const int error = errno;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (pid < 0) fail("fork", error);
  return pid;
}

rlimit dataLimit(std::uint64_t bytes) {
  rlimit now{};
  if (getrlimit(RLIMIT_DATA, &now) != 0) fail("getrlimit");
  if (bytes == 0) return now;
  const rlim_t limit = std::min<rlim_t>(bytes, now.rlim_max);
  return {limit, limit};
}

/// A started child; stopped and reaped with the object.
class Child {
 public:
  explicit Child(const ProcessOptions& options)
      : outputText(options.maxOutputBytes),
        errorText(options.maxOutputBytes),
        lines(options.onLine, options.maxOutputBytes) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  void start(const std::filesystem::path& executable, const ProcessOptions& options);
  bool readUntilEnd(const std::function<Clock::time_point()>& deadline);
  void readRest(Clock::time_point deadline);
  bool reap(siginfo_t& info);

  /// To the whole group. Until it is reaped its number cannot belong to anybody else.
  void signal(int number) {
    if (pid > 0) kill(-pid, number);
  }

  Excerpt outputText, errorText;
  Lines lines;

 private:
  bool wait(int processOrNone, Clock::time_point deadline);
  std::string_view read(Descriptor& from);

  pid_t pid = -1;
  Descriptor process{}, output{}, errors{};
  std::array<char, 1 << 16> buffer{};  // as much as a pipe holds
};

void Child::start(const std::filesystem::path& executable, const ProcessOptions& options) {
  std::vector<std::string> arguments = options.arguments;
  arguments.insert(arguments.begin(), executable.string());
  std::vector<std::string> environment = environmentWith(options.environment);
  const std::vector<char*> argv = pointersTo(arguments), envp = pointersTo(environment);
  Descriptor input(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!input.open()) fail("/dev/null");
  input = aboveStandard(std::move(input));
  Pipe out, err, report;

  pid = launchChild({executable.c_str(), argv.data(), envp.data(), input.get(), out.writing.get(),
                     err.writing.get(), report.writing.get(), getpid(),
                     dataLimit(options.memoryBytes)});
  for (Pipe* pipe : {&out, &err, &report}) pipe->writing.close();
  Refusal refusal;  // exec closes the pipe: then there is nothing to read
  while (::read(report.reading.get(), &refusal, sizeof refusal) < 0 && errno == EINTR) continue;
  // Not pidfd_open: the header of glibc 2.36 declares it with C++ linkage.
  process = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
  if (!process.open()) fail("pidfd_open");
  if (refusal.call != nullptr)
    fail(fmt::format("cannot start {}: {}", executable.string(), refusal.call), refusal.error);
  output = std::move(out.reading);
  errors = std::move(err.reading);
}

Child::~Child() {
  if (pid < 0) return;
  signal(SIGKILL);
  pollfd end{process.get(), POLLIN, 0};
  const auto patience = static_cast<int>(std::chrono::milliseconds(kGiveUp).count());
  while (process.open() && poll(&end, 1, patience) < 0 && errno == EINTR) continue;
  waitpid(pid, nullptr, process.open() ? WNOHANG : 0);
}

/// Reads what has come; at the end of the stream nothing, and closes it.
std::string_view Child::read(Descriptor& from) {
  const ssize_t n = ::read(from.get(), buffer.data(), buffer.size());
  if (n > 0) return {buffer.data(), static_cast<std::size_t>(n)};
  if (n == 0 || errno != EINTR) from.close();
  return {};
}

/// Waits once for a stream or the end of the process (-1: not for that), and reads. Whether the
/// process has ended.
bool Child::wait(int processOrNone, Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
  std::array<pollfd, 3> ready{{{processOrNone, POLLIN, 0},
                               {output.get(), POLLIN, 0},  // poll passes over closed ones: -1
                               {errors.get(), POLLIN, 0}}};
  using Left = decltype(left);
  const int n = poll(ready.data(), ready.size(),
                     static_cast<int>(std::clamp<Left>(left, Left{0}, Left{INT_MAX})));
  if (n < 0 && errno != EINTR) fail("poll");
  if (n <= 0) return false;
  if (ready[2].revents != 0) errorText.append(read(errors));
  if (ready[1].revents != 0) {
    const std::string_view text = read(output);
    outputText.append(text);
    lines.append(text);
  }
  return ready[0].revents != 0;
}

/// Whether the child has ended before the deadline, which may move with what the child says.
bool Child::readUntilEnd(const std::function<Clock::time_point()>& deadline) {
  while (!wait(process.get(), deadline()))
    if (Clock::now() >= deadline()) return false;
  return true;
}

/// What the pipes still hold. Whoever left the group may keep them open, hence the deadline.
void Child::readRest(Clock::time_point deadline) {
  while ((output.open() || errors.open()) && Clock::now() < deadline) wait(-1, deadline);
  lines.finish();
}

/// False if the child has not ended: then it is left to the system.
bool Child::reap(siginfo_t& info) {
  info = {};
  if (waitid(P_PIDFD, static_cast<id_t>(process.get()), &info, WEXITED | WNOHANG) != 0)
    fail("waitid");
  pid = -1;
  return info.si_pid != 0;
}

std::string describeSignal(int number) {
  const char* name = sigdescr_np(number);
  return name == nullptr ? std::to_string(number) : fmt::format("{} ({})", number, name);
}

}  // namespace

ProcessResult runProcess(const std::filesystem::path& executable, const ProcessOptions& options) {
  using End = ProcessResult::End;
  const Clock::time_point start = Clock::now();
  Child child(options);
  child.start(executable, options);

  const auto at = [](Clock::time_point deadline) { return [deadline] { return deadline; }; };
  const bool timedOut =
      !child.readUntilEnd(options.until ? options.until : at(start + options.limit));
  if (timedOut) {
    child.signal(SIGTERM);
    child.signal(SIGCONT);  // a stopped process would not see the other
    if (!child.readUntilEnd(at(Clock::now() + kGrace))) {
      child.signal(SIGKILL);
      child.readUntilEnd(at(Clock::now() + kGiveUp));
    }
  }
  ProcessResult result;
  result.limit = options.limit;
  result.seconds = Clock::now() - start;
  child.signal(SIGKILL);  // whom it left behind, while its number still is the group's
  child.readRest(Clock::now() + kDrain);
  result.output = child.outputText.text();
  result.errors = child.errorText.text();

  siginfo_t info;
  const bool reaped = child.reap(info);
  if (timedOut) {
    result.end = End::kTimedOut;
    result.status = reaped ? 0 : -1;
  } else {
    result.end = info.si_code == CLD_EXITED ? End::kExited : End::kSignalled;
    result.status = info.si_status;
  }
  return result;
}

std::string ProcessResult::inWords() const {
  switch (end) {
    case End::kExited:
      return fmt::format("exited with status {}", status);
    case End::kSignalled:
      return "was killed by signal " + describeSignal(status);
    case End::kTimedOut:
      break;
  }
  return fmt::format("did not end within {:g} s and {}",
                     std::chrono::duration<double>(limit).count(),
                     status == 0 ? "was stopped" : "could not be stopped");
}

std::filesystem::path thisExecutable() { return std::filesystem::read_symlink("/proc/self/exe"); }

}  // namespace gnomon
