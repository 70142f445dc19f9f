#include "harness/image/exr.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include "harness/error.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "give a whole OpenEXR file of flat images";

/// The most that OpenEXR's compressions shrink: DWA runs an 64:1 run-length code through zlib,
/// which ends at 1032:1 (zlib manual, "Maximum compression factor"). So a file of n bytes cannot
/// hold more than n times this, and a header that claims more lies.
constexpr std::uint64_t kMaxRatio = 64 * 1032;

/// Lines or columns that one chunk of a scan line part can have: DWAB's 256.
constexpr std::int64_t kLinesPerChunk = 256;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw UsageError(fmt::format("{}: {}; {}", file.string(), why, kRemedy));
}

/// The file's size, after the things that opening it would not tell apart.
std::uint64_t checkFile(const fs::path& file) {
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

/// Walks over the headers (OpenEXR, "OpenEXR File Layout") before the library reads them: it
/// resizes strings to an attribute's claimed size, up to 2 GiB, before it reads their bytes.
class HeaderWalk {
 public:
  explicit HeaderWalk(const fs::path& f) : file(f), size(checkFile(f)), in(f, std::ios::binary) {
    if (!in)
      throw UsageError(fmt::format("{}: cannot be read ({}); check its permissions", file.string(),
                                   std::strerror(errno)));
  }

  /// Throws UsageError unless every attribute of every header lies within the file.
  void check() {
    if (integer() != kMagic) refuse(file, "not an OpenEXR file (wrong magic number)");
    const std::uint32_t version = integer();
    if ((version & kVersionMask) > 2)
      refuse(file, fmt::format("OpenEXR file version {} is unknown", version & kVersionMask));
    const bool multiPart = (version & kMultiPart) != 0;
    while (attributes() && multiPart) {
    }
  }

  std::uint64_t fileSize() const { return size; }

 private:
  static constexpr std::uint32_t kMagic = 20000630, kVersionMask = 0xff, kMultiPart = 0x1000;

  /// Walks one header; false for the empty one that ends a file of several parts.
  bool attributes() {
    bool any = false;
    while (!text().empty()) {
      any = true;
      text();  // the type
      const std::uint64_t bytes = integer();
      const std::uint64_t here = static_cast<std::uint64_t>(in.tellg());
      if (bytes > size - std::min(here, size))
        refuse(file, "an attribute of the header is longer than the file (damaged or cut off)");
      in.seekg(static_cast<std::streamoff>(here + bytes));
    }
    return any;
  }

  int byte() {
    const int c = in.get();
    if (!in) refuse(file, "the file ends within its header (cut off)");
    return c;
  }

  std::uint32_t integer() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 8)
      value |= static_cast<std::uint32_t>(byte()) << shift;
    return value;
  }

  /// A null-terminated name; 255 characters at most.
  std::string text() {
    std::string name;
    for (int c = byte(); c != 0; c = byte()) {
      if (name.size() == 255) refuse(file, "a name in the header is longer than 255 characters");
      name += static_cast<char>(c);
    }
    return name;
  }

  fs::path file;
  std::uint64_t size;
  std::ifstream in;
};

/// The index of the part that is asked for.
int partNamed(const Imf::MultiPartInputFile& input, const fs::path& file, const std::string& part) {
  if (part.empty()) return 0;
  std::vector<std::string> names;
  for (int i = 0; i < input.parts(); ++i) {
    names.push_back(input.header(i).hasName() ? input.header(i).name() : "");
    if (names.back() == part) return i;
  }
  throw UsageError(fmt::format("{}: no part is called '{}'; it has '{}'", file.string(), part,
                               fmt::join(names, "', '")));
}

std::vector<std::string> channelsOf(const Imf::Header& header, const fs::path& file) {
  std::vector<std::string> names;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
      throw UsageError(
          fmt::format("{}: channel {} is stored at every {} x {} pixels only; write it "
                      "at every pixel, as R, G and B",
                      file.string(), c.name(), c.channel().xSampling, c.channel().ySampling));
    names.emplace_back(c.name());
  }
  return names;
}

/// Throws UsageError where the image, or one chunk of it, is larger than the limit or than a file
/// of that many bytes can hold.
void checkClaims(const Imf::Header& header, const fs::path& file, std::uint64_t fileSize,
                 std::size_t channels) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  checkSize(width, height, channels, file.string());
  std::int64_t chunkWidth = width, chunkHeight = std::min(height, kLinesPerChunk);
  if (header.hasTileDescription()) {
    chunkWidth = header.tileDescription().xSize;
    chunkHeight = header.tileDescription().ySize;
    checkSize(chunkWidth, chunkHeight, channels, file.string() + ": a tile");
  }
  const std::int64_t pixels = std::max(width * height, chunkWidth * chunkHeight);
  // Two bytes: the narrowest sample, a half.
  if (static_cast<std::uint64_t>(pixels) * channels * 2 / kMaxRatio > fileSize)
    refuse(file, fmt::format("{} x {} pixels of {} channels cannot be in {} bytes", width, height,
                             channels, fileSize));
}

