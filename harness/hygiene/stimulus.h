// What a kernel is given to do: inputs by name, how much of each output there is to write.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "harness/program/kernel.h"

namespace gnomon {

struct InputBytes {
  std::string buffer{};
  std::span<const std::byte> bytes{};
};

struct OutputCount {
  std::string buffer{};
  std::size_t elements = 0;
  bool list = false;  ///< elements beyond what the kernel lists stay as they are
};

/// Any format will do that a kernel can read: a frame's, or 32-bit floats for exact stimulus.
struct InputImage {
  std::string image{};
  ImageDescription description{};
  /// Layer by layer, each with its mip levels from the largest on, rows tight.
  std::span<const std::byte> texels{};
};

/// Of the record's format; one mip level.
struct OutputImage {
  std::string image{};
  unsigned width = 1, height = 1, layers = 1;
  /// Pixels that the image is wider and higher than what is to be written: they stay as they are.
  /// Of an image without layers; left out where a foreign kernel counts rows from below.
  unsigned beyond = 0;
};

struct Stimulus {
  std::vector<InputBytes> inputs{};
  std::vector<OutputCount> outputs{};
  std::vector<OutputCount> scratch{};
  std::vector<InputImage> inputImages{};
  std::vector<OutputImage> outputImages{};
  std::span<const std::byte> push{};
  Extent extent{};  ///< for the grid
  std::chrono::milliseconds limit{60'000};
};

/// A stimulus with bytes of its own, which may outlive whoever made it.
class KeptStimulus {
 public:
  explicit KeptStimulus(const Stimulus& given);
  KeptStimulus(const KeptStimulus&) = delete;
  KeptStimulus& operator=(const KeptStimulus&) = delete;
  const Stimulus& get() const { return stimulus; }

 private:
  std::span<const std::byte> keep(std::span<const std::byte> bytes);

  Stimulus stimulus;
  std::vector<std::vector<std::byte>> kept{};
};

}  // namespace gnomon
