// OpenEXR files: what is written is what is read, and no file brings the reader down.
//
// Covered: half, float and unsigned integer channels; every compression, scan lines and tiles (with
// mip levels and rip levels); parts by name; layers; a data window that is not the display window;
// string attributes; files that are not images, are damaged, or claim what they cannot hold; 2,500
// mutated files. Not covered: damage that the decoders themselves notice only as wrong pixels.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTiledOutputFile.h>

#include "harness/error.h"
#include "harness/image/exr.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;

/// A folder that goes away with the test.
class ExrTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }

  fs::path file(const std::string& name) const { return folder / name; }

  fs::path folder = fs::temp_directory_path() / fmt::format("gnomon_exr_{}", getpid());
};
using Exr = ExrTest;
using HostileExr = ExrTest;

/// Multiples of 1/16 up to 64: halves hold them exactly, and no two neighbours are equal.
Image ramp(int width, int height, const std::vector<std::string>& channels) {
  Image image = makeImage(width, height, channels);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>(i * 37 % 1024) / 16;
  return image;
}

Imf::Header headerOf(const Image& image, Imf::PixelType type, Pixel origin = {}) {
  const Imath::Box2i data({origin.x, origin.y},
                          {origin.x + image.width - 1, origin.y + image.height - 1});
  Imf::Header header(Imath::Box2i({0, 0}, {99, 49}), data);
  for (const std::string& c : image.channels) header.channels().insert(c, Imf::Channel(type));
  return header;
}

/// Conversion to halves is the library's, from these floats; integers need a buffer of their own.
Imf::FrameBuffer bufferOf(const Image& image, const Imath::Box2i& window) {
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    buffer.insert(image.channels[c], Imf::Slice::Make(Imf::FLOAT, image.plane(c).data(), window));
  return buffer;
}

void write(const fs::path& file, const Image& image, const Imf::Header& header) {
  Image halves = image;  // the frame buffer's type has to be the file's
  std::vector<Imath::half> narrow(image.data.begin(), image.data.end());
  Imf::FrameBuffer buffer = bufferOf(image, header.dataWindow());
  if (header.channels().begin().channel().type == Imf::HALF)
    for (std::size_t c = 0; c < image.channels.size(); ++c)
      buffer.insert(image.channels[c],
                    Imf::Slice::Make(Imf::HALF, &narrow[c * image.pixels()], header.dataWindow()));
  if (!header.hasTileDescription()) {
    Imf::OutputFile out(file.c_str(), header, 0);
    out.setFrameBuffer(buffer);
    out.writePixels(image.height);
    return;
  }
  Imf::TiledOutputFile out(file.c_str(), header, 0);
  out.setFrameBuffer(buffer);
  for (int ly = 0; ly < out.numYLevels(); ++ly)
    for (int lx = 0; lx < out.numXLevels(); ++lx)
      if (out.isValidLevel(lx, ly))
        out.writeTiles(0, out.numXTiles(lx) - 1, 0, out.numYTiles(ly) - 1, lx, ly);
}

