// Child processes: how they end is told right, they end in time whatever they do, nothing of them
// stays behind, what they say is bounded, and nothing of ours reaches them that was not meant to.
// Not covered: a child that survives SIGKILL because it hangs in the kernel.
#include "harness/isolate/process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace gnomon {

void PrintTo(const ProcessResult& result, std::ostream* out) {
  *out << result.inWords() << ", said '" << result.output.substr(0, 200) << "' and '"
       << result.errors.substr(0, 200) << "'";
}

namespace {

using End = ProcessResult::End;
using namespace std::chrono_literals;

/// No test measures speed: this only tells an end from a wait for a child that sleeps a minute.
constexpr auto kSoon = 20s;

ProcessResult shell(const std::string& script, ProcessOptions options = {}) {
  options.arguments = {"-c", script};
  return runProcess("/bin/sh", options);
}

ProcessOptions within(std::chrono::milliseconds limit) {
  ProcessOptions options;
  options.limit = limit;
  return options;
}

/// A path that nobody uses; what is made there is removed with the object.
struct Mark {
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               fmt::format("gnomon-process-{}-{}", getpid(), rand());
  ~Mark() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

/// Nothing has that number, not even a zombie.
bool gone(pid_t pid) { return kill(pid, 0) != 0 && errno == ESRCH; }

/// Dead, though whoever inherited it may not have reaped it yet.
bool dead(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string number, name, state;
  file >> number >> name >> state;
  return gone(pid) || state == "Z" || state == "X";
}

template <class Condition>
bool comesTrue(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + kSoon;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

pid_t asPid(const std::string& text) {
  const pid_t pid = text.empty() ? 0 : std::stoi(text);
  if (pid < 2) throw std::runtime_error("not the number of a process: " + text);
  return pid;
}

TEST(Process, ExitStatusAndBothStreamsAreReported) {
  const ProcessResult result = shell("echo said; echo wrong >&2; exit 3");
  EXPECT_EQ(result.end, End::kExited);
  EXPECT_EQ(result.status, 3);
  EXPECT_FALSE(result.succeeded());
  EXPECT_EQ(result.output, "said\n");
  EXPECT_EQ(result.errors, "wrong\n");
  EXPECT_EQ(result.inWords(), "exited with status 3");
  EXPECT_TRUE(shell("exit 0").succeeded());
}

TEST(Process, ASignalIsReportedByNumberAndName) {
  const ProcessResult result = shell("kill -SEGV $$");
  EXPECT_EQ(result.end, End::kSignalled);
  EXPECT_EQ(result.status, SIGSEGV);
  EXPECT_EQ(result.inWords(), "was killed by signal 11 (Segmentation fault)");
}

TEST(Process, AMissingExecutableThrowsWithItsName) {
  try {
    runProcess("/nowhere/such-a-tool", {});
    FAIL() << "it started";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code(), std::errc::no_such_file_or_directory);
    EXPECT_NE(std::string(error.what()).find("/nowhere/such-a-tool"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(runProcess(std::filesystem::temp_directory_path(), {}), std::system_error);
}

TEST(Process, AnEndlessLoopIsStoppedAtTheLimit) {
  ProcessResult result = shell("while :; do :; done", within(300ms));
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_EQ(result.status, 0);
  EXPECT_GE(result.seconds, 300ms);
  EXPECT_LT(result.seconds, kSoon);
  EXPECT_EQ(result.inWords(), "did not end within 0.3 s and was stopped");
  result.status = -1;
  EXPECT_EQ(result.inWords(), "did not end within 0.3 s and could not be stopped");
}

TEST(Process, ADeadlineMovesWithWhatTheChildSays) {
  // Five steps of 0.5 s, each allowed 2 s from the last; then one that does not end.
  auto until = std::chrono::steady_clock::now() + 2s;
  int steps = 0;
  ProcessOptions options;
  options.limit = 1ms;  // counts for nothing
  options.onLine = [&](std::string_view) {
    until = std::chrono::steady_clock::now() + (++steps < 5 ? 2'000ms : 300ms);
  };
  options.until = [&] { return until; };
  const ProcessResult result =
      shell("for i in 1 2 3 4 5; do sleep 0.5; echo $i; done; while :; do :; done", options);
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_EQ(steps, 5);
  EXPECT_LT(result.seconds, kSoon);
}

TEST(Process, SigtermComesFirstAndLeavesTimeToCleanUp) {
  const ProcessResult result =
      shell("trap 'echo cleaned; exit 0' TERM; while :; do sleep 0.05; done", within(500ms));
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_EQ(result.output, "cleaned\n");
  EXPECT_EQ(shell("trap 'echo cleaned; exit 0' TERM; kill -STOP $$", within(500ms)).output,
            "cleaned\n");
}

TEST(Process, WhoIgnoresSigtermOrIsStoppedDiesAllTheSame) {
  for (const char* script : {"trap '' TERM; while :; do :; done", "kill -STOP $$"}) {
    const ProcessResult result = shell(script, within(300ms));
    EXPECT_EQ(result.end, End::kTimedOut) << script;
    EXPECT_EQ(result.status, 0) << script;
    EXPECT_LT(result.seconds, kSoon) << script;
  }
}

TEST(Process, AGrandchildThatHoldsThePipeDiesAtTheLimit) {
  const ProcessResult result =
      shell("(trap '' TERM; echo begun; sleep 60) & echo $!; wait", within(500ms));
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_LT(result.seconds, kSoon);
  const auto line = result.output.find_first_of("0123456789");
  ASSERT_NE(line, std::string::npos) << ::testing::PrintToString(result);
  const pid_t grandchild = asPid(result.output.substr(line));
  EXPECT_TRUE(comesTrue([&] { return dead(grandchild); }));
}

TEST(Process, AGrandchildLeftBehindDiesWithTheChild) {
  const auto start = std::chrono::steady_clock::now();
  const ProcessResult result = shell("sleep 60 & echo $!");
  EXPECT_LT(std::chrono::steady_clock::now() - start, kSoon);
  EXPECT_TRUE(result.succeeded()) << ::testing::PrintToString(result);
  const pid_t grandchild = asPid(result.output);
  EXPECT_TRUE(comesTrue([&] { return dead(grandchild); }));
}

TEST(Process, NobodyWaitsForAGrandchildThatLeftTheGroup) {
  const Mark mark;
  ProcessOptions options;
  options.environment = {{"MARK", mark.path}};
  const auto start = std::chrono::steady_clock::now();
  const ProcessResult result =
      shell("setsid sh -c ': > $MARK; exec sleep 60' & echo $!; while [ ! -e $MARK ]; do :; done",
            options);
  EXPECT_LT(std::chrono::steady_clock::now() - start, kSoon);
  EXPECT_TRUE(result.succeeded()) << ::testing::PrintToString(result);
  const pid_t grandchild = asPid(result.output);
  EXPECT_FALSE(dead(grandchild)) << "it did not leave: nothing was tested";
  kill(grandchild, SIGKILL);
}

TEST(Process, NoZombieStays) {
  EXPECT_TRUE(gone(asPid(shell("echo $$").output)));
  EXPECT_TRUE(gone(asPid(shell("echo $$; kill -KILL $$").output)));
  EXPECT_TRUE(gone(asPid(shell("echo $$; exec sleep 60", within(300ms)).output)));
}

TEST(Process, TheChildDiesWithItsParent) {
  const Mark mark;
  const pid_t parent = fork();
  if (parent == 0) {
    ProcessOptions options;
    options.environment = {{"MARK", mark.path}};
    shell("echo $$ > $MARK.new; mv $MARK.new $MARK; exec sleep 60", options);
    _exit(0);
  }
  ASSERT_TRUE(comesTrue([&] { return std::filesystem::exists(mark.path); }));
  std::string number;
  std::ifstream(mark.path) >> number;
  const pid_t child = asPid(number);
  EXPECT_FALSE(dead(child));
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  EXPECT_TRUE(comesTrue([&] { return dead(child); }));
}

TEST(Process, AFloodOnBothStreamsIsCutInTheMiddle) {
  ProcessOptions options;
  options.maxOutputBytes = 1000;
  const ProcessResult result = shell(
      "flood() { head -c 1048576 /dev/zero | tr '\\0' x; }\n"
      "echo begin; flood; echo end; (echo begin; flood; echo end) >&2",
      options);
  EXPECT_TRUE(result.succeeded()) << ::testing::PrintToString(result);
  for (const std::string& text : {result.output, result.errors}) {
    EXPECT_LT(text.size(), 1100u);  // the note is some 30 bytes
    EXPECT_TRUE(text.starts_with("begin\nx")) << text.substr(0, 20);
    EXPECT_TRUE(text.ends_with("xend\n")) << text.substr(text.size() - 20);
    // "begin", "end", two newlines and a mebibyte, less the thousand bytes kept
    EXPECT_NE(text.find("\n[... 1047586 bytes cut ...]\n"), std::string::npos) << text;
  }
}

TEST(Process, AFloodTakesNoMemory) {
  const auto peakMebibytes = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
  };
  const auto before = peakMebibytes();
  std::size_t bytes = 0;
  ProcessOptions options;
  options.onLine = [&](std::string_view line) { bytes += line.size(); };
  EXPECT_TRUE(shell("head -c 268435456 /dev/zero", options).succeeded());
  EXPECT_EQ(bytes, 268435456u);
  EXPECT_LT(peakMebibytes() - before, 64);  // a quarter of the flood
}

TEST(Process, OutputUpToTheBoundIsWhole) {
  ProcessOptions options;
  options.maxOutputBytes = 10;
  EXPECT_EQ(shell("printf 0123456789", options).output, "0123456789");
  EXPECT_EQ(shell("printf 0123456789a", options).output, "01234\n[... 1 bytes cut ...]\n6789a");
}

TEST(Process, EndlessOutputEndsAtTheLimit) {
  const ProcessResult result = shell("while :; do echo on and on; done", within(500ms));
  EXPECT_EQ(result.end, End::kTimedOut);
  EXPECT_LT(result.seconds, kSoon);
  EXPECT_LT(result.output.size(), ProcessOptions{}.maxOutputBytes + 100);
}

TEST(Process, LinesArriveWhileTheChildRuns) {
  const Mark mark;
  std::vector<std::string> lines;
  ProcessOptions options = within(kSoon);
  options.environment = {{"MARK", mark.path}};
  options.onLine = [&](std::string_view line) {
    lines.emplace_back(line);
    if (line == "ready") std::ofstream(mark.path) << "go on";
  };
  const ProcessResult result = shell(
      "echo ready; while [ ! -e $MARK ]; do sleep 0.01; done; printf '\\nhalf '; printf 'a line'",
      options);
  EXPECT_TRUE(result.succeeded()) << ::testing::PrintToString(result);
  EXPECT_EQ(lines, (std::vector<std::string>{"ready", "", "half a line"}));
}

TEST(Process, ALineWithoutEndComesInPieces) {
  std::vector<std::size_t> sizes;
  ProcessOptions options;
  options.maxOutputBytes = 1000;
  options.onLine = [&](std::string_view line) { sizes.push_back(line.size()); };
  EXPECT_TRUE(shell("head -c 2500 /dev/zero", options).succeeded());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1000, 1000, 500}));
}

TEST(Process, WhatOnLineThrowsStopsTheChildAndArrives) {
  pid_t child = 0;
  ProcessOptions options;
  options.onLine = [&](std::string_view line) {
    child = asPid(std::string(line));
    throw std::domain_error("enough");
  };
  EXPECT_THROW(shell("echo $$; exec sleep 60", options), std::domain_error);
  EXPECT_TRUE(gone(child));
}

TEST(Process, TheEnvironmentIsOursWithTheAddedOnTop) {
  setenv("GNOMON_PROCESS_KEPT", "kept", 1);
  setenv("GNOMON_PROCESS_CHANGED", "before", 1);
  ProcessOptions options;
  options.environment = {{"GNOMON_PROCESS_CHANGED", "after"}, {"GNOMON_PROCESS_NEW", "a = b"}};
  EXPECT_EQ(
      shell("tr '\\0' '\\n' < /proc/$$/environ | grep ^GNOMON_PROCESS_ | sort", options).output,
      "GNOMON_PROCESS_CHANGED=after\nGNOMON_PROCESS_KEPT=kept\nGNOMON_PROCESS_NEW=a = b\n");
  EXPECT_STREQ(getenv("GNOMON_PROCESS_CHANGED"), "before");
  unsetenv("GNOMON_PROCESS_KEPT");
  unsetenv("GNOMON_PROCESS_CHANGED");
}

TEST(Process, AnAllocationPastTheMemoryLimitFails) {
  // A string of 2^26 bytes, doubled from one.
  const char* grow = "x=a; for i in $(seq 26); do x=$x$x; done; echo grown to ${#x}";
  EXPECT_EQ(shell(grow).output, "grown to 67108864\n");
  ProcessOptions options;
  options.memoryBytes = std::uint64_t{32} << 20;
  const ProcessResult limited = shell(grow, options);
  EXPECT_FALSE(limited.succeeded());
  EXPECT_EQ(limited.output, "");
  EXPECT_TRUE(shell("echo small", options).succeeded());
}

TEST(Process, OurDescriptorsAreNotInherited) {
  const int ours = fcntl(STDERR_FILENO, F_DUPFD, 100);  // without close-on-exec
  ASSERT_GE(ours, 100);
  ProcessOptions options;
  options.environment = {{"OURS", std::to_string(ours)}};
  EXPECT_EQ(shell("[ -e /proc/self/fd/2 ] && echo two; [ -e /proc/self/fd/$OURS ] && echo ours; :",
                  options)
                .output,
            "two\n");
  close(ours);
}

TEST(Process, OtherChildrenInheritNothingOfOurs) {
  const auto inherited = [] {
    std::array<char, 1000> text{};
    std::FILE* other = popen("cd /proc/$$/fd && echo *", "r");
    if (other == nullptr || std::fgets(text.data(), text.size(), other) == nullptr) return text;
    pclose(other);
    return text;
  };
  const auto before = inherited();
  std::array<char, 1000> during{};
  ProcessOptions options;
  options.onLine = [&](std::string_view) { during = inherited(); };
  EXPECT_TRUE(shell("echo now; sleep 0.05", options).succeeded());
  EXPECT_STREQ(before.data(), during.data());
}

TEST(Process, StandardInputIsEmpty) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  ASSERT_EQ(write(ends[1], "ours\n", 5), 5);
  const int before = dup(STDIN_FILENO);
  dup2(ends[0], STDIN_FILENO);
  EXPECT_EQ(shell("cat; echo end of input", within(1s)).output, "end of input\n");
  dup2(before, STDIN_FILENO);
  for (const int number : {before, ends[0], ends[1]}) close(number);
}

TEST(Process, SignalsAreThoseOfAFreshProcess) {
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGUSR1);
  pthread_sigmask(SIG_BLOCK, &blocked, &before);
  const auto handler = std::signal(SIGPIPE, SIG_IGN);
  EXPECT_EQ(shell("kill -PIPE $$").status, SIGPIPE);
  EXPECT_EQ(shell("kill -USR1 $$").status, SIGUSR1);
  std::signal(SIGPIPE, handler);
  sigset_t after;
  pthread_sigmask(SIG_SETMASK, &before, &after);
  EXPECT_EQ(sigismember(&after, SIGUSR1), 1) << "the mask of the caller has changed";
  EXPECT_EQ(sigismember(&after, SIGUSR2), 0) << "the mask of the caller has changed";
}

