#include "harness/image/exr_header.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw UsageError(
      fmt::format("{}: {}; give a whole OpenEXR file of flat images", file.string(), why));
}

/// The file's size, after the things that opening it would not tell apart.
std::uint64_t sizeOf(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status))
    throw UsageError(fmt::format("{}: no such file; check the path", file.string()));
  // A pipe would block, and OpenEXR has to seek.
  if (!fs::is_regular_file(status)) refuse(file, "not a regular file");
  const std::uint64_t size = fs::file_size(file, error);
  if (error) throw UsageError(fmt::format("{}: {}", file.string(), error.message()));
  if (size == 0) refuse(file, "the file is empty");
  return size;
}

struct FixedType {
  std::string_view name;
  std::uint32_t bytes;
};

/// "OpenEXR File Layout", "Predefined Attribute Types": those of one size.
constexpr std::array kFixedTypes = {
    FixedType{"box2i", 16},      FixedType{"box2f", 16},   FixedType{"chromaticities", 32},
    FixedType{"compression", 1}, FixedType{"double", 8},   FixedType{"envmap", 1},
    FixedType{"float", 4},       FixedType{"int", 4},      FixedType{"keycode", 28},
    FixedType{"lineOrder", 1},   FixedType{"m33f", 36},    FixedType{"m33d", 72},
    FixedType{"m44f", 64},       FixedType{"m44d", 128},   FixedType{"rational", 8},
    FixedType{"tiledesc", 9},    FixedType{"timecode", 8}, FixedType{"v2i", 8},
    FixedType{"v2f", 8},         FixedType{"v2d", 16},     FixedType{"v3i", 12},
    FixedType{"v3f", 12},        FixedType{"v3d", 24},     FixedType{"deepImageState", 1}};

class HeaderWalk {
 public:
  HeaderWalk(const fs::path& f, std::uint64_t bytes)
      : file(f), size(bytes), in(f, std::ios::binary) {
    if (!in)
      throw UsageError(fmt::format("{}: cannot be read ({}); check its permissions", file.string(),
                                   std::strerror(errno)));
  }

  void check() {
    constexpr std::uint32_t kMagic = 20000630, kMultiPart = 0x1000;
    if (integer() != kMagic) refuse(file, "not an OpenEXR file (wrong magic number)");
    const bool multiPart = (integer() & kMultiPart) != 0;
    while (header() && multiPart) {
    }
  }

 private:
  /// Walks one header; false for the empty one that ends a file of several parts.
  bool header() {
    bool any = false;
    for (std::string name = text(); !name.empty(); name = text()) {
      any = true;
      const std::string type = text();
      const std::uint32_t bytes = integer();
      if (bytes > size - at)
        refuse(file,
               fmt::format("attribute '{}' of {} bytes is longer than the file", name, bytes));
      const std::uint64_t end = at + bytes;
      if (!valueFits(type, bytes, end))
        refuse(file,
               fmt::format("attribute '{}' of type {} cannot have {} bytes", name, type, bytes));
      skipTo(end);
    }
    return any;
  }

  /// Whether a value of that type, which starts here, can end there.
  bool valueFits(const std::string& type, std::uint32_t bytes, std::uint64_t end) {
    if (type == "chlist") return channelsEndAt(end);
    if (type == "stringvector") return stringsEndAt(end);
    if (type == "preview") return bytes >= 8 && previewBytes() == bytes;
    // An unpacked size, then what deflate packed, at most 1032:1 (zlib manual).
    if (type == "idmanifest") return bytes >= 4 && integer() / 1032 <= bytes;
    const auto fixed = std::ranges::find(kFixedTypes, type, &FixedType::name);
    return fixed == kFixedTypes.end() || fixed->bytes == bytes;
  }

  bool channelsEndAt(std::uint64_t end) {
    constexpr std::uint64_t kAfterName = 16;  // pixel type, linearity, two sampling rates
    while (at < end) {
      if (text().empty()) return at == end;
      skipTo(at + kAfterName);
    }
    return false;  // the list's own end is missing
  }

  bool stringsEndAt(std::uint64_t end) {
    while (at + 4 <= end) {
      const std::uint32_t bytes = integer();
      if (bytes > end - at) return false;
      skipTo(at + bytes);
    }
    return at == end;
  }

  std::uint64_t previewBytes() {
    const std::uint64_t width = integer(), height = integer();
    if (width > size || height > size) return 0;
    return 8 + 4 * width * height;
  }

  void skipTo(std::uint64_t position) {
    at = position;
    in.seekg(static_cast<std::streamoff>(at));
  }

  std::uint32_t byte() {
    const int c = in.get();
    if (!in) refuse(file, "the file ends within its header (cut off)");
    at += 1;
    return static_cast<std::uint32_t>(c);
  }

  /// Little-endian.
  std::uint32_t integer() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 8) value |= byte() << shift;
    return value;
  }

  /// A null-terminated name; 255 characters at most.
  std::string text() {
    std::string name;
    for (std::uint32_t c = byte(); c != 0; c = byte()) {
      if (name.size() == 255) refuse(file, "a name in the header is longer than 255 characters");
      name += static_cast<char>(c);
    }
    return name;
  }

  fs::path file;
  std::uint64_t size, at = 0;
  std::ifstream in;
};

}  // namespace

std::uint64_t checkExrHeaders(const fs::path& file) {
  const std::uint64_t size = sizeOf(file);
  HeaderWalk(file, size).check();
  return size;
}

}  // namespace gnomon
