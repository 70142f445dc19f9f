#include <cstdlib>

#include <fmt/format.h>

#include "harness/cli/commands.h"
#include "harness/error.h"

namespace gnomon {

std::filesystem::path sourceRoot() {
  namespace fs = std::filesystem;
  const auto holds = [](const fs::path& folder) {
    return fs::exists(folder / "tests/policy.json");
  };
  if (const char* given = std::getenv("GNOMON_ROOT")) {
    if (holds(given)) return given;
    throw UsageError(fmt::format("GNOMON_ROOT is {}, which holds no tests/policy.json", given));
  }
  if (holds(GNOMON_SOURCE_DIR)) return GNOMON_SOURCE_DIR;
  const fs::path command = fs::read_symlink("/proc/self/exe");
  for (fs::path folder = command.parent_path(); folder != folder.root_path();
       folder = folder.parent_path())
    if (holds(folder)) return folder;
  throw UsageError(
      "the source tree (kernels/, tests/policy.json) is not where it was built from; "
      "set GNOMON_ROOT to it");
}

}  // namespace gnomon