std::string bytesOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void putBytes(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// What readExr says against the file; fails the test where it says nothing.
std::string complaint(const fs::path& file, const std::string& part = {}) {
  try {
    readExr(file, part);
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << file << " was read";
  return {};
}

void expectSays(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST_F(Exr, HalfAndFloatComeBackBitForBitWithOriginAndAttributes) {
  Image image = ramp(17, 9, {"A", "B", "G", "R", "Z"});
  image.at(3, 4, 0) = std::numeric_limits<float>::infinity();
  image.at(4, 4, 1) = -0.0f;
  for (const ExrType type : {ExrType::kHalf, ExrType::kFloat}) {
    if (type == ExrType::kFloat) image.at(0, 0, 4) = 0.1f;
    writeExr(file("a.exr"), image,
             {.type = type, .origin = {-5, 7}, .attributes = {{"made", "by a test"}}});
    const ExrPart part = readExr(file("a.exr"));
    EXPECT_EQ(part.image.channels, image.channels);
    ASSERT_EQ(part.image.data.size(), image.data.size());
    EXPECT_EQ(std::memcmp(part.image.data.data(), image.data.data(), image.data.size() * 4), 0);
    EXPECT_EQ(part.origin, (Pixel{-5, 7}));
    EXPECT_EQ(part.attributes.at("made"), "by a test");
  }
}

TEST_F(Exr, NanComesBackAsNan) {
  Image image = ramp(3, 2, {"Y"});
  image.at(1, 1, 0) = std::numeric_limits<float>::quiet_NaN();
  writeExr(file("nan.exr"), image);
  EXPECT_TRUE(std::isnan(readExr(file("nan.exr")).image.at(1, 1, 0)));
}

TEST_F(Exr, EveryLosslessCompressionInLinesAndTilesIsReadExactly) {
  const Image image = ramp(37, 41, {"B", "G", "R", "diffuse.R"});
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                 Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
    for (const auto type : {Imf::HALF, Imf::FLOAT}) {
      for (int tiling = 0; tiling < 4; ++tiling) {
        Imf::Header header = headerOf(image, type, {3, -2});
        header.compression() = compression;
        const auto mode = static_cast<Imf::LevelMode>(std::max(0, tiling - 1));
        if (tiling > 0) header.setTileDescription({16, 8, mode, Imf::ROUND_DOWN});
        if (tiling > 0) header.setType(Imf::TILEDIMAGE);
        write(file("c.exr"), image, header);
        SCOPED_TRACE(fmt::format("compression {} type {} tiling {}", static_cast<int>(compression),
                                 static_cast<int>(type), tiling));
        const ExrPart part = readExr(file("c.exr"));
        EXPECT_EQ(part.image.data, image.data);
        EXPECT_EQ(part.origin, (Pixel{3, -2}));
      }
    }
  }
}

TEST_F(Exr, LossyCompressionsAreReadWithinTheirLoss) {
  // Smooth, as they are made for: noise may lose more.
  Image image = makeImage(64, 48, {"B", "G", "R"});
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = 1 + static_cast<float>(i % 64) / 64;
  for (const auto compression :
       {Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION,
        Imf::DWAB_COMPRESSION}) {
    Imf::Header header = headerOf(image, Imf::HALF);
    header.compression() = compression;
    write(file("l.exr"), image, header);
    const Image read = readExr(file("l.exr")).image;
    for (std::size_t i = 0; i < image.data.size(); ++i)
      ASSERT_NEAR(read.data[i], image.data[i], 0.02f) << static_cast<int>(compression);
  }
}

/// One channel of unsigned integers.
void writeIntegers(const fs::path& file, const std::vector<std::uint32_t>& ids) {
  const int width = static_cast<int>(ids.size());
  Imf::Header header(width, 1);
  header.channels().insert("id", Imf::Channel(Imf::UINT));
  Imf::FrameBuffer buffer;
  buffer.insert("id", Imf::Slice::Make(Imf::UINT, ids.data(), header.dataWindow()));
  Imf::OutputFile out(file.c_str(), header, 0);
  out.setFrameBuffer(buffer);
  out.writePixels(1);
}

TEST_F(Exr, IntegersAreExactOrRefused) {
  writeIntegers(file("id.exr"), {0, 1, 16777216, 4278190080});
  EXPECT_EQ(readExr(file("id.exr")).image.data,
            (std::vector<float>{0, 1, 16777216, 4278190080.0f}));
  writeIntegers(file("large.exr"), {1, 16777217});
  const std::string text = complaint(file("large.exr"));
  expectSays(text, "channel id holds 16777217");
}

/// A file of the parts "beauty" and "geometry".
void writeParts(const fs::path& file, const Image& first, const Image& second) {
  std::vector<Imf::Header> headers = {headerOf(first, Imf::FLOAT), headerOf(second, Imf::FLOAT)};
  headers[0].setName("beauty");
  headers[1].setName("geometry");
  for (Imf::Header& h : headers) h.setType(Imf::SCANLINEIMAGE);
  Imf::MultiPartOutputFile out(file.c_str(), headers.data(), 2);
  for (int i = 0; i < 2; ++i) {
    const Image& image = i == 0 ? first : second;
    Imf::OutputPart part(out, i);
    part.setFrameBuffer(bufferOf(image, headers[static_cast<std::size_t>(i)].dataWindow()));
    part.writePixels(image.height);
  }
}

TEST_F(Exr, PartsAreFoundByNameAndTheFirstIsTheDefault) {
  const Image first = ramp(8, 6, {"R"}), second = ramp(5, 7, {"normal.X", "normal.Y"});
  writeParts(file("m.exr"), first, second);
  EXPECT_EQ(readExr(file("m.exr")).image.data, first.data);
  EXPECT_EQ(readExr(file("m.exr"), "geometry").image.data, second.data);
  EXPECT_EQ(readExr(file("m.exr"), "geometry").name, "geometry");
  expectSays(complaint(file("m.exr"), "depth"), "'beauty', 'geometry'");
}

TEST_F(Exr, AHalfThatWouldOverflowIsRefusedAndAFloatIsWritten) {
  Image image = ramp(4, 4, {"R"});
  image.at(2, 1, 0) = 70000;
  EXPECT_THROW(writeExr(file("o.exr"), image), UsageError);
  writeExr(file("o.exr"), image, {.type = ExrType::kFloat});
  EXPECT_EQ(readExr(file("o.exr")).image.at(2, 1, 0), 70000);
}

TEST_F(Exr, WhatCannotBeWrittenIsAUsageErrorThatNamesTheFile) {
  try {
    writeExr(folder / "no such folder" / "a.exr", ramp(2, 2, {"R"}));
    FAIL();
  } catch (const UsageError& error) {
    expectSays(error.what(), "no such folder");
  }
}

TEST(Image, SizesBeyondTheLimitAreRefusedBeforeAnythingIsAllocated) {
  EXPECT_THROW(makeImage(1 << 30, 1 << 30, {"R"}), UsageError);
  EXPECT_THROW(makeImage(1 << 14, (1 << 14) + 1, {"R"}), UsageError);
  EXPECT_THROW(makeImage(0, 4, {"R"}), UsageError);
  EXPECT_THROW(makeImage(4, 4, {}), UsageError);
  EXPECT_THROW(checkSize(std::int64_t{1} << 40, std::int64_t{1} << 40, 1, "x"), UsageError);
  EXPECT_NO_THROW(checkSize(1 << 14, 1 << 14, 1, "x"));
}

TEST(Image, SamplesAreFoundByNameAndOutsideThrows) {
  Image image = ramp(3, 2, {"R", "G"});
  EXPECT_EQ(image.find("G"), 1u);
  EXPECT_FALSE(image.find("B"));
  EXPECT_EQ(image.plane(1)[5], image.at(2, 1, 1));
  EXPECT_THROW(image.at(3, 0, 0), std::out_of_range);
  EXPECT_THROW(image.at(0, -1, 1), std::out_of_range);  // would be a sample of channel 0
  EXPECT_THROW(image.at(-1, 0, 1), std::out_of_range);
  EXPECT_THROW(image.plane(2), std::out_of_range);
}

TEST_F(HostileExr, WhatIsNoImageIsNamedForWhatItIs) {
  expectSays(complaint(file("nothing.exr")), "no such file");
  expectSays(complaint(folder), "not a regular file");
  putBytes(file("empty.exr"), "");
  expectSays(complaint(file("empty.exr")), "empty");
  putBytes(file("junk.exr"), std::string(1000, 'x'));
  expectSays(complaint(file("junk.exr")), "not an OpenEXR file");
  ASSERT_EQ(mkfifo(file("pipe.exr").c_str(), 0600), 0);
  expectSays(complaint(file("pipe.exr")), "not a regular file");
}

TEST_F(HostileExr, AFileWithoutPermissionIsAUsageError) {
  if (geteuid() == 0) GTEST_SKIP() << "root reads everything";
  writeExr(file("locked.exr"), ramp(2, 2, {"R"}));
  fs::permissions(file("locked.exr"), fs::perms::none);
  expectSays(complaint(file("locked.exr")), "permissions");
}

TEST_F(HostileExr, DeepDataIsRefused) {
  Imf::Header header(2, 1);
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  float z = 1;
  float* samples[2] = {&z, &z};
  std::uint32_t counts[2] = {1, 1};
  Imf::DeepFrameBuffer buffer;
  buffer.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts), sizeof(counts[0]), 0));
  buffer.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples),
                                    sizeof(samples[0]), 0, sizeof(float)));
  {
    Imf::DeepScanLineOutputFile out(file("deep.exr").c_str(), header, 0);
    out.setFrameBuffer(buffer);
    out.writePixels(1);
  }
  expectSays(complaint(file("deep.exr")), "holds deep data");
}

