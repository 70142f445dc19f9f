// tonemap/resolve over a frame with half-size bloom: every curve, as sRGB. Memory-bound on a GPU.
#include "bench/timing.h"
#include "tests/tonemap/frames.h"

namespace gnomon::tonemap {
namespace {

void resolveFrame(benchmark::State& state, uint curve, const uvec2& size) {
  Frame frame = bulk(size, 1);
  frame.push.curve = curve;
  frame.push.transfer = kSrgb;
  const HalfImage hdr("hdr", frame.hdr), bloom("bloom", frame.bloom);
  timeKernel(state, "tonemap/resolve",
             {.inputImages = {hdr.input(), bloom.input()},
              .outputImages = {{"target", size.x, size.y}},
              .push = std::as_bytes(std::span(&frame.push, 1)),
              .extent = {size.x, size.y}});
}

void add(const char* name, uint curve, const uvec2& size) {
  timed(benchmark::RegisterBenchmark(
      name, [=](benchmark::State& state) { resolveFrame(state, curve, size); }));
}

const bool registered = [] {
  add("tonemap/resolve/reinhard/1920x1080", kReinhard, {1920, 1080});
  add("tonemap/resolve/narkowicz/1920x1080", kNarkowicz, {1920, 1080});
  add("tonemap/resolve/hill/1920x1080", kHill, {1920, 1080});
  add("tonemap/resolve/hill/3840x2160", kHill, {3840, 2160});
  return true;
}();

}  // namespace
}  // namespace gnomon::tonemap
