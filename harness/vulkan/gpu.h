// The only door to Vulkan: devices, buffers, images, programs, dispatches, timestamps, validation
// messages. What draws and what is read back without waiting stand in draw.h and readback.h.
// No Vulkan type appears here, so no other folder needs a Vulkan header.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace gnomon {

/// What one Vulkan device is and can do, as far as stages and verdicts ask.
struct GpuInfo {
  int index = 0;          ///< position in listGpus()
  std::string name{};     ///< VkPhysicalDeviceProperties::deviceName
  std::string driver{};   ///< driverName and driverInfo
  std::string api{};      ///< "1.3.230"
  std::string type{};     ///< "discrete", "integrated", "virtual", "software" or "other"
  bool software = false;  ///< VK_PHYSICAL_DEVICE_TYPE_CPU
  unsigned subgroupSize = 0;
  std::vector<unsigned> subgroupSizes{};  ///< that a program may ask for; often just one, or none
  /// shaderRoundingModeRTEFloat32, declarable for 32 bit alone (roundingModeIndependence).
  bool roundingRteFloat32 = false;
  bool signedZeroInfNanFloat32 = false;  ///< shaderSignedZeroInfNanPreserveFloat32
  double timestampPeriodNs = 0;          ///< 0: the queue has no timestamps
  unsigned maxGroupInvocations = 0;
  unsigned maxGroupSubgroups = 0;  ///< of a size that a program has asked for
  std::array<unsigned, 3> maxGroupSize{};
  std::array<unsigned, 3> maxGroupCount{};
  unsigned maxSharedBytes = 0;
  unsigned maxPushBytes = 0;
  std::size_t maxStorageRange = 0;
  unsigned maxImageSide = 0;    ///< pixels, of an image that is no cube
  unsigned maxImageLayers = 0;  ///< a format may allow fewer
  unsigned subTexelBits = 0;    ///< of the fraction that weights texels, subTexelPrecisionBits
  unsigned mipmapBits = 0;      ///< of the fraction that weights mip levels, mipmapPrecisionBits
  /// Optional features by the names of the Vulkan structures ("shaderFloat64",
  /// "scalarBlockLayout", "drawIndirectCount"), and "timestamps", "graphicsQueue" (a queue that
  /// draws), "subgroupBasic", "subgroupVote", "subgroupArithmetic", "subgroupBallot",
  /// "subgroupShuffle", "subgroupShuffleRelative", "subgroupClustered", "subgroupQuad" (in
  /// compute): what the device has and a Gpu enables.
  std::map<std::string, bool> features{};

  /// Why a kernel that asks for these features cannot run, or nothing.
  std::optional<std::string> lacks(std::span<const std::string> wanted) const;
};

/// Every device of this machine with Vulkan 1.2 and a compute queue; empty if there is none.
/// Throws DeviceError if the Vulkan loader itself is unusable.
std::vector<GpuInfo> listGpus();

/// Position of the device that `wanted` means: an index, or a part of one device's name in any
/// case; empty: a real GPU if there is one (discrete, integrated, virtual), else the software one.
/// Throws DeviceError with the list of devices where none matches, or several.
std::size_t chooseGpu(std::span<const GpuInfo> gpus, const std::string& wanted);

class Gpu;

/// A storage buffer on the device. Moves; frees itself.
class GpuBuffer {
 public:
  GpuBuffer();
  ~GpuBuffer();
  GpuBuffer(GpuBuffer&&) noexcept;
  GpuBuffer& operator=(GpuBuffer&&) noexcept;
  std::size_t size() const;

 private:
  friend class Gpu;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

/// How a pixel is stored; a multi-channel pixel holds R first. The number is of bits a channel,
/// normalised to [0, 1] but for f (IEEE float), ui (unsigned integer) and D32 (float depth).
enum class PixelFormat {
  kRgba8,
  kR8,
  kRgba16f,
  kRg16f,
  kR16f,
  kRgba32f,
  kRg32f,
  kR32f,
  kR32ui,
  kD32,
};

unsigned bytesPerPixel(PixelFormat format);
unsigned channels(PixelFormat format);
const char* nameOf(PixelFormat format);  ///< "RGBA16F", for messages

struct ImageDescription {
  PixelFormat format = PixelFormat::kRgba8;
  unsigned width = 1;
  unsigned height = 1;
  unsigned layers = 1;  ///< of a cube: its faces, +X -X +Y -Y +Z -Z; a multiple of six
  unsigned mips = 1;
  bool cube = false;
};

/// Width and height of a mip level: max(1, floor(size / 2^mip)).
std::array<unsigned, 2> mipSize(const ImageDescription& image, unsigned mip);
/// Bytes of one mip level of one layer, its rows tight.
std::size_t mipBytes(const ImageDescription& image, unsigned mip);
/// Of all its layers and mip levels.
std::size_t imageBytes(const ImageDescription& image);
/// Mip levels of such an image down to 1 x 1.
unsigned fullMipCount(unsigned width, unsigned height);

/// A two-dimensional image, array or cube map on the device. Moves; frees itself. Kernels may
/// sample it, and store and draw to it where the device can do that with its format.
class GpuImage {
 public:
  GpuImage();
  ~GpuImage();
  GpuImage(GpuImage&&) noexcept;
  GpuImage& operator=(GpuImage&&) noexcept;
  const ImageDescription& description() const;

