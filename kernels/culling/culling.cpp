// Host side of stage culling: the lists.
#include "culling.h"

#include <algorithm>

#include "harness/program/kernel.h"

namespace gnomon::culling {
namespace {

Struct camera() {
  return describe<Camera>(
      "Camera", field("view", &Camera::view), field("projection", &Camera::projection),
      field("viewProjection", &Camera::viewProjection), field("left", &Camera::left),
      field("right", &Camera::right), field("bottom", &Camera::bottom), field("top", &Camera::top),
      field("nearPlane", &Camera::nearPlane), field("farPlane", &Camera::farPlane),
      field("near", &Camera::near));
}

Struct bounds() {
  return describe<Bounds>("Bounds", field("centre", &Bounds::centre),
                          field("radius", &Bounds::radius));
}

Struct draw() {
  return describe<DrawCommand>("DrawCommand", field("indexCount", &DrawCommand::indexCount),
                               field("instanceCount", &DrawCommand::instanceCount),
                               field("firstIndex", &DrawCommand::firstIndex),
                               field("vertexOffset", &DrawCommand::vertexOffset),
                               field("firstInstance", &DrawCommand::firstInstance));
}

Struct tally() {
  return describe<Tally>("Tally", field("tested", &Tally::tested), field("total", &Tally::total),
                         field("listed", &Tally::listed), field("overflowed", &Tally::overflowed),
                         varyingField("recounted", &Tally::recounted));
}

struct Word {
  uint value;
};

std::array<uint, 3> aGroupForEveryBlock(const Extent& candidates) {
  const auto blocks = static_cast<uint>((candidates.count() + kBlock - 1) / kBlock);
  return {std::max(blocks, 1u), 1, 1};
}

/// What both have, and where the candidates' draws come from.
KernelRecord lister(std::string entry, const char* source, unsigned sourceBinding) {
  KernelRecord record{};
  record.order = 3;
  record.stage = "culling";
  record.entry = std::move(entry);
  record.file = "culling/" + record.entry + ".comp";
  record.buffers = {
      {.name = "camera", .binding = kCamera, .element = camera()},
      {.name = "bounds", .binding = kBounds, .element = bounds()},
      {.name = source, .binding = sourceBinding, .element = draw()},
      {.name = "draws", .binding = kDraws, .access = Access::kWrite, .element = draw()},
      {.name = "tally", .binding = kTally, .access = Access::kWrite, .element = tally()},
      {.name = "scratch",
       .binding = kScratch,
       .access = Access::kScratch,
       .element = describe<Word>("Word", field("value", &Word::value))}};
  record.lists = {{.name = "visible",
                   .records = "draws",
                   .id = "firstInstance",
                   .source = source,
                   .tally = "tally",
                   .total = "total",
                   .length = "listed",
                   .overflowed = "overflowed"}};
  record.grid = aGroupForEveryBlock;
  record.features = {"scalarBlockLayout"};
  record.conventions = {{"keeps", {"exact", "more"}}};
  return record;
}

KernelRecord frustum(std::string entry) {
  KernelRecord record = lister(std::move(entry), "commands", kCommands);
  record.lists[0].numbered = true;
  record.push = describe<Frustum>(
      "Frustum", field("count", &Frustum::count), field("capacity", &Frustum::capacity),
      field("noNearPlane", &Frustum::noNearPlane), field("pad", &Frustum::pad),
      field("patience", &Frustum::patience));
  record.summary = "spheres against the planes of a frustum; draws of what is visible, compacted";
  return record;
}

KernelRecord occlusion(std::string entry) {
  KernelRecord record = lister(std::move(entry), "survivors", kSurvivors);
  record.buffers.push_back({.name = "found", .binding = kFound, .element = tally()});
  record.images = {
      {.name = "depth", .binding = kDepth, .type = "texture2D", .format = PixelFormat::kD32},
      {.name = "pyramid", .binding = kPyramid, .type = "texture2D", .format = PixelFormat::kR32f}};
  record.push = describe<Occlusion>(
      "Occlusion", field("size", &Occlusion::size), field("objects", &Occlusion::objects),
      field("candidates", &Occlusion::candidates), field("capacity", &Occlusion::capacity),
      field("pad", &Occlusion::pad), field("patience", &Occlusion::patience));
  record.ownCode = {"culling/occlusion.glsl"};
  record.summary = "spheres against the pyramid of depths; draws of what is not hidden, compacted";
  return record;
}

/// The other path to the same contract. Of its own it has how counts are summed, in both alike.
KernelRecord withSubgroups(KernelRecord record) {
  record.ownCode = {"culling/compact.glsl:askOthers"};
  record.features.emplace_back("subgroupArithmetic");
  record.summary = "the same with subgroup operations";
  return record;
}

const bool registered = registerKernel(frustum("frustum")) &&
                        registerKernel(withSubgroups(frustum("frustum_subgroups"))) &&
                        registerKernel(occlusion("occlusion")) &&
                        registerKernel(withSubgroups(occlusion("occlusion_subgroups")));

}  // namespace
}  // namespace gnomon::culling