void checkFlat(const Imf::Header& header, const fs::path& file) {
  if (header.hasType() && Imf::isDeepData(header.type())) refuse(file, "holds deep data");
}

/// Unsigned integers were read as they are into the floats' memory; makes them numbers.
void convertIntegers(std::span<float> plane, const fs::path& file, const std::string& channel) {
  for (float& sample : plane) {
    const auto value = std::bit_cast<std::uint32_t>(sample);
    sample = static_cast<float>(value);
    if (static_cast<double>(sample) != static_cast<double>(value))
      throw UsageError(
          fmt::format("{}: channel {} holds {}, which a float cannot hold; store it in "
                      "two channels of 16 bits",
                      file.string(), channel, value));
  }
}

void readPixels(Imf::MultiPartInputFile& input, int index, const fs::path& file, Image& image) {
  const Imf::Header& header = input.header(index);
  const Imath::Box2i& window = header.dataWindow();
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const bool integers = header.channels()[image.channels[c]].type == Imf::UINT;
    buffer.insert(image.channels[c], Imf::Slice::Make(integers ? Imf::UINT : Imf::FLOAT,
                                                      image.plane(c).data(), window));
  }
  Imf::InputPart part(input, index);
  part.setFrameBuffer(buffer);
  part.readPixels(window.min.y, window.max.y);
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    if (header.channels()[image.channels[c]].type == Imf::UINT)
      convertIntegers(image.plane(c), file, image.channels[c]);
}

std::map<std::string, std::string> stringsOf(const Imf::Header& header) {
  std::map<std::string, std::string> strings;
  for (auto a = header.begin(); a != header.end(); ++a)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
      strings[a.name()] = text->value();
  return strings;
}

ExrPart readPart(const fs::path& file, const std::string& name, std::uint64_t fileSize) {
  // No threads of its own, and an incomplete table of chunks is an error, not to be guessed.
  Imf::MultiPartInputFile input(file.c_str(), /*numThreads=*/0, /*reconstruct=*/false);
  const int index = partNamed(input, file, name);
  const Imf::Header& header = input.header(index);
  checkFlat(header, file);
  const std::vector<std::string> channels = channelsOf(header, file);
  checkClaims(header, file, fileSize, channels.size());
  const Imath::Box2i& window = header.dataWindow();
  ExrPart part{.image = makeImage(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1,
                                  channels),
               .origin = {window.min.x, window.min.y},
               .name = header.hasName() ? header.name() : "",
               .attributes = stringsOf(header)};
  readPixels(input, index, file, part.image);
  return part;
}

/// Conversion to half rounds what is above 65504 up to infinity without a word.
void checkHalf(const fs::path& file, const Image& image) {
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    for (const float v : image.plane(c))
      if (std::isfinite(v) && !Imath::half(v).isFinite())
        throw UsageError(
            fmt::format("{}: channel {} holds {}, above the largest half (65504); "
                        "write float",
                        file.string(), image.channels[c], v));
}

Imf::Header headerFor(const Image& image, const ExrOptions& options) {
  const Imath::Box2i window(
      {options.origin.x, options.origin.y},
      {options.origin.x + image.width - 1, options.origin.y + image.height - 1});
  Imf::Header header(window, window);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const std::string& channel : image.channels)
    header.channels().insert(channel,
                             Imf::Channel(options.type == ExrType::kHalf ? Imf::HALF : Imf::FLOAT));
  for (const auto& [name, text] : options.attributes)
    header.insert(name, Imf::StringAttribute(text));
  return header;
}

void writePixels(const fs::path& file, const Image& image, const ExrOptions& options) {
  const Imf::Header header = headerFor(image, options);
  const bool half = options.type == ExrType::kHalf;
  std::vector<Imath::half> halves(half ? image.data.size() : 0);
  std::ranges::transform(std::span(image.data).first(halves.size()), halves.begin(),
                         [](float v) { return Imath::half(v); });
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const void* plane = half ? static_cast<const void*>(&halves[c * image.pixels()])
                             : static_cast<const void*>(image.plane(c).data());
    buffer.insert(image.channels[c],
                  Imf::Slice::Make(half ? Imf::HALF : Imf::FLOAT, plane, header.dataWindow()));
  }
  Imf::OutputFile output(file.c_str(), header, /*numThreads=*/0);
  output.setFrameBuffer(buffer);
  output.writePixels(image.height);
}

}  // namespace

ExrPart readExr(const fs::path& file, const std::string& part) {
  HeaderWalk walk(file);
  walk.check();
  try {
    return readPart(file, part, walk.fileSize());
  } catch (const UsageError&) {
    throw;
  } catch (const std::exception& error) {  // Iex::BaseExc, and what its decoders let through
    refuse(file, error.what());
  }
}

void writeExr(const fs::path& file, const Image& image, const ExrOptions& options) {
  checkSize(image.width, image.height, image.channels.size(), file.string());
  if (options.type == ExrType::kHalf) checkHalf(file, image);
  try {
    writePixels(file, image, options);
  } catch (const std::exception& error) {
    throw UsageError(fmt::format("{}: cannot be written ({}); check the path and the space left",
                                 file.string(), error.what()));
  }
}

}  // namespace gnomon
