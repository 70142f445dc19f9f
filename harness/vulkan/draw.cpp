// Draws: what callers may get wrong, and the parts as Vulkan takes them.
#include "harness/vulkan/draw.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "harness/error.h"
#include "harness/vulkan/impl.h"

namespace gnomon {

static_assert(sizeof(DrawIndexed) == sizeof(VkDrawIndexedIndirectCommand));

namespace {

using vulkan::Device;
using vulkan::DrawParts;

constexpr std::size_t kIndexBytes = sizeof(std::uint32_t);
constexpr std::size_t kCountBytes = sizeof(std::uint32_t);

/// Every offset into a buffer of commands is a multiple of it (vkCmdDrawIndexedIndirect).
constexpr std::size_t kCommandAlignment = 4;

void requireFeatures(const vulkan::Adapter& adapter, const std::vector<std::string>& wanted) {
  if (const auto why = adapter.info.lacks(wanted)) throw Unsupported(*why);
}

void requireAligned(const char* what, std::size_t value) {
  if (value % kCommandAlignment != 0)
    throw std::logic_error(
        fmt::format("{} of {} bytes is no multiple of {}", what, value, kCommandAlignment));
}

/// Of the viewport: the first target's.
std::array<unsigned, 2> sizeOf(const Draw& draw) {
  if (draw.colours.empty()) return mipSize(draw.depth->image->description(), draw.depth->mip);
  return mipSize(draw.colours[0].image->description(), draw.colours[0].mip);
}

/// A target exists, holds what its program draws, is as large as the first one (which must have
/// been checked before), and nobody reads in the draw what the draw writes.
template <typename Target>
void requireTarget(const std::string& name, const Target& target, PixelFormat drawn,
                   const Draw& draw) {
  if (target.image == nullptr) throw std::logic_error(name + " has no image");
  const ImageDescription& held = target.image->description();
  if (held.format != drawn)
    throw std::logic_error(
        fmt::format("{} is {}; the program draws {}", name, nameOf(held.format), nameOf(drawn)));
  requireInside(held, target.layer, target.mip);
  const auto [width, height] = mipSize(held, target.mip);
  const auto [firstWidth, firstHeight] = sizeOf(draw);
  if (width != firstWidth || height != firstHeight)
    throw std::logic_error(fmt::format("{} of {} x {} pixels beside a target of {} x {}", name,
                                       width, height, firstWidth, firstHeight));
  for (const BoundImage& bound : draw.images)
    if (bound.image == target.image)
      throw std::logic_error(fmt::format("{} is also bound to set {}, binding {}", name,
                                         bound.slot.set, bound.slot.binding));
}

void requireTargets(const vulkan::DrawProgram& program, const Draw& draw) {
  const auto text = [](std::size_t colours, bool depth) {
    return fmt::format("{} colour targets {} depth", colours, depth ? "with" : "without");
  };
  if (draw.colours.size() != program.colours.size() || draw.depth.has_value() != program.depth)
    throw std::logic_error(fmt::format("{} for a program of {}",
                                       text(draw.colours.size(), draw.depth.has_value()),
                                       text(program.colours.size(), program.depth)));
  for (std::size_t i = 0; i < draw.colours.size(); ++i)
    requireTarget(fmt::format("colour target {}", i), draw.colours[i], program.colours[i], draw);
  if (draw.depth) requireTarget("the depth target", *draw.depth, PixelFormat::kD32, draw);
}

/// `count` commands from the offset on lie in the buffer; the last one needs no stride.
void requireCommands(const vulkan::Adapter& adapter, const GpuBuffer* buffer, std::size_t offset,
                     unsigned stride, unsigned count) {
  if (buffer == nullptr) throw std::logic_error("an indirect draw without a buffer of commands");
  requireAligned("the offset of indirect draws", offset);
  requireAligned("the stride of indirect draws", stride);
  if (stride < sizeof(DrawIndexed))
    throw std::logic_error(
        fmt::format("indirect draws {} bytes apart; each has {}", stride, sizeof(DrawIndexed)));
  if (count > 0)
    requireInside(*buffer, offset, std::size_t{count - 1} * stride + sizeof(DrawIndexed));
  const bool multi = adapter.info.features.at("multiDrawIndirect");  // else one a call
  if (multi && count > adapter.limits.maxDrawIndirectCount)
    throw Unsupported(fmt::format("{} indirect draws; {} allows {}", count, adapter.info.name,
                                  adapter.limits.maxDrawIndirectCount));
}

void requireCalls(const vulkan::Adapter&, const vulkan::DrawProgram&, const GpuBuffer& indices,
                  const std::vector<DrawIndexed>& draws) {
  for (const DrawIndexed& draw : draws)
    if (std::size_t{draw.firstIndex} + draw.indexCount > indices.size() / kIndexBytes)
      throw std::out_of_range(fmt::format(
          "indices {} to {} of an index buffer of {}", draw.firstIndex,
          std::size_t{draw.firstIndex} + draw.indexCount, indices.size() / kIndexBytes));
}

void requireCalls(const vulkan::Adapter& adapter, const vulkan::DrawProgram& program,
                  const GpuBuffer&, const DrawIndirect& draws) {
  requireFeatures(adapter, {"drawIndirectFirstInstance"});
  if (program.readsDrawId && draws.count > 1) requireFeatures(adapter, {"multiDrawIndirect"});
  requireCommands(adapter, draws.buffer, draws.offset, draws.stride, draws.count);
}

void requireCalls(const vulkan::Adapter& adapter, const vulkan::DrawProgram&, const GpuBuffer&,
                  const DrawIndirectCount& draws) {
  requireFeatures(adapter, {"drawIndirectCount", "drawIndirectFirstInstance", "multiDrawIndirect"});
  requireCommands(adapter, draws.buffer, draws.offset, draws.stride, draws.most);
  if (draws.counter == nullptr) throw std::logic_error("an indirect draw without its count");
  requireAligned("the offset of the count", draws.counterOffset);
  requireInside(*draws.counter, draws.counterOffset, kCountBytes);
}

VkClearValue clearOf(const ColourTarget& target) {
  VkClearValue value{};
  if (target.image->description().format == PixelFormat::kR32ui)
    value.color.uint32[0] = target.id;
  else
    std::ranges::copy(target.colour, value.color.float32);
  return value;
}

VkClearValue clearOf(const DepthTarget& target) {
  VkClearValue value{};
  value.depthStencil.depth = target.depth;
  return value;
}

}  // namespace

template <typename Target>
VkRenderingAttachmentInfo Gpu::Impl::attachment(Device& device, const Target& target) {
  VkRenderingAttachmentInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO;
  info.imageView =
      device.viewOf(target.image->impl->image, {.mip = static_cast<int>(target.mip),
                                                .asArray = false,
                                                .layer = static_cast<int>(target.layer)});
  info.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  info.loadOp = target.clear ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
  info.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  info.clearValue = clearOf(target);
  return info;
}

DrawParts Gpu::Impl::partsOf(Device& device, const Draw& draw) {
  DrawParts parts;
  for (const ColourTarget& target : draw.colours)
    parts.colours.push_back(attachment(device, target));
  if (draw.depth) parts.depth = attachment(device, *draw.depth);
  const auto [width, height] = sizeOf(draw);
  parts.size = {width, height};
  parts.indices = handleOf(*draw.indices);
  parts.oneByOne = !device.adapter.info.features.at("multiDrawIndirect");
  if (const auto* direct = std::get_if<std::vector<DrawIndexed>>(&draw.calls))
    parts.direct = *direct;
  const auto indirect = [&](const auto& draws, unsigned count) {
    parts.commands = handleOf(*draws.buffer);
    parts.offset = draws.offset;
    parts.stride = draws.stride;
    parts.count = count;
  };
  if (const auto* draws = std::get_if<DrawIndirect>(&draw.calls)) indirect(*draws, draws->count);
  if (const auto* draws = std::get_if<DrawIndirectCount>(&draw.calls)) {
    indirect(*draws, draws->most);
    parts.counter = handleOf(*draws->counter);
    parts.counterOffset = draws->counterOffset;
  }
  return parts;
}

vulkan::Command Gpu::Impl::resolve(Device& device, const Draw& draw) {
  const vulkan::DrawProgram& program = draw.program->impl->drawn;
  requireTargets(program, draw);
  if (draw.indices == nullptr) throw std::logic_error("a draw without an index buffer");
  std::visit(
      [&](const auto& calls) { requireCalls(device.adapter, program, *draw.indices, calls); },
      draw.calls);
  vulkan::Command command = bound(device, program.program, draw.buffers, draw.images, draw.push);
  command.draw = partsOf(device, draw);
  return command;
}

}  // namespace gnomon
