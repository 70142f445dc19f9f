// A stimulus on the device: buffers with guard bands, images, and the dispatch that binds them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "harness/hygiene/pack.h"
#include "harness/hygiene/stimulus.h"
#include "harness/hygiene/subject.h"
#include "reference/bound/storage.h"

namespace gnomon {

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

/// One output of the contract: 32-bit scalars in the order of its layout.
struct Output {
  std::string name{};
  Struct layout{};
  std::size_t elements = 0;
  unsigned width = 0;  ///< pixels in a row of the largest level; 0: a buffer
  GpuImage image{};
  std::string meaning{};      ///< as ImageSpec's
  std::vector<bool> given{};  ///< by word of an element: whether the module gives it at all

  bool list = false;  ///< a buffer that need not be written to its end

  bool isImage() const { return width > 0; }
  std::size_t dataBytes() const { return elements * layout.size; }
  /// What a word of an unwritten element reads as after a fill with the pattern.
  std::uint32_t poisoned(std::uint32_t pattern, std::size_t word) const;
  /// "results[12]" or "target(3, 5)"; of an image with layers "target(3, 5, 1)", of one with mip
  /// levels "target level 1 (3, 5)".
  std::string place(std::size_t element) const;
};

/// What one run left behind.
struct Aftermath {
  std::vector<Bytes> outputs{};       ///< as Resources::outputs(); what is not given is 0
  std::vector<std::string> strays{};  ///< "wrote past the end of 'results': byte 0 after its ..."
};

class Resources {
 public:
  /// Allocates; throws what Gpu::allocate and Gpu::allocateImage throw, and std::logic_error where
  /// an input image does not have the bytes that its description asks for.
  Resources(const Subject& subject, const Stimulus& stimulus, Target target);

  /// Inputs as the stimulus has them, each followed by a guard band of NaN; scratch as zeros.
  void upload();

  /// Fills every output, guards included, with the pattern and runs the program once.
  Aftermath run(const GpuProgram& program, std::uint32_t poison);

  /// Inputs that are no longer what was uploaded: "wrote into its input, at samples[3].normal".
  std::vector<std::string> changedInputs() const;

  /// Seconds on the device that one run takes, outputs left as they are; not counting what runs
  /// before it in the same submission.
  double time(const GpuProgram& program, std::span<const Dispatch> before = {});

  const std::vector<Output>& outputs() const { return out; }
  /// Of all that the contract names, each once: the least that has to move.
  std::size_t bytes() const { return traffic; }

 private:
  /// One of the module's buffers: guard, content, guard.
  struct Memory {
    const ModuleBuffer* spec = nullptr;
    bool scratch = false;
    std::size_t elements = 0;
    Bytes content{};  ///< what a run starts from; empty where that is all poison
    std::vector<std::size_t>
        open{};  ///< bytes in content: words of outputs that nothing is given for
    std::vector<std::size_t> kept{};  ///< words of inputs that are no outputs
    std::size_t size = 0, before = 0, after = 0;
    GpuBuffer buffer{};
  };

  void layOut();
  void layOutScratch();
  void packInputs();
  void packParameters();
  void allocate();
  void markSharedWords();
  void addInputImage(const InputImage& input);
  void addOutputImage(const OutputImage& output, Target target);
  void bind();
  void bindImages();
  /// Its texels in the conventions of the module.
  Bytes inConvention(const InputImage& input) const;
  void poisonImages(std::uint32_t poison);
  void poisonOutputs(std::uint32_t poison);
  void checkGuards(const Memory& memory, const Bytes& whole, std::uint32_t poison,
                   std::vector<std::string>& strays) const;
  void checkKept(const Memory& memory, const Bytes& whole, std::vector<std::string>& strays) const;
  void checkScratch(const Memory& memory, const Bytes& whole,
                    std::vector<std::string>& strays) const;
  Bytes unpacked(const Output& output, const std::vector<Bytes>& memories) const;
  Bytes downloadImage(const Output& output) const;
  /// The part of an image that is to be written; what is beyond it has to be poison still.
  Bytes cropped(const Output& output, Bytes texels, std::uint32_t poison,
                std::vector<std::string>& strays) const;
  /// Of a word that is no output, in the contract's names.
  std::string wordPlace(const Memory& memory, std::size_t byte) const;

  Gpu& gpu;
  const KernelRecord& record;
  const Interface& interface;
  const Conventions& conventions;
  const Stimulus& stimulus;
  const std::string& origin;
  std::vector<Memory> memories;  ///< as Interface::buffers
  std::vector<Output> out;
  std::vector<GpuImage> inImages;
  std::map<std::string, GpuSampler> samplers;  ///< by the contract's name
  GpuSampler ownSampler;                       ///< of a module that brings one
  Dispatch dispatch;
  std::size_t traffic = 0;
};

}  // namespace gnomon
