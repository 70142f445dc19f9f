// Results without waiting for them: a frame's buffers are copied to the host while the next frames
// already run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "harness/vulkan/gpu.h"

namespace gnomon {

/// A part of a buffer that the host wants once the work is done.
struct GpuCopy {
  const GpuBuffer* from = nullptr;
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

/// Some slots, each for one frame at a time: its work, then the copies of what it made. It keeps
/// the device, as buffers do. What a frame uses must live, and stay as it is, until poll() has
/// found that frame or a later one. Uploads, downloads and run() may go on meanwhile: they take
/// their turn behind all frames in flight, and wait for them.
class GpuReadback {
 public:
  struct Frame {
    std::uint64_t number = 0;        ///< of the submissions, from 0 on
    std::vector<std::byte> bytes{};  ///< of all copies, one behind the other
    std::vector<double> times{};     ///< GPU nanoseconds of each step; 0 without timestamps
  };

  /// At most `slots` frames are in flight, each with copies of at most `bytes`.
  GpuReadback(Gpu& gpu, unsigned slots, std::size_t bytes);
  /// Waits for what is in flight.
  ~GpuReadback();
  GpuReadback(GpuReadback&&) noexcept;
  GpuReadback& operator=(GpuReadback&&) noexcept;

  /// Hands the work over and returns at once. False, and nothing is done, where every slot's frame
  /// is in flight: not yet found by poll(). Throws as Gpu::run() does, std::out_of_range for a copy
  /// past the end of its buffer, and std::logic_error for more bytes than a slot has.
  bool submit(std::span<const Work> work, std::span<const GpuCopy> copies);

  /// The newest frame that is done, unless an earlier call has returned it. Never waits; frames
  /// that were done before it are dropped. Throws GpuError on device loss.
  std::optional<Frame> poll();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl;
};

}  // namespace gnomon