TEST_F(HostileExr, SubsampledChannelsAreRefused) {
  Imf::Header header(4, 4);
  header.channels().insert("RY", Imf::Channel(Imf::HALF, 2, 2));
  const std::vector<Imath::half> pixels(16);
  Imf::FrameBuffer buffer;
  buffer.insert(
      "RY", Imf::Slice(Imf::HALF, reinterpret_cast<char*>(const_cast<Imath::half*>(pixels.data())),
                       2, 4, 2, 2));
  {
    Imf::OutputFile out(file("yc.exr").c_str(), header, 0);
    out.setFrameBuffer(buffer);
    out.writePixels(4);
  }
  expectSays(complaint(file("yc.exr")), "RY is stored at every 2 x 2 pixels");
}

TEST_F(HostileExr, EveryTruncationIsAUsageError) {
  writeExr(file("whole.exr"), ramp(24, 40, {"B", "G", "R"}));
  const std::string whole = bytesOf(file("whole.exr"));
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    putBytes(file("cut.exr"), whole.substr(0, size));
    EXPECT_THROW(readExr(file("cut.exr")), UsageError) << size << " of " << whole.size();
  }
}

/// The file with the data window's largest corner replaced.
std::string withWindow(std::string bytes, std::int32_t right, std::int32_t bottom) {
  const std::size_t name = bytes.find("dataWindow");
  const std::size_t corner = name + sizeof("dataWindow") + sizeof("box2i") + 4 + 8;
  bytes.replace(corner, 4, reinterpret_cast<const char*>(&right), 4);
  return bytes.replace(corner + 4, 4, reinterpret_cast<const char*>(&bottom), 4);
}

