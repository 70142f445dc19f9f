// Where Gnomon keeps what it can find out again.
#pragma once

#include <filesystem>

namespace gnomon {

/// $XDG_CACHE_HOME/gnomon, else ~/.cache/gnomon; empty where there is neither.
std::filesystem::path cacheFolder();

}  // namespace gnomon
