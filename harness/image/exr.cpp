#include "harness/image/exr.h"

#include <algorithm>
#include <bit>
#include <cmath>

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
#include "harness/image/exr_header.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

/// Lines of one chunk of a scan line part, at most: DWAB's.
constexpr std::int64_t kLinesPerChunk = 256;

/// Pixels of a tile that may be larger than its image: writers do not fit tiles to small images.
constexpr std::int64_t kTilePixels = 1024 * 1024;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw UsageError(
      fmt::format("{}: {}; give a whole OpenEXR file of flat images", file.string(), why));
}

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

/// How much a compression can shrink at most. Deflate ends at 1032:1 (zlib manual, "Maximum
/// compression factor"), which PXR24 applies to 3 of 4 bytes; run lengths (64:1), PIZ's Huffman
/// code (255 samples in some 10 bits) and B44 (32 bytes in 3) stay below. DWA deflates run lengths.
std::uint64_t largestRatio(Imf::Compression compression) {
  const bool dwa = compression == Imf::DWAA_COMPRESSION || compression == Imf::DWAB_COMPRESSION;
  return dwa ? 64 * 1032 : 1032 * 4 / 3;
}

/// Pixels of the largest piece that the library unpacks at once: it allocates them before it reads.
std::int64_t chunkPixels(const Imf::Header& header, const fs::path& file, std::int64_t width,
                         std::int64_t height) {
  if (!header.hasTileDescription()) return width * kLinesPerChunk;
  const Imf::TileDescription& tile = header.tileDescription();
  checkSize(tile.xSize, tile.ySize, 1, file.string() + ": a tile");
  const std::int64_t pixels = std::int64_t{tile.xSize} * tile.ySize;
  if (pixels > std::max(width * height, kTilePixels))
    refuse(file, fmt::format("tiles of {} x {} for an image of {} x {} (damaged)", tile.xSize,
                             tile.ySize, width, height));
  return std::max(pixels, width * tile.ySize);
}

/// Throws UsageError where the image, or one chunk of it, is larger than the limit or than a file
/// of that many bytes can hold.
void checkClaims(const Imf::Header& header, const fs::path& file, std::uint64_t fileSize,
                 std::size_t channels) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  checkSize(width, height, channels, file.string());
  // Two bytes: the narrowest sample, a half.
  const std::uint64_t bytes = static_cast<std::uint64_t>(width * height) * channels * 2;
  if (bytes / largestRatio(header.compression()) > fileSize)
    refuse(file, fmt::format("{} x {} pixels of {} channels cannot be in {} bytes", width, height,
                             channels, fileSize));
  checkSize(chunkPixels(header, file, width, height), 1, channels, file.string() + ": a chunk");
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
  const std::uint64_t fileSize = checkExrHeaders(file);
  try {
    return readPart(file, part, fileSize);
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
