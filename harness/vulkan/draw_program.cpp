// Graphics pipelines for dynamic rendering.
#include "harness/vulkan/internal.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <spirv_cross/spirv.hpp>

#include "harness/error.h"
#include "harness/program/spirv.h"

namespace gnomon::vulkan {
namespace {

constexpr std::size_t kMostColours = 4;  // every device has as many: maxColorAttachments

/// What a stage asks for beyond plain drawing.
struct DrawParameters {
  bool any = false;
  bool drawId = false;
};

DrawParameters parametersOf(const std::vector<std::uint32_t>& spirv) {
  DrawParameters found;
  const SpirvModule module = parseSpirv(spirv);
  for (const SpirvInstruction& instruction : module.instructions) {
    const auto words = module.wordsOf(instruction);
    if (instruction.opcode == spv::OpCapability && words[1] == spv::CapabilityDrawParameters)
      found.any = true;
    if (instruction.opcode == spv::OpDecorate && words[2] == spv::DecorationBuiltIn &&
        words[3] == spv::BuiltInDrawIndex)
      found.drawId = true;
  }
  return found;
}

void requireFeatures(const Adapter& adapter, const DrawParameters& parameters) {
  std::vector<std::string> wanted{"graphicsQueue", "dynamicRendering"};
  if (parameters.any) wanted.push_back("shaderDrawParameters");
  if (const auto why = adapter.info.lacks(wanted)) throw Unsupported(*why);
}

void requireColours(const Adapter& adapter, const std::vector<PixelFormat>& colours) {
  if (colours.size() > kMostColours)
    throw std::logic_error(
        fmt::format("{} colour targets; a program has at most {}", colours.size(), kMostColours));
  for (const PixelFormat format : colours) {
    if (format == PixelFormat::kD32) throw std::logic_error("a colour target of D32");
    if ((formatFeatures(adapter, format) & VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT) == 0)
      throw Unsupported(fmt::format("colour target of {} is not supported by {}", nameOf(format),
                                    adapter.info.name));
  }
}

/// Without one, nothing says how large the viewport is; and colours need a stage that makes them.
void requireSound(const DrawProgramDescription& description) {
  if (description.colours.empty() && !description.depth)
    throw std::logic_error("a program that draws to no target");
  if (!description.colours.empty() && description.fragment.empty())
    throw std::logic_error(
        fmt::format("{} colour targets and no fragment stage", description.colours.size()));
}

VkCompareOp compareOp(DrawProgramDescription::Compare compare) {
  switch (compare) {
    case DrawProgramDescription::Compare::kGreaterOrEqual:
      return VK_COMPARE_OP_GREATER_OR_EQUAL;
    case DrawProgramDescription::Compare::kEqual:
      return VK_COMPARE_OP_EQUAL;
    case DrawProgramDescription::Compare::kAlways:
      return VK_COMPARE_OP_ALWAYS;
  }
  return VK_COMPARE_OP_MAX_ENUM;  // no such comparison
}

VkCullModeFlags cullMode(DrawProgramDescription::Cull cull) {
  switch (cull) {
    case DrawProgramDescription::Cull::kNone:
      return VK_CULL_MODE_NONE;
    case DrawProgramDescription::Cull::kFront:
      return VK_CULL_MODE_FRONT_BIT;
    case DrawProgramDescription::Cull::kBack:
      return VK_CULL_MODE_BACK_BIT;
  }
  return VK_CULL_MODE_FLAG_BITS_MAX_ENUM;  // no such mode
}

/// The state between the stages, in structures that point at one another.
struct FixedFunction {
  VkPipelineVertexInputStateCreateInfo vertices{};
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  VkPipelineViewportStateCreateInfo viewport{};
  VkPipelineRasterizationStateCreateInfo raster{};
  VkPipelineMultisampleStateCreateInfo samples{};
  VkPipelineDepthStencilStateCreateInfo depth{};
  std::vector<VkPipelineColorBlendAttachmentState> blends;
  VkPipelineColorBlendStateCreateInfo blend{};
  std::array<VkDynamicState, 2> dynamics{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  VkPipelineDynamicStateCreateInfo dynamic{};
  std::vector<VkFormat> formats;
  VkPipelineRenderingCreateInfo rendering{};

  explicit FixedFunction(const DrawProgramDescription& description);
  FixedFunction(const FixedFunction&) = delete;
  FixedFunction& operator=(const FixedFunction&) = delete;

  void rasterize(const DrawProgramDescription& description);
  void test(const DrawProgramDescription& description);
  void target(const DrawProgramDescription& description);
  VkGraphicsPipelineCreateInfo info() const;
};

FixedFunction::FixedFunction(const DrawProgramDescription& description) {
  vertices.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
  viewport.viewportCount = 1;
  viewport.scissorCount = 1;
  samples.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
  dynamic.dynamicStateCount = static_cast<std::uint32_t>(dynamics.size());
  dynamic.pDynamicStates = dynamics.data();
  rasterize(description);
  test(description);
  target(description);
}

void FixedFunction::rasterize(const DrawProgramDescription& description) {
  raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = cullMode(description.cull);
  raster.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  raster.depthBiasEnable = description.depthBiasConstant != 0 || description.depthBiasSlope != 0;
  raster.depthBiasConstantFactor = description.depthBiasConstant;
  raster.depthBiasSlopeFactor = description.depthBiasSlope;
  raster.lineWidth = 1;
}

void FixedFunction::test(const DrawProgramDescription& description) {
  depth.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
  depth.depthTestEnable = description.depth;
  depth.depthWriteEnable = description.depth && description.depthWrite;
  depth.depthCompareOp = compareOp(description.compare);
}

void FixedFunction::target(const DrawProgramDescription& description) {
  constexpr VkColorComponentFlags kAll = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT |
                                         VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  VkPipelineColorBlendAttachmentState overwrite{};
  overwrite.colorWriteMask = kAll;
  blends.assign(description.colours.size(), overwrite);
  blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
  blend.attachmentCount = static_cast<std::uint32_t>(blends.size());
  blend.pAttachments = blends.data();
  for (const PixelFormat format : description.colours) formats.push_back(vulkanFormat(format));
  rendering.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO;
  rendering.colorAttachmentCount = static_cast<std::uint32_t>(formats.size());
  rendering.pColorAttachmentFormats = formats.data();
  if (description.depth) rendering.depthAttachmentFormat = vulkanFormat(PixelFormat::kD32);
}

VkGraphicsPipelineCreateInfo FixedFunction::info() const {
  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  info.pNext = &rendering;
  info.pVertexInputState = &vertices;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.pDynamicState = &dynamic;
  return info;
}

OwnedPipeline makePipeline(Device& device, const DrawProgramDescription& description,
                           VkPipelineLayout layout) {
  const ShaderStage vertex(device, VK_SHADER_STAGE_VERTEX_BIT, description.vertex,
                           description.vertexEntry, description.specialization);
  std::vector<VkPipelineShaderStageCreateInfo> stages{vertex.info()};
  std::optional<ShaderStage> fragment;
  if (!description.fragment.empty()) {
    fragment.emplace(device, VK_SHADER_STAGE_FRAGMENT_BIT, description.fragment,
                     description.fragmentEntry, description.specialization);
    stages.push_back(fragment->info());
  }
  const FixedFunction fixed(description);
  VkGraphicsPipelineCreateInfo info = fixed.info();
  info.stageCount = static_cast<std::uint32_t>(stages.size());
  info.pStages = stages.data();
  info.layout = layout;
  VkPipeline made = VK_NULL_HANDLE;
  device.check(
      vkCreateGraphicsPipelines(device.owner.handle, VK_NULL_HANDLE, 1, &info, nullptr, &made),
      "vkCreateGraphicsPipelines");
  return {device.owner, made};
}

}  // namespace

DrawProgram makeDrawProgram(std::shared_ptr<Device> device,
                            const DrawProgramDescription& description) {
  requireSound(description);
  const DrawParameters parameters = parametersOf(description.vertex);
  requireFeatures(device->adapter, parameters);
  requireColours(device->adapter, description.colours);
  DrawProgram drawn;
  drawn.program = withoutPipeline(device, description.slots, description.pushBytes,
                                  VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT);
  drawn.program.pipeline = makePipeline(*device, description, drawn.program.layout.get());
  drawn.colours = description.colours;
  drawn.depth = description.depth;
  drawn.readsDrawId = parameters.drawId;
  return drawn;
}

}  // namespace gnomon::vulkan