/// Address space that the process may take beyond what it has; put back at the end.
class MemoryLimit {
 public:
  explicit MemoryLimit(rlim_t bytes) {
    getrlimit(RLIMIT_AS, &before);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit limit = before;
    limit.rlim_cur = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + bytes;
    setrlimit(RLIMIT_AS, &limit);
  }
  ~MemoryLimit() { setrlimit(RLIMIT_AS, &before); }
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;

 private:
  rlimit before{};
};

TEST_F(HostileExr, HugeClaimsAreRefusedForWhatTheyClaimWithoutTheMemory) {
  writeExr(file("small.exr"), ramp(8, 8, {"R"}));
  const std::string small = bytesOf(file("small.exr"));
  const MemoryLimit limit(rlim_t{128} << 20);
  putBytes(file("huge.exr"), withWindow(small, 1 << 26, 7));
  expectSays(complaint(file("huge.exr")), "above the limit of 268435456 samples");
  putBytes(file("huge.exr"), withWindow(small, 1 << 20, 7));
  expectSays(complaint(file("huge.exr")), "cannot be in");
  for (const std::int32_t huge : {1 << 24, 1 << 30, std::numeric_limits<std::int32_t>::max()}) {
    putBytes(file("huge.exr"), withWindow(small, huge, huge));
    EXPECT_EQ(complaint(file("huge.exr")).find("bad_alloc"), std::string::npos) << huge;
    putBytes(file("huge.exr"), withWindow(small, huge, 7));
    EXPECT_EQ(complaint(file("huge.exr")).find("bad_alloc"), std::string::npos) << huge;
  }
}

TEST_F(HostileExr, AnAttributeLongerThanTheFileIsRefused) {
  writeExr(file("a.exr"), ramp(8, 8, {"R"}), {.attributes = {{"note", "text"}}});
  std::string bytes = bytesOf(file("a.exr"));
  const std::size_t size = bytes.find("note") + sizeof("note") + sizeof("string");
  const std::int32_t huge = std::numeric_limits<std::int32_t>::max();
  bytes.replace(size, 4, reinterpret_cast<const char*>(&huge), 4);
  putBytes(file("a.exr"), bytes);
  expectSays(complaint(file("a.exr")),
             "attribute 'note' of 2147483647 bytes is longer than the file");
}

