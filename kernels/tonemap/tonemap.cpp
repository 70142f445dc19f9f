// Host side of stage tonemap.
#include "tonemap.h"

#include "harness/program/kernel.h"

namespace gnomon::tonemap {
namespace {

const bool registered = registerKernel({
    .order = 2,
    .stage = "tonemap",
    .entry = "resolve",
    .file = "tonemap/resolve.comp",
    .images = {{.name = "hdr",
                .binding = kHdr,
                .access = Access::kRead,
                .type = "texture2D",
                .format = PixelFormat::kRgba16f},
               {.name = "bloom",
                .binding = kBloom,
                .access = Access::kRead,
                .type = "texture2D",
                .format = PixelFormat::kRgba16f},
               {.name = "target",
                .binding = kTarget,
                .access = Access::kWrite,
                .type = "image2D",
                .format = PixelFormat::kRgba8}},
    .push = describe<Resolve>(
        "Resolve", field("size", &Resolve::size), field("exposure", &Resolve::exposure),
        field("bloomIntensity", &Resolve::bloomIntensity), field("curve", &Resolve::curve),
        field("transfer", &Resolve::transfer)),
    .features = {"scalarBlockLayout", "shaderStorageImageWriteWithoutFormat"},
    .deterministic = true,
    .conventions = {{"y", {"down", "up"}}},
    .functions = {.file = "tonemap/resolve.functions.glsl",
                  .slots = {{.name = "curve", .push = "curve"},
                            {.name = "transfer", .push = "transfer"}}},
    .probes = describe<ResolveProbes>(
        "ResolveProbes", field("hdr", &ResolveProbes::hdr), field("bloom", &ResolveProbes::bloom),
        field("scene", &ResolveProbes::scene), field("exposed", &ResolveProbes::exposed),
        field("curved", &ResolveProbes::curved), field("display", &ResolveProbes::display)),
    .summary = "bloom, exposure, tone curve and transfer function of an HDR frame",
});

}  // namespace
}  // namespace gnomon::tonemap
