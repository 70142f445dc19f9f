// Inside harness/vulkan: what stands behind the public types.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "harness/vulkan/draw.h"
#include "harness/vulkan/gpu.h"
#include "harness/vulkan/internal.h"

namespace gnomon {

struct GpuBuffer::Impl {
  std::shared_ptr<vulkan::Device> device;  // declared first: the buffer goes before its device
  vulkan::Buffer buffer;
  std::size_t size = 0;
};

struct GpuImage::Impl {
  std::shared_ptr<vulkan::Device> device;  // declared first, as above
  vulkan::Image image;
};

struct GpuSampler::Impl {
  std::shared_ptr<vulkan::Device> device;  // declared first, as above
  vulkan::OwnedSampler sampler;
  SamplerDescription description;
};

struct GpuProgram::Impl {
  vulkan::Program program;
};

struct GpuDrawProgram::Impl {
  vulkan::DrawProgram drawn;
};

struct Gpu::Impl {
  std::shared_ptr<vulkan::Device> device;
  vulkan::Runner runner;

  explicit Impl(std::shared_ptr<vulkan::Device> opened) : device(opened), runner(opened) {}

  /// Checks the work, and says it as Vulkan takes it. What it points to must live until it has run.
  static std::vector<vulkan::Command> resolve(vulkan::Device& device, std::span<const Work> work);
  static vulkan::Command resolve(vulkan::Device& device, const Dispatch& dispatch);
  static vulkan::Command resolve(vulkan::Device& device, const Draw& draw);
  GpuImage makeImage(const ImageDescription& description,
                     std::span<const std::byte> texels = {}) const;
  static VkBuffer handleOf(const GpuBuffer& buffer) { return buffer.impl->buffer.buffer.get(); }

 private:
  static vulkan::Command bound(vulkan::Device& device, const vulkan::Program& program,
                               std::span<const BoundBuffer> buffers,
                               std::span<const BoundImage> images, std::span<const std::byte> push);
  template <typename Target>
  static VkRenderingAttachmentInfo attachment(vulkan::Device& device, const Target& target);
  static vulkan::DrawParts partsOf(vulkan::Device& device, const Draw& draw);
};

/// Throw std::out_of_range.
void requireInside(const GpuBuffer& buffer, std::size_t offset, std::size_t bytes);
void requireInside(const ImageDescription& image, unsigned layer, unsigned mip);

}  // namespace gnomon
