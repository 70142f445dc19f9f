// Host side of stage post.
#include "post.h"

#include "harness/program/kernel.h"

namespace gnomon::post {
namespace {

ImageSpec gbuffer(const char* name, uint binding, PixelFormat format) {
  return {.name = name,
          .binding = binding,
          .access = Access::kRead,
          .type = "texture2D",
          .format = format,
          .meaning = format == PixelFormat::kD32 ? "depth" : ""};
}

const bool registered = registerKernel({
    .order = 12,
    .stage = "post",
    .entry = "views",
    .file = "post/views.comp",
    .images = {gbuffer("albedo", kAlbedoImage, PixelFormat::kRgba8),
               gbuffer("normal", kNormalImage, PixelFormat::kRgba16f),
               gbuffer("depth", kDepthImage, PixelFormat::kD32),
               {.name = "target",
                .binding = kTarget,
                .access = Access::kWrite,
                .type = "image2D",
                .format = PixelFormat::kRgba8}},
    .push = describe<Views>("Views", field("size", &Views::size), field("mode", &Views::mode),
                            field("near", &Views::near), field("far", &Views::far),
                            field("splits", &Views::splits)),
    .features = {"scalarBlockLayout", "shaderStorageImageWriteWithoutFormat"},
    .deterministic = true,
    .conventions = {{"y", {"down", "up"}}, {"depth", {"reverse", "standard"}}},
    .probes = describe<ViewsProbes>(
        "ViewsProbes", field("depth", &ViewsProbes::depth, "depth"),
        field("albedo", &ViewsProbes::albedo), field("distance", &ViewsProbes::distance),
        field("cascade", &ViewsProbes::cascade), field("blendStart", &ViewsProbes::blendStart),
        field("tinted", &ViewsProbes::tinted), field("shown", &ViewsProbes::shown)),
    .summary = "debug views: albedo, normal, depth, shadow cascades",
});

}  // namespace
}  // namespace gnomon::post
