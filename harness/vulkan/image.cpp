// Images, the way of pixels to and from them, and samplers.
//
// Pixels always go through the staging buffer: the device alone knows how an image lies in memory.
#include "harness/vulkan/internal.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace {

struct Format {
  const char* name;
  VkFormat vulkan;
  unsigned channels;
  unsigned bytes;  ///< of a pixel
};

constexpr Format kFormats[] = {
    // in the order of PixelFormat
    {"RGBA8", VK_FORMAT_R8G8B8A8_UNORM, 4, 4},
    {"R8", VK_FORMAT_R8_UNORM, 1, 1},
    {"RGBA16F", VK_FORMAT_R16G16B16A16_SFLOAT, 4, 8},
    {"RG16F", VK_FORMAT_R16G16_SFLOAT, 2, 4},
    {"R16F", VK_FORMAT_R16_SFLOAT, 1, 2},
    {"RGBA32F", VK_FORMAT_R32G32B32A32_SFLOAT, 4, 16},
    {"RG32F", VK_FORMAT_R32G32_SFLOAT, 2, 8},
    {"R32F", VK_FORMAT_R32_SFLOAT, 1, 4},
    {"R32UI", VK_FORMAT_R32_UINT, 1, 4},
    {"D32", VK_FORMAT_D32_SFLOAT, 1, 4},
};
static_assert(std::size(kFormats) == static_cast<std::size_t>(PixelFormat::kD32) + 1);

const Format& formatOf(PixelFormat format) { return kFormats[static_cast<std::size_t>(format)]; }

}  // namespace

unsigned bytesPerPixel(PixelFormat format) { return formatOf(format).bytes; }
unsigned channels(PixelFormat format) { return formatOf(format).channels; }
const char* nameOf(PixelFormat format) { return formatOf(format).name; }

std::array<unsigned, 2> mipSize(const ImageDescription& image, unsigned mip) {
  return {std::max(1u, image.width >> mip), std::max(1u, image.height >> mip)};
}

std::size_t mipBytes(const ImageDescription& image, unsigned mip) {
  const auto [width, height] = mipSize(image, mip);
  return std::size_t{width} * height * bytesPerPixel(image.format);
}

std::size_t imageBytes(const ImageDescription& image) {
  std::size_t bytes = 0;
  for (unsigned mip = 0; mip < image.mips; ++mip) bytes += image.layers * mipBytes(image, mip);
  return bytes;
}

unsigned fullMipCount(unsigned width, unsigned height) {
  return static_cast<unsigned>(std::bit_width(std::max(width, height)));
}

