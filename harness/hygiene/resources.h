// A stimulus on the device: buffers with guard bands, images, and the dispatch that binds them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "harness/hygiene/stimulus.h"
#include "harness/hygiene/subject.h"
#include "reference/bound/storage.h"

namespace gnomon {

using Bytes = std::vector<std::byte>;

/// What output images are made of.
enum class Target {
  kContract,  ///< the record's format
  kFloat,  ///< 32-bit floats, so that arithmetic is seen before a narrow format rounds and clamps
};

/// Whether the format keeps less than a 32-bit float does.
bool isNarrow(PixelFormat format);

/// What becomes of a channel of that format.
Storage storageOf(PixelFormat format);

/// What an observation calls the copy of an image that was stored in its narrow format:
/// "target as RGBA8".
std::string narrowName(const ImageSpec& image);

/// One output. Downloaded it is 32-bit scalars in the order of its layout; a buffer brings a guard
/// band before and behind its elements along.
struct Output {
  std::string name{};
  Struct layout{};
  std::size_t elements = 0;
  unsigned width = 0;      ///< pixels in a row; 0: a buffer
  std::size_t before = 0;  ///< bytes of the leading guard, aligned for binding
  GpuBuffer buffer{};
  GpuImage image{};

  bool isImage() const { return width > 0; }
  std::size_t dataBytes() const { return elements * layout.size; }
  /// What a word of an unwritten element reads as after a fill with the pattern.
  std::uint32_t poisoned(std::uint32_t pattern, std::size_t word) const;
  /// "results[12]" or "target(3, 5)".
  std::string place(std::size_t element) const;
};

/// One input buffer: its bytes, then a guard band.
struct Input {
  const BufferSpec* spec = nullptr;
  std::span<const std::byte> bytes{};
  GpuBuffer buffer{};
};

class Resources {
 public:
  /// Allocates; throws what Gpu::allocate and Gpu::allocateImage throw, and std::logic_error where
  /// an input image does not have the bytes that its description asks for.
  Resources(const Subject& subject, const Stimulus& stimulus, Target target);

  /// Inputs as the stimulus has them, each followed by a guard band of this pattern.
  void upload(std::uint32_t guard);

  /// Fills every output, guards included, with the pattern and runs the program once. Returns the
  /// outputs, guards included, in the order of outputs().
  std::vector<Bytes> run(const GpuProgram& program, std::uint32_t poison);

  /// Seconds on the device that one run takes, outputs left as they are.
  double time(const GpuProgram& program);

  const std::vector<Input>& inputs() const { return in; }
  const std::vector<Output>& outputs() const { return out; }
  Bytes download(const Input& input) const;
  /// Of all that the contract names, each once: the least that has to move.
  std::size_t bytes() const { return traffic; }

 private:
  void addInput(const InputBytes& input);
  void addOutput(const OutputCount& output);
  void addInputImage(const InputImage& input);
  void addOutputImage(const OutputImage& output, Target target);
  void bind();
  Bytes download(const Output& output) const;

  Gpu& gpu;
  const KernelRecord& record;
  const Stimulus& stimulus;
  std::vector<Input> in;
  std::vector<Output> out;
  std::vector<GpuImage> inImages;
  std::map<std::string, GpuSampler> samplers;  ///< by the name of the binding
  Dispatch dispatch;
  std::size_t traffic = 0;
};

}  // namespace gnomon
