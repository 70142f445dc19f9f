// Host side of the pyramid of stage culling.
#include "culling.h"

#include <algorithm>

#include "harness/program/kernel.h"

namespace gnomon::culling {
namespace {

/// Groups that make a texel of level kHizTile each.
uint tilesOf(std::size_t side) { return std::max(1u, static_cast<uint>(side) >> kHizTile); }

struct ScratchWord {
  uint value;
};

const bool whole = registerKernel({
    .order = 3,
    .stage = "culling",
    .entry = "hiz",
    .file = "culling/hiz.comp",
    .buffers = {{.name = "scratch",
                 .binding = kHizScratch,
                 .access = Access::kScratch,
                 .element = describe<ScratchWord>("uint", field("value", &ScratchWord::value))}},
    .images =
        {{.name = "depth",
          .binding = kHizDepth,
          .access = Access::kRead,
          .type = "texture2D",
          .format = PixelFormat::kD32},
         {.name = "nearest", .binding = kHizNearest, .access = Access::kRead, .type = "sampler"},
         {.name = "levels",
          .binding = kHizLevels,
          .access = Access::kWrite,
          .type = "image2D",
          .format = PixelFormat::kR32f,
          .descriptors = kMaxLevels}},
    .push = describe<Hiz>("Hiz", field("size", &Hiz::size)),
    .grid = [](const Extent& depth) -> std::array<uint, 3> {
      return {tilesOf(depth.width), tilesOf(depth.height), 1};
    },
    .features = {"scalarBlockLayout", "shaderStorageImageWriteWithoutFormat"},
    .conventions = {{"lookup", {"pinned", "next_pow2", "previous_pow2", "fold3"}}},
    .summary = "the pyramid of farthest depths, all levels in one dispatch",
});

const bool level = registerKernel({
    .order = 3,
    .stage = "culling",
    .entry = "hiz_level",
    .file = "culling/hiz_level.comp",
    .images = {{.name = "parent",
                .binding = kHizParent,
                .access = Access::kRead,
                .type = "texture2D",
                .format = PixelFormat::kD32},
               {.name = "level",
                .binding = kHizLevel,
                .access = Access::kWrite,
                .type = "image2D",
                .format = PixelFormat::kR32f}},
    .push = describe<HizLevel>("HizLevel", field("size", &HizLevel::size)),
    .features = {"scalarBlockLayout", "shaderStorageImageWriteWithoutFormat"},
    .conventions = {{"lookup", {"pinned", "next_pow2", "previous_pow2", "fold3"}}},
    .summary = "one level of the pyramid of farthest depths, from the one before it",
});

}  // namespace
}  // namespace gnomon::culling
