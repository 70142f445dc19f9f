// The only door to Vulkan: devices, buffers, programs, dispatches, timestamps, validation messages.
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
  /// shaderRoundingModeRTEFloat32, declarable for 32 bit alone (roundingModeIndependence).
  bool roundingRteFloat32 = false;
  bool signedZeroInfNanFloat32 = false;  ///< shaderSignedZeroInfNanPreserveFloat32
  double timestampPeriodNs = 0;          ///< 0: the queue has no timestamps
  unsigned maxGroupInvocations = 0;
  std::array<unsigned, 3> maxGroupSize{};
  std::array<unsigned, 3> maxGroupCount{};
  unsigned maxSharedBytes = 0;
  unsigned maxPushBytes = 0;
  std::size_t maxStorageRange = 0;
  /// Optional features by the names of the Vulkan structures ("shaderFloat64",
  /// "scalarBlockLayout", "drawIndirectCount"), and "timestamps", "subgroupBasic", "subgroupVote",
  /// "subgroupArithmetic", "subgroupBallot", "subgroupShuffle", "subgroupShuffleRelative",
  /// "subgroupClustered", "subgroupQuad" (in compute): what the device has and a Gpu enables.
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

/// What a compute pipeline binds at one place.
struct BindingSlot {
  unsigned set = 0;
  unsigned binding = 0;
  bool uniform = false;  ///< uniform buffer instead of storage buffer
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
};

/// As a range: all of the buffer from the offset on.
inline constexpr std::size_t kWholeBuffer = ~std::size_t{0};

/// One buffer, or a part of it, bound for a dispatch.
struct BoundBuffer {
  BindingSlot slot;
  const GpuBuffer* buffer = nullptr;
  std::size_t offset = 0;  ///< bytes, a multiple of Gpu::offsetAlignment()
  /// Bytes. With 0 the kernel sees a runtime array of length() 0.
  std::size_t range = kWholeBuffer;
};

struct Dispatch {
  const GpuProgram* program = nullptr;
  std::vector<BoundBuffer> buffers{};  ///< one for each of the program's slots
  std::vector<std::byte> push{};       ///< exactly the program's pushBytes
  std::array<std::uint32_t, 3> groups{1, 1, 1};
};

/// One opened device with one compute queue. Not thread-safe: one thread talks to a Gpu.
class Gpu {
 public:
  struct Options {
    std::string device;      ///< part of a name, or an index; empty: a real GPU, else software
    bool validation = true;  ///< load the validation layer with synchronisation validation
    /// Copy through a staging buffer, as on discrete GPUs, even where the host can map the
    /// device's memory: so that a software device can test that way.
    bool staged = false;
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

  /// Validates the module and builds the pipeline. Throws UsageError (invalid SPIR-V), Unsupported
  /// (more sets or push constants than the device has) or GpuError (the driver refuses). That the
  /// slots cover what the entry point uses is the caller's promise; reflect() tells.
  GpuProgram build(const ProgramDescription& description);

  /// Runs the dispatches in order with full memory barriers between them and waits, at most
  /// `limit`. Returns the GPU time of each in nanoseconds (0 without timestamps). Throws GpuError
  /// on device loss or when the limit passes (the device is then unusable: see alive()),
  /// Unsupported past a limit of the device (groups, bytes in a binding), and std::logic_error
  /// where buffers or push constants are not those of the program.
  std::vector<double> run(std::span<const Dispatch> dispatches, std::chrono::milliseconds limit);

  /// False once the device was lost or a wait ran out; a new Gpu is needed. What belongs to a
  /// device whose wait ran out is leaked, since work may still use it.
  bool alive() const;

  /// Validation messages (warnings and errors) since the last call, each with its VUID first.
  std::vector<std::string> takeMessages();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl;
};

}  // namespace gnomon
