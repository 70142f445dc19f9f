// Host side of the pyramid of stage culling.
#include "culling.h"

#include "harness/program/kernel.h"

namespace gnomon::culling {
namespace {

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