TEST(Process, ACrashLeavesNoCoreDump) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_CORE, &before), 0);
  const rlimit allowed{before.rlim_max, before.rlim_max};
  setrlimit(RLIMIT_CORE, &allowed);
  EXPECT_EQ(shell("ulimit -c").output, "0\n");
  setrlimit(RLIMIT_CORE, &before);
}

TEST(Process, ManyRunAtOnceAndEachGetsItsOwn) {
  constexpr int kThreads = 4, kRuns = 25;
  std::array<std::string, kThreads> wrong;  // gtest's checks are for one thread
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread)
    threads.emplace_back([thread, &mine = wrong[static_cast<std::size_t>(thread)]] {
      for (int run = 0; run < kRuns; ++run) {
        const std::string tag = fmt::format("{}/{}", thread, run);
        ProcessOptions options = within(kSoon);
        options.environment = {{"TAG", tag}};
        const ProcessResult result = shell("echo $TAG; echo $TAG >&2; exit 7", options);
        if (result.output != tag + "\n" || result.errors != tag + "\n" || result.status != 7)
          mine += tag + " " + ::testing::PrintToString(result) + "\n";
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::string& text : wrong) EXPECT_EQ(text, "");
}

TEST(Process, ThisExecutableIsTheRunningOne) {
  EXPECT_TRUE(thisExecutable().is_absolute());
  EXPECT_TRUE(std::filesystem::equivalent(thisExecutable(), "/proc/self/exe"));
}

}  // namespace
}  // namespace gnomon
