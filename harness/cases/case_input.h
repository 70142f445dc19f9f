// What a generated case gives a kernel, whatever the stage calls it: push constants, buffers and
// pictures by the contract's names. What can be shrunk, shown, written to a file and replayed.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/cases/picture.h"
#include "harness/hygiene/pack.h"
#include "harness/program/kernel.h"

namespace gnomon {

struct CaseInput {
  /// Elements of one contract struct.
  struct Block {
    std::string name{};
    Struct layout{};
    Bytes bytes{};

    std::size_t elements() const { return layout.size == 0 ? 0 : bytes.size() / layout.size; }
    std::span<std::byte> element(std::size_t i) {
      return std::span(bytes).subspan(i * layout.size, layout.size);
    }
    std::span<const std::byte> element(std::size_t i) const {
      return std::span(bytes).subspan(i * layout.size, layout.size);
    }
  };
  struct Image {
    std::string name{};
    Picture picture{};
    bool ofExtent = false;  ///< as large as the grid: all of these have one size
  };

  std::optional<Block> push{};  ///< of one element
  std::vector<Block> buffers{};
  std::vector<Image> images{};
  uvec2 focus{0, 0};  ///< the element (x) or pixel that fails: a hint for whoever makes it smaller

  /// 32-bit numbers in all buffers and images.
  std::size_t numbers() const;
};

/// To the bit, but for the focus.
bool operator==(const CaseInput& a, const CaseInput& b);

/// Where a stage names the parts of its input:
///   void parts(Parts& p, Frame& f) {
///     p.push(f.push);
///     p.extent(f.push.size);
///     p.imageOfExtent("hdr", f.hdr);
///     p.image("bloom", f.bloom);
///   }
class Parts {
 public:
  virtual ~Parts() = default;

  template <class Constants>
  void push(Constants& constants) {
    pushBytes(std::as_writable_bytes(std::span(&constants, 1)));
  }

  /// Elements of an input buffer, in any number.
  template <class Element>
  void elements(const std::string& buffer, std::vector<Element>& all) {
    bufferBytes(buffer, all.size() * sizeof(Element), [&all](std::size_t bytes) {
      all.resize(bytes / sizeof(Element));
      return std::as_writable_bytes(std::span(all));
    });
  }

  /// An input image of any size.
  void image(const std::string& name, Picture& picture) { anyImage(name, picture, false); }
  /// One that is as large as the grid.
  void imageOfExtent(const std::string& name, Picture& picture) { anyImage(name, picture, true); }
  /// What follows from the size of those; named after them and after push().
  virtual void extent(uvec2& size) = 0;
  /// What follows from the number of elements of a buffer; named after it and after push().
  virtual void count(uint& elements, const std::string& buffer) = 0;

 protected:
  virtual void pushBytes(std::span<std::byte> constants) = 0;
  virtual void bufferBytes(const std::string& buffer, std::size_t bytes,
                           const std::function<std::span<std::byte>(std::size_t)>& resized) = 0;
  virtual void anyImage(const std::string& name, Picture& picture, bool ofExtent) = 0;
};

using NameParts = std::function<void(Parts&)>;

/// The parts as they are.
CaseInput gather(const KernelRecord& record, const NameParts& named);

/// Puts them back, with what follows from their sizes. Nothing, or what does not fit: "it has no
/// buffer 'lights'", "'hdr' and 'depth' differ in size".
std::optional<std::string> scatter(const CaseInput& input, const NameParts& named);

/// Every number, a line for each field or texel; of what is large, the size and the first ones.
std::string inWords(const CaseInput& input);

/// "1 element of 'samples'", "hdr of 1 x 1, bloom of 2 x 1".
std::string sizeInWords(const CaseInput& input);

/// One number so that it reads back as the same bits: "0.004", "-0.0", "NaN 0x7fc00000".
std::string exactly(float x);

}  // namespace gnomon
