// Graphics: pipelines without vertex input (vertices are pulled from storage buffers), draws to
// images, direct or as a buffer on the device says.
//
// Vulkan's own conventions hold: y points down in clip space as in the image, whose first row is
// the top one, and depth lies in [0, 1].
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "harness/vulkan/gpu.h"

namespace gnomon {

/// A graphics pipeline. Moves; frees itself.
class GpuDrawProgram {
 public:
  GpuDrawProgram();
  ~GpuDrawProgram();
  GpuDrawProgram(GpuDrawProgram&&) noexcept;
  GpuDrawProgram& operator=(GpuDrawProgram&&) noexcept;

 private:
  friend class Gpu;
  struct Impl;
  std::unique_ptr<Impl> impl;
};

/// Triangle lists without blending, one sample a pixel.
struct DrawProgramDescription {
  /// A fragment passes that is this to what the target holds. Depth is reversed: nearer is greater.
  enum class Compare { kGreaterOrEqual, kEqual, kAlways };
  enum class Cull { kNone, kFront, kBack };  ///< the front is counter-clockwise in the image

  std::vector<std::uint32_t> vertex{};
  std::vector<std::uint32_t> fragment{};  ///< none: only depth is drawn
  std::string vertexEntry = "main";
  std::string fragmentEntry = "main";
  std::vector<BindingSlot> slots{};  ///< both stages see them, and the push constants
  unsigned pushBytes = 0;
  std::map<std::uint32_t, std::uint32_t> specialization{};  ///< of both stages
  std::vector<PixelFormat> colours{};                       ///< of the targets, at most four
  bool depth = false;                                       ///< there is a kD32 target too
  Compare compare = Compare::kGreaterOrEqual;
  bool depthWrite = true;
  Cull cull = Cull::kNone;
  /// Added to the depth: times the least step of a float at the triangle's greatest depth, and
  /// times the triangle's slope (Vulkan specification, "Depth Bias").
  float depthBiasConstant = 0;
  float depthBiasSlope = 0;
};

/// One mip level of one layer that is drawn to.
struct ColourTarget {
  const GpuImage* image = nullptr;
  unsigned layer = 0;
  unsigned mip = 0;
  bool clear = true;              ///< first; else what is there stays
  std::array<float, 4> colour{};  ///< to clear to; not of kR32ui
  std::uint32_t id = 0;           ///< to clear to, of kR32ui
};

struct DepthTarget {
  const GpuImage* image = nullptr;
  unsigned layer = 0;
  unsigned mip = 0;
  bool clear = true;
  float depth = 0;  ///< to clear to; the farthest, since depth is reversed
};

/// As VkDrawIndexedIndirectCommand lies in a buffer.
struct DrawIndexed {
  std::uint32_t indexCount = 0;
  std::uint32_t instanceCount = 1;
  std::uint32_t firstIndex = 0;
  std::int32_t vertexOffset = 0;
  std::uint32_t firstInstance = 0;
};

/// As many DrawIndexed as `count` says lie in a buffer. Needs drawIndirectFirstInstance, since
/// nobody but the device knows what they hold. Where multiDrawIndirect is missing each is a call of
/// its own; only a program that reads gl_DrawID, which then starts anew each time, needs it.
struct DrawIndirect {
  const GpuBuffer* buffer = nullptr;
  std::size_t offset = 0;
  unsigned stride = sizeof(DrawIndexed);
  unsigned count = 1;
};

/// The buffer `counter` says how many, but no more than `most` are drawn. Needs drawIndirectCount,
/// drawIndirectFirstInstance and multiDrawIndirect.
struct DrawIndirectCount {
  const GpuBuffer* buffer = nullptr;
  std::size_t offset = 0;
  unsigned stride = sizeof(DrawIndexed);
  const GpuBuffer* counter = nullptr;
  std::size_t counterOffset = 0;
  unsigned most = 1;
};

/// For each of the program's slots one of its buffers or images, and for each of its targets an
/// image of that format, all of one size, which is the viewport's. No image is both.
struct Draw {
  const GpuDrawProgram* program = nullptr;
  std::vector<BoundBuffer> buffers{};
  std::vector<BoundImage> images{};
  std::vector<std::byte> push{};  ///< exactly the program's pushBytes
  std::vector<ColourTarget> colours{};
  std::optional<DepthTarget> depth{};
  const GpuBuffer* indices = nullptr;  ///< 32-bit
  std::variant<std::vector<DrawIndexed>, DrawIndirect, DrawIndirectCount> calls{};
};

}  // namespace gnomon
