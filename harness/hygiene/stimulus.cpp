#include "harness/hygiene/stimulus.h"

namespace gnomon {

KeptStimulus::KeptStimulus(const Stimulus& given) : stimulus(given) {
  for (InputBytes& i : stimulus.inputs) i.bytes = keep(i.bytes);
  for (InputImage& i : stimulus.inputImages) i.texels = keep(i.texels);
  stimulus.push = keep(stimulus.push);
}

// What a vector holds stays where it is when the vector moves.
std::span<const std::byte> KeptStimulus::keep(std::span<const std::byte> bytes) {
  return kept.emplace_back(bytes.begin(), bytes.end());
}

}  // namespace gnomon