TEST_F(HostileExr, AChannelListWithoutItsEndIsRefused) {
  writeExr(file("c.exr"), ramp(8, 8, {"R"}));
  std::string bytes = bytesOf(file("c.exr"));
  bytes.at(bytes.find("chlist") + sizeof("chlist")) = 0;  // OpenEXR reads on all the same
  putBytes(file("c.exr"), bytes);
  expectSays(complaint(file("c.exr")), "attribute 'channels' of type chlist cannot have 0 bytes");
}

TEST_F(HostileExr, TheHeaderOfEveryPartIsChecked) {
  writeParts(file("m.exr"), ramp(8, 6, {"R"}), ramp(5, 7, {"R"}));
  std::string bytes = bytesOf(file("m.exr"));
  const std::size_t size = bytes.rfind("lineOrder") + sizeof("lineOrder");
  bytes.at(size) = 2;  // a lineOrder of two bytes
  putBytes(file("m.exr"), bytes);
  expectSays(complaint(file("m.exr")),
             "attribute 'lineOrder' of type lineOrder cannot have 2 bytes");
}

/// Files to mutate: one of each compression, some tiled, one of several parts.
std::vector<std::string> seedsIn(const fs::path& folder) {
  std::vector<std::string> seeds;
  const Image image = ramp(19, 21, {"B", "G", "R"});
  for (int c = 0; c < Imf::NUM_COMPRESSION_METHODS; ++c) {
    for (const bool tiled : {false, true}) {
      Imf::Header header = headerOf(image, c % 2 == 0 ? Imf::HALF : Imf::FLOAT, {1, 2});
      header.compression() = static_cast<Imf::Compression>(c);
      if (tiled) header.setTileDescription({8, 8, Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN});
      if (tiled) header.setType(Imf::TILEDIMAGE);
      write(folder / "seed.exr", image, header);
      seeds.push_back(bytesOf(folder / "seed.exr"));
    }
  }
  return seeds;
}

/// One to four changes: a bit, a byte, a number of four bytes, a piece cut out or doubled. Half of
/// them in the first 400 bytes, where the header is.
std::string mutated(std::string bytes, std::mt19937& random) {
  constexpr std::uint32_t kNumbers[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 65536, 1u << 20};
  for (std::uint32_t n = 1 + random() % 4; n > 0; --n) {
    const std::size_t reach =
        random() % 2 == 0 ? std::min<std::size_t>(400, bytes.size()) : bytes.size();
    const std::size_t at = 8 + random() % (reach - 12);
    switch (random() % 5) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.replace(at, 4, reinterpret_cast<const char*>(&kNumbers[random() % 7]), 4);
        break;
      case 3:
        bytes.erase(at, random() % 16);
        break;
      default:
        bytes.insert(at, bytes.substr(at, random() % 16));
    }
    if (bytes.size() < 64) break;
  }
  return bytes;
}

TEST_F(HostileExr, MutatedFilesAreReadOrRefusedAndNothingElse) {
  const std::vector<std::string> seeds = seedsIn(folder);
  std::mt19937 random(20200715);
  // Files of a few kilobytes: what OpenEXR needs for tiles and chunks of the largest accepted size.
  const MemoryLimit limit(rlim_t{512} << 20);
  int read = 0, refused = 0;
  for (int i = 0; i < 2500; ++i) {
    const std::string bytes = mutated(seeds[static_cast<std::size_t>(i) % seeds.size()], random);
    putBytes(file("mutant.exr"), bytes);
    try {
      readExr(file("mutant.exr"));
      ++read;
    } catch (const UsageError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find("bad_alloc"), std::string::npos) << error.what();
    }
  }
  // The stimulus has to reach both ends.
  EXPECT_GT(read, 250);
  EXPECT_GT(refused, 250);
}

}  // namespace
}  // namespace gnomon
