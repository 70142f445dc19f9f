// OpenEXR files, in and out. Hostile files end in UsageError: what a header claims is checked
// against the file's own size before anything is allocated for it.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "harness/image/image.h"

namespace gnomon {

/// One part of a file: level 0 where it is tiled. The data window decides which pixels there are;
/// the display window is not looked at.
struct ExrPart {
  Image image{};       ///< channels as the file names and sorts them ("B", "G", "R", "diffuse.B")
  Pixel origin{};      ///< top left of the data window
  std::string name{};  ///< empty in a file of a single part
  std::map<std::string, std::string> attributes{};  ///< those of type string
};

/// Reads the part of that name, or the first. Half and float arrive unchanged; an unsigned integer
/// above 2^24 that a float cannot hold is refused, never rounded. Throws UsageError with file,
/// cause and remedy.
ExrPart readExr(const std::filesystem::path& file, const std::string& part = {});

enum class ExrType { kHalf, kFloat };

struct ExrOptions {
  ExrType type = ExrType::kHalf;
  Pixel origin{};  ///< top left of the data window; the display window is the same
  std::map<std::string, std::string> attributes{};
};

/// Writes scan lines with ZIP compression. Throws UsageError where the file cannot be written, and
/// where a finite value would become infinite as a half.
void writeExr(const std::filesystem::path& file, const Image& image,
              const ExrOptions& options = {});

}  // namespace gnomon