 private:
  friend class Gpu;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

struct SamplerDescription {
  enum class Address { kClamp, kRepeat, kMirror };  ///< clamp: to the edge
  enum class Reduction { kAverage, kMin, kMax };

  bool linear = false;      ///< between texels; else the nearest
  bool linearMips = false;  ///< between mip levels; else the nearest
  Address address = Address::kClamp;
  /// 1 where the reference >= the texel, else 0: less of a distance passes where depth is reversed.
  bool compare = false;
  /// Of the texels that the filter touches; the smallest and the largest need samplerFilterMinmax.
  Reduction reduction = Reduction::kAverage;
};

/// Moves; frees itself.
class GpuSampler {
 public:
  GpuSampler();
  ~GpuSampler();
  GpuSampler(GpuSampler&&) noexcept;
  GpuSampler& operator=(GpuSampler&&) noexcept;

 private:
  friend class Gpu;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

/// What a pipeline binds at one place.
struct BindingSlot {
  enum class Kind {
    kStorageBuffer,
    kUniformBuffer,
    kSampledImage,  ///< texture2D: an image that a kernel joins with a sampler, or fetches from
    kStorageImage,  ///< image2D
    kSampler,       ///< sampler
    kCombined,      ///< sampler2D: an image and its sampler
  };

  unsigned set = 0;
  unsigned binding = 0;
  Kind kind = Kind::kStorageBuffer;
  unsigned count = 1;  ///< descriptors, of an array of images
  auto operator<=>(const BindingSlot&) const = default;
};

/// A compute pipeline. Moves; frees itself.
class GpuProgram {
 public:
  GpuProgram();
  ~GpuProgram();
  GpuProgram(GpuProgram&&) noexcept;
  GpuProgram& operator=(GpuProgram&&) noexcept;

 private:
  friend class Gpu;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

struct ProgramDescription {
  std::vector<std::uint32_t> spirv{};
  std::string entryPoint = "main";
  std::vector<BindingSlot> slots{};
  unsigned pushBytes = 0;
  std::map<std::uint32_t, std::uint32_t> specialization{};  ///< constant id -> 32 bits
  unsigned subgroupSize = 0;  ///< one of GpuInfo::subgroupSizes; 0: the driver's choice
};

/// As a range: all of the buffer from the offset on.
inline constexpr std::size_t kWholeBuffer = ~std::size_t{0};

/// One buffer, or a part of it, bound for a dispatch or a draw.
struct BoundBuffer {
  BindingSlot slot;
  const GpuBuffer* buffer = nullptr;
  std::size_t offset = 0;  ///< bytes, a multiple of Gpu::offsetAlignment()
  /// Bytes. With 0 the kernel sees a runtime array of length() 0.
  std::size_t range = kWholeBuffer;
};

/// One image, sampler, or both, bound for a dispatch or a draw. The kernel sees the image as what
/// it is: 2D, a 2D array if it has several layers, a cube map, or an array of them. In an array of
/// descriptors each sees one mip level: the k-th level k, those past the last level that one.
struct BoundImage {
  BindingSlot slot;
  const GpuImage* image = nullptr;      ///< none at a kSampler
  const GpuSampler* sampler = nullptr;  ///< only at a kSampler or kCombined
  /// The mip level that the kernel sees as level 0, its only one. -1: all of them, or the first in
  /// a storage image, which has only one.
  int mip = -1;
  /// Seen as a 2D array (texture2DArray, image2DArray) also where it has one layer or is a cube.
  bool asArray = false;
};

/// For each of the program's slots one of its buffers or images.
struct Dispatch {
  const GpuProgram* program = nullptr;
  std::vector<BoundBuffer> buffers{};
  std::vector<BoundImage> images{};
  std::vector<std::byte> push{};  ///< exactly the program's pushBytes
  std::array<std::uint32_t, 3> groups{1, 1, 1};
};

struct Draw;                    // draw.h
struct DrawProgramDescription;  // likewise
class GpuDrawProgram;           // likewise

/// One step of a submission.
using Work = std::variant<const Dispatch*, const Draw*>;

/// One opened device with one queue, for draws too where the device has such a one. Not
/// thread-safe: one thread talks to a Gpu.
class Gpu {
 public:
  struct Options {
    std::string device;      ///< part of a name, or an index; empty: a real GPU, else software
    bool validation = true;  ///< load the validation layer with synchronisation validation
    /// Copy through a staging buffer, as on discrete GPUs, even where the host can map the
    /// device's memory: so that a software device can test that way.
    bool staged = false;
    /// Features that the device has and that shall not be used, so that a device can test what
    /// another one lacks.
    std::vector<std::string> without{};
  };