namespace vulkan {
namespace {

VkImageAspectFlags aspectOf(PixelFormat format) {
  return format == PixelFormat::kD32 ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

/// Every use that the format can have here.
VkImageUsageFlags usageOf(PixelFormat format, VkFormatFeatureFlags features) {
  VkImageUsageFlags usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                            VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  if ((features & VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT) != 0) usage |= VK_IMAGE_USAGE_STORAGE_BIT;
  if ((features & VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT) != 0)
    usage |= VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  if (format == PixelFormat::kD32) usage |= VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT;
  return usage;
}

VkImageCreateInfo infoOf(const ImageDescription& description, VkFormatFeatureFlags features) {
  VkImageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  if (description.cube) info.flags = VK_IMAGE_CREATE_CUBE_COMPATIBLE_BIT;
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = formatOf(description.format).vulkan;
  info.extent = {description.width, description.height, 1};
  info.mipLevels = description.mips;
  info.arrayLayers = description.layers;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = usageOf(description.format, features);
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  return info;
}

/// The queue matters, since only one that can draw copies depth
/// (VUID-vkCmdCopyBufferToImage-commandBuffer-04477).
void requireSupported(const Adapter& adapter, const ImageDescription& image,
                      const VkImageCreateInfo& info) {
  const char* const format = nameOf(image.format);
  VkImageFormatProperties most{};
  const VkResult result = vkGetPhysicalDeviceImageFormatProperties(
      adapter.handle, info.format, info.imageType, info.tiling, info.usage, info.flags, &most);
  if (result == VK_ERROR_FORMAT_NOT_SUPPORTED ||
      (image.format == PixelFormat::kD32 && !adapter.info.features.at("graphicsQueue")))
    throw Unsupported(fmt::format("{} of {} is not supported by {}",
                                  image.cube ? "sampled cube image" : "sampled image", format,
                                  adapter.info.name));
  if (result != VK_SUCCESS)
    throw GpuError(callFailed("vkGetPhysicalDeviceImageFormatProperties", result));
  if (image.width > most.maxExtent.width || image.height > most.maxExtent.height)
    throw Unsupported(fmt::format("{} image of {} x {} pixels; {} allows {} x {}", format,
                                  image.width, image.height, adapter.info.name,
                                  most.maxExtent.width, most.maxExtent.height));
  if (image.layers > most.maxArrayLayers || image.mips > most.maxMipLevels)
    throw Unsupported(fmt::format("{} image of {} layers, {} mips; {} allows {} and {}", format,
                                  image.layers, image.mips, adapter.info.name, most.maxArrayLayers,
                                  most.maxMipLevels));
  if (image.cube && image.layers > 6 && !adapter.info.features.at("imageCubeArray"))
    throw Unsupported(fmt::format("{} lacks imageCubeArray", adapter.info.name));
}

VkImageViewType viewType(const ImageDescription& image, bool asArray) {
  if (image.cube && !asArray)
    return image.layers > 6 ? VK_IMAGE_VIEW_TYPE_CUBE_ARRAY : VK_IMAGE_VIEW_TYPE_CUBE;
  return image.layers > 1 || asArray ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
}

void toGeneralLayout(VkCommandBuffer commands, const Image& image) {
  VkImageMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  barrier.newLayout = VK_IMAGE_LAYOUT_GENERAL;
  barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image.image.get();
  barrier.subresourceRange = {aspectOf(image.description.format), 0, VK_REMAINING_MIP_LEVELS, 0,
                              VK_REMAINING_ARRAY_LAYERS};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                       VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

/// A mip level of a layer in strips of rows, each no more than fits the staging buffer, and from
/// or to its beginning. No device has rows longer than that.
std::vector<VkBufferImageCopy> stripsOf(const ImageDescription& image, unsigned layer,
                                        unsigned mip) {
  const auto [width, height] = mipSize(image, mip);
  const std::size_t rowBytes = std::size_t{width} * bytesPerPixel(image.format);
  const auto most = static_cast<unsigned>(std::max<std::size_t>(kStagingBytes / rowBytes, 1));
  std::vector<VkBufferImageCopy> strips;
  for (unsigned row = 0; row < height; row += most) {
    VkBufferImageCopy& strip = strips.emplace_back();
    strip.imageSubresource = {aspectOf(image.format), mip, layer, 1};
    strip.imageOffset = {0, static_cast<std::int32_t>(row), 0};
    strip.imageExtent = {width, std::min(most, height - row), 1};
  }
  return strips;
}

std::size_t bytesOf(const VkBufferImageCopy& strip, PixelFormat format) {
  return std::size_t{strip.imageExtent.width} * strip.imageExtent.height * bytesPerPixel(format);
}

/// Of the whole image, in the order of its texels: layer by layer, each with its mip levels.
std::vector<VkBufferImageCopy> allStrips(const ImageDescription& image) {
  std::vector<VkBufferImageCopy> all;
  for (unsigned layer = 0; layer < image.layers; ++layer)
    for (unsigned mip = 0; mip < image.mips; ++mip)
      std::ranges::copy(stripsOf(image, layer, mip), std::back_inserter(all));
  return all;
}

/// Strips that lie one behind the other in the staging buffer.
struct StagedStrips {
  std::vector<VkBufferImageCopy> strips{};
  std::size_t bytes = 0;
};

/// Strips in order, as many together as fit the staging buffer: a submission costs more than most
/// of them.
std::vector<StagedStrips> stagesOf(std::span<const VkBufferImageCopy> strips, PixelFormat format) {
  std::vector<StagedStrips> stages;
  for (VkBufferImageCopy strip : strips) {
    const std::size_t bytes = bytesOf(strip, format);
    if (stages.empty() || stages.back().bytes + bytes > kStagingBytes) stages.emplace_back();
    strip.bufferOffset = stages.back().bytes;
    stages.back().strips.push_back(strip);
    stages.back().bytes += bytes;
  }
  return stages;
}

VkSamplerAddressMode addressMode(SamplerDescription::Address address) {
  switch (address) {
    case SamplerDescription::Address::kClamp:
      return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    case SamplerDescription::Address::kRepeat:
      return VK_SAMPLER_ADDRESS_MODE_REPEAT;
    case SamplerDescription::Address::kMirror:
      return VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT;
  }
  return VK_SAMPLER_ADDRESS_MODE_MAX_ENUM;  // no such mode
}

}  // namespace

VkFormat vulkanFormat(PixelFormat format) { return formatOf(format).vulkan; }

VkFormatFeatureFlags formatFeatures(const Adapter& adapter, PixelFormat format) {
  VkFormatProperties properties{};
  vkGetPhysicalDeviceFormatProperties(adapter.handle, vulkanFormat(format), &properties);
  return properties.optimalTilingFeatures;
}

Image Device::makeImage(const ImageDescription& description, std::span<const std::byte> texels) {
  requireAlive();
  Image image;
  image.description = description;
  image.features = formatFeatures(adapter, description.format);
  const VkImageCreateInfo info = infoOf(description, image.features);
  requireSupported(adapter, description, info);
  VkImage made = VK_NULL_HANDLE;
  check(vkCreateImage(owner.handle, &info, nullptr, &made), "vkCreateImage");
  image.image = {owner, made};
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(owner.handle, made, &needs);
  image.memory = allocate(needs.size, memoryType(needs.memoryTypeBits, Memory::device));
  check(vkBindImageMemory(owner.handle, made, image.memory.get(), 0), "vkBindImageMemory");
  if (!texels.empty()) {
    upload(image, allStrips(description), texels, /*fresh=*/true);
  } else {
    toGeneralLayout(begin(), image);
    finish(kTransferLimit);
  }
  return image;
}

void Device::upload(const Image& to, std::span<const VkBufferImageCopy> strips,
                    std::span<const std::byte> texels, bool fresh) {
  for (const StagedStrips& stage : stagesOf(strips, to.description.format)) {
    std::memcpy(staging().mapped, texels.data(), stage.bytes);
    texels = texels.subspan(stage.bytes);
    const VkCommandBuffer commands = begin();
    if (fresh) toGeneralLayout(commands, to);
    fresh = false;
    vkCmdCopyBufferToImage(commands, staging().buffer.get(), to.image.get(),
                           VK_IMAGE_LAYOUT_GENERAL, static_cast<std::uint32_t>(stage.strips.size()),
                           stage.strips.data());
    finish(kTransferLimit);
  }
}

void Device::download(const Image& from, std::span<const VkBufferImageCopy> strips,
                      std::span<std::byte> texels) {
  for (const StagedStrips& stage : stagesOf(strips, from.description.format)) {
    const VkCommandBuffer commands = begin();
    vkCmdCopyImageToBuffer(commands, from.image.get(), VK_IMAGE_LAYOUT_GENERAL,
                           staging().buffer.get(), static_cast<std::uint32_t>(stage.strips.size()),
                           stage.strips.data());
    finish(kTransferLimit);
    std::memcpy(texels.data(), staging().mapped, stage.bytes);
    texels = texels.subspan(stage.bytes);
  }
}

void Device::upload(const Image& to, unsigned layer, unsigned mip,
                    std::span<const std::byte> rows) {
  requireAlive();
  upload(to, stripsOf(to.description, layer, mip), rows);
}

void Device::download(const Image& from, unsigned layer, unsigned mip, std::span<std::byte> rows) {
  requireAlive();
  download(from, stripsOf(from.description, layer, mip), rows);
}

void Device::download(const Image& from, std::span<std::byte> texels) {
  requireAlive();
  download(from, allStrips(from.description), texels);
}

/// Not vkCmdClearColorImage: it takes a colour, and conversion may lose the pattern's bits.
void Device::fill(const Image& image, const std::array<std::byte, 16>& pixel) {
  requireAlive();
  const ImageDescription& description = image.description;
  const std::size_t pixelBytes = bytesPerPixel(description.format);
  std::array<std::byte, 16> cell;  // whole pixels, since every pixel's size divides it
  for (std::size_t i = 0; i < cell.size(); ++i) cell[i] = pixel[i % pixelBytes];
  const std::size_t bytes = std::min(kStagingBytes, mipBytes(description, 0));
  for (std::size_t i = 0; i < bytes; i += cell.size())
    std::memcpy(staging().mapped + i, cell.data(), cell.size());

  const std::vector<VkBufferImageCopy> all = allStrips(description);
  const VkCommandBuffer commands = begin();
  vkCmdCopyBufferToImage(commands, staging().buffer.get(), image.image.get(),
                         VK_IMAGE_LAYOUT_GENERAL, static_cast<std::uint32_t>(all.size()),
                         all.data());
  finish(kTransferLimit);
}

VkImageView Device::viewOf(Image& image, const Image::View& wanted) {
  requireAlive();
  if (const auto found = image.views.find(wanted); found != image.views.end())
    return found->second.get();
  VkImageViewCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  info.image = image.image.get();
  info.viewType =
      wanted.layer < 0 ? viewType(image.description, wanted.asArray) : VK_IMAGE_VIEW_TYPE_2D;
  info.format = formatOf(image.description.format).vulkan;
  info.subresourceRange = {aspectOf(image.description.format), 0, VK_REMAINING_MIP_LEVELS, 0,
                           VK_REMAINING_ARRAY_LAYERS};
  if (wanted.mip >= 0) {
    info.subresourceRange.baseMipLevel = static_cast<std::uint32_t>(wanted.mip);
    info.subresourceRange.levelCount = 1;
  }
  if (wanted.layer >= 0) {
    info.subresourceRange.baseArrayLayer = static_cast<std::uint32_t>(wanted.layer);
    info.subresourceRange.layerCount = 1;
  }
  VkImageView made = VK_NULL_HANDLE;
  check(vkCreateImageView(owner.handle, &info, nullptr, &made), "vkCreateImageView");
  return image.views.emplace(wanted, OwnedImageView(owner, made)).first->second.get();
}

OwnedSampler Device::makeSampler(const SamplerDescription& description) {
  requireAlive();
  VkSamplerReductionModeCreateInfo reduction{};
  reduction.sType = VK_STRUCTURE_TYPE_SAMPLER_REDUCTION_MODE_CREATE_INFO;
  reduction.reductionMode = description.reduction == SamplerDescription::Reduction::kMin
                                ? VK_SAMPLER_REDUCTION_MODE_MIN
                                : VK_SAMPLER_REDUCTION_MODE_MAX;
  const bool reduces = description.reduction != SamplerDescription::Reduction::kAverage;
  if (reduces && !adapter.info.features.at("samplerFilterMinmax"))
    throw Unsupported(fmt::format("{} lacks samplerFilterMinmax", adapter.info.name));

  const VkFilter filter = description.linear ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
  VkSamplerCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  info.pNext = reduces ? &reduction : nullptr;
  info.magFilter = filter;
  info.minFilter = filter;
  info.mipmapMode =
      description.linearMips ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
  info.addressModeU = addressMode(description.address);
  info.addressModeV = info.addressModeU;
  info.addressModeW = info.addressModeU;
  info.compareEnable = description.compare ? VK_TRUE : VK_FALSE;
  info.compareOp = VK_COMPARE_OP_GREATER_OR_EQUAL;
  info.maxLod = VK_LOD_CLAMP_NONE;
  VkSampler made = VK_NULL_HANDLE;
  check(vkCreateSampler(owner.handle, &info, nullptr, &made), "vkCreateSampler");
  return {owner, made};
}

}  // namespace vulkan
}  // namespace gnomon
