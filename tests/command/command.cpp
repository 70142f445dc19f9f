#include "tests/command/command.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>
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

Scratch::Scratch() {
  std::string name = (std::filesystem::temp_directory_path() / "gnomon_XXXXXX").string();
  folder = mkdtemp(name.data());
}

Scratch::~Scratch() {
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
}

std::filesystem::path Scratch::file(const std::string& name, const std::string& text) const {
  const std::filesystem::path path = folder / name;
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

}  // namespace gnomon
