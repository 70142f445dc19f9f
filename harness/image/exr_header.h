// The headers of an OpenEXR file, walked over without believing them.
#pragma once

#include <cstdint>
#include <filesystem>

namespace gnomon {

/// Throws UsageError unless every attribute of every header lies within the file and has the size
/// of its type. To be called before OpenEXR's library opens the file: it resizes to what an
/// attribute claims, up to 2 GiB, before it reads that, and reads known types without a look at
/// their size, so a damaged size makes it take pixels for attributes. Returns the file's size in
/// bytes.
std::uint64_t checkExrHeaders(const std::filesystem::path& file);

}  // namespace gnomon
