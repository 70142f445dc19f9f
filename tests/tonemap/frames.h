// Stimulus of stage tonemap: named domains, each with what it is for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "harness/cases/kernel_case.h"
#include "kernels/tonemap/tonemap.h"

namespace gnomon::tonemap {

struct Frame {
  Resolve push;
  Picture hdr, bloom;
};

/// Colours between lo and hi, log-uniform, a third of them grey and a third with one component
/// alone; bloom of any size, a tenth as bright; exposure at EV -2 to 2, not a power of two.
Frame between(double lo, double hi, const uvec2& size, const uvec2& bloomSize, std::uint64_t seed);

/// Ordinary light: 0.01 to 16, where every curve bends.
Frame bulk(const uvec2& size, std::uint64_t seed);

/// 1e-5 to 0.02: both pieces of sRGB, and the root of Hill's fit at 0.0033.
Frame shadows(const uvec2& size, std::uint64_t seed);

/// 16 to 65504 at EV 0 to 16, up to the contract's limit: shoulders and saturation.
Frame highlights(const uvec2& size, std::uint64_t seed);

/// Every special value that floats have in one component of hdr, and another in one of bloom, in an
/// otherwise ordinary pixel.
Frame degenerate();

/// Grey at the ends of the transfer functions' pieces, at their neighbours in float, and 9e-5 of
/// them away, as it stands: no bloom, exposure 1.
Frame thresholds();

/// A picture of an OpenEXR file's R, G and B, alpha 1.
Picture load(const std::filesystem::path& file);

/// Half as wide and high, every texel the mean of four, times `scale`: stands for bloom.
Picture halved(const Picture& picture, float scale);

/// The parts of a frame, for whoever shrinks and replays it, and whether the contract admits its
/// push constants.
void parts(Parts& p, Frame& frame);
bool admits(const Frame& frame);

/// One pixel in words, a line for each input.
std::string describe(const Frame& frame, std::size_t pixel);

}  // namespace gnomon::tonemap