  /// Opens the device that the options choose. Throws DeviceError: none there, several match,
  /// validation layer missing; the text lists the devices.
  explicit Gpu(const Options& options);
  ~Gpu();
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;

  const GpuInfo& info() const;

  /// Alignment that offsets of bound buffers must have, in bytes.
  std::size_t offsetAlignment() const;

  /// Uninitialised device buffer, of 0 bytes too; throws GpuError when memory is out.
  GpuBuffer allocate(std::size_t bytes);
  /// Bytes to or from the buffer at once. Throws std::out_of_range past its end.
  void upload(const GpuBuffer& to, std::size_t offset, std::span<const std::byte> data);
  void download(const GpuBuffer& from, std::size_t offset, std::span<std::byte> data);
  /// Repeats a 32-bit pattern over the whole buffer.
  void fill(const GpuBuffer& buffer, std::uint32_t pattern);

  /// An image of undefined content. Throws Unsupported where the device has no such images (its
  /// format, sides, layers), std::logic_error where nothing has (no pixels, more mip levels than
  /// down to 1 x 1, a cube without six square faces), and GpuError when memory is out.
  GpuImage allocateImage(const ImageDescription& description);
  /// The same of these texels: imageBytes() of them, layer by layer, each with its mip levels, rows
  /// tight and the first one first; else std::logic_error.
  GpuImage allocateImage(const ImageDescription& description, std::span<const std::byte> texels);
  /// One mip level of one layer at once, its rows tight and the first one first; mipBytes() of
  /// them, else std::logic_error. Throws std::out_of_range past the last layer or mip level. Bits
  /// stay what they are, but depths must lie in [0, 1] (Vulkan's rule for copies into D32).
  void uploadImage(const GpuImage& to, unsigned layer, unsigned mip,
                   std::span<const std::byte> tightRows);
  void downloadImage(const GpuImage& from, unsigned layer, unsigned mip,
                     std::span<std::byte> tightRows);
  /// The whole image, its texels in the order of allocateImage().
  void downloadImage(const GpuImage& from, std::span<std::byte> texels);
  /// Repeats one pixel, the first bytesPerPixel() bytes of the pattern, over every layer and mip.
  void fillImage(const GpuImage& image, const std::array<std::byte, 16>& pixelPattern);

  /// Throws Unsupported for a smallest or largest where the device lacks samplerFilterMinmax, and
  /// std::logic_error for one that also compares.
  GpuSampler makeSampler(const SamplerDescription& description);

  /// Validates the module and builds the pipeline. Throws UsageError (invalid SPIR-V), Unsupported
  /// (more sets or push constants than the device has) or GpuError (the driver refuses). That the
  /// slots cover what the entry point uses is the caller's promise; reflect() tells.
  GpuProgram build(const ProgramDescription& description);
  /// The same of a graphics pipeline. Throws Unsupported also without a graphics queue, dynamic
  /// rendering or shaderDrawParameters where a stage asks for it, and where a format is none to
  /// draw to.
  GpuDrawProgram build(const DrawProgramDescription& description);

  /// Runs the dispatches in order with full memory barriers between them and waits, at most
  /// `limit`. Returns the GPU time of each in nanoseconds (0 without timestamps). Throws GpuError
  /// on device loss or when the limit passes (the device is then unusable: see alive()),
  /// Unsupported past a limit of the device (groups, bytes in a binding, storing to a format,
  /// filtering one through a kCombined), and std::logic_error where buffers, images or push
  /// constants are not those of the program.
  std::vector<double> run(std::span<const Dispatch> dispatches, std::chrono::milliseconds limit);
  /// The same of dispatches and draws. Throws Unsupported also for a way to draw that the device
  /// lacks, std::logic_error where targets, indices or commands are not what the program and the
  /// draw say, and std::out_of_range where they lie past the end of their buffer.
  std::vector<double> run(std::span<const Work> work, std::chrono::milliseconds limit);

  /// False once the device was lost or a wait ran out; a new Gpu is needed. What belongs to a
  /// device whose wait ran out is leaked, since work may still use it.
  bool alive() const;

  /// Validation messages (warnings and errors) since the last call, each with its VUID first.
  std::vector<std::string> takeMessages();

 private:
  friend class GpuReadback;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

}  // namespace gnomon
