#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "harness/cli/commands.h"
#include "harness/error.h"

namespace gnomon {

int test(const std::vector<std::string>& arguments) {
  const std::filesystem::path build = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  if (!std::filesystem::exists(build / "CTestTestfile.cmake"))
    throw UsageError(
        fmt::format("{} is not a build folder, so there are no tests to run; use ./gnomon test",
                    build.string()));
  // One after another: each uses every core itself.
  std::vector<std::string> words = {"ctest", "--test-dir", build.string(), "--output-on-failure"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  execvp("ctest", argv.data());
  throw UsageError(
      fmt::format("ctest: {}; it comes with Debian's package cmake", std::strerror(errno)));
}

}  // namespace gnomon
