#include "harness/cache.h"

#include <cstdlib>

namespace gnomon {

std::filesystem::path cacheFolder() {
  namespace fs = std::filesystem;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return fs::path(cache) / "gnomon";
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache/gnomon";
  return {};
}

}  // namespace gnomon
