#include "tests/command/command.h"

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <memory>

namespace gnomon {

Said gnomonSays(const std::string& arguments, const std::string& streams) {
  static const Scratch cache;
  setenv("XDG_CACHE_HOME", cache.path().c_str(), 1);
  const std::string line =
      std::string(GNOMON_COMMAND) + " " + arguments + " " + streams + " </dev/null";
  Said said;
  std::FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) return said;
  std::array<char, 4096> buffer;
  while (std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
    said.output.append(buffer.data(), n);
  const int status = pclose(pipe);
  said.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return said;
}

}  // namespace gnomon
