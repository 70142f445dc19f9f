// The host-side record of a kernel: the one place from which tests, bench, mutate, watch and frame
// learn its files, bindings, grid and needs. kernels/<stage>/<stage>.cpp registers them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "harness/vulkan/gpu.h"
#include "kernels/contract.h"

namespace gnomon {

enum class ScalarType { kFloat, kUint, kInt };

/// A member of a contract struct as the C++ compiler lays it out.
struct Field {
  std::string name{};
  std::string type{};  ///< GLSL spelling: "vec3"
  ScalarType scalar = ScalarType::kFloat;
  unsigned offset = 0;      ///< bytes
  unsigned scalars = 0;     ///< number of 32-bit scalars
  bool signOfZero = false;  ///< the contract fixes the sign of a zero
  std::string meaning{};    ///< what a convention may change: "roughness", "depth"
  bool varies = false;      ///< from run to run: judged, but two runs need not agree on it

  /// Of one of its scalars: "D", "F.y", "view[12]".
  std::string scalarName(unsigned component) const;
};

/// A contract struct, described once so that reflection can be held against it.
struct Struct {
  std::string name{};
  unsigned size = 0;  ///< bytes
  std::vector<Field> fields{};

  /// Number of 32-bit scalars of all fields.
  unsigned scalars() const;
};

/// Describes a struct from its member pointers: describe<Shaded>("Shaded", field("D", &Shaded::D)).
template <class S, class M>
struct FieldOf {
  std::string name{};
  M S::*member;
  bool signOfZero = false;
  std::string meaning{};
  bool varies = false;
};

template <class S, class M>
FieldOf<S, M> field(std::string name, M S::*member) {
  return {std::move(name), member};
}

/// A field that means something which kernels express in several ways (Field::meaning).
template <class S, class M>
FieldOf<S, M> field(std::string name, M S::*member, std::string meaning) {
  return {std::move(name), member, false, std::move(meaning)};
}

/// The GLSL spelling and scalar type of a member: float, uint, int, vectors and matrices of them.
template <class M>
Field typeOfMember();

/// A field that depends on timing (Field::varies).
template <class S, class M>
FieldOf<S, M> varyingField(std::string name, M S::*member) {
  return {.name = std::move(name), .member = member, .varies = true};
}

template <class S, class... M>
Struct describe(std::string name, FieldOf<S, M>... members) {
  Struct result{std::move(name), sizeof(S), {}};
  const S object{};
  auto add = [&](const auto& m) {
    Field f = typeOfMember<std::remove_cvref_t<decltype(object.*m.member)>>();
    f.name = m.name;
    f.signOfZero = m.signOfZero;
    f.meaning = m.meaning;
    f.varies = m.varies;
    f.offset = static_cast<unsigned>(reinterpret_cast<const std::byte*>(&(object.*m.member)) -
                                     reinterpret_cast<const std::byte*>(&object));
    result.fields.push_back(std::move(f));
  };
  (add(members), ...);
  return result;
}

enum class Access {
  kRead,
  kWrite,
  /// Memory of a kernel's own, which it reads and writes: zero before a dispatch, and zero again
  /// after it, for the next frame starts from there. No output.
  kScratch,
};

/// A storage buffer whose elements are one contract struct.
struct BufferSpec {
  std::string name{};  ///< the GLSL variable
  unsigned binding = 0;
  Access access = Access::kRead;
  Struct element;
};

/// An image that a kernel reads (fetching or sampling) or writes.
struct ImageSpec {
  std::string name{};  ///< the GLSL variable
  unsigned binding = 0;
  Access access = Access::kRead;
  /// GLSL spelling: "texture2D", "sampler2DArray", "image2D"; "sampler" is one without an image.
  std::string type{};
  PixelFormat format = PixelFormat::kRgba8;  ///< of it in a frame
  SamplerDescription sampler{};              ///< where the type begins with "sampler"
  std::string meaning{};                     ///< as Field::meaning
  /// Of an array `image2D levels[N]`: element m sees mip level m, those past the last level see
  /// that one.
  unsigned descriptors = 1;

  BindingSlot::Kind kind() const;
};

/// A pixel as a struct of 32-bit scalars r, g, b, a: how outputs that are images are judged.
Struct pixelLayout(PixelFormat format);

/// What a kernel covers: elements of its buffers, or pixels.
struct Extent {
  std::size_t width = 1, height = 1, depth = 1;
  std::size_t count() const { return width * height * depth; }
};

using Grid = std::function<std::array<std::uint32_t, 3>(const Extent&)>;

/// An expression that an adapter's `functions` may give.
struct FunctionSlot {
  std::string name{};    ///< "D"; the entry calls it as GNOMON_D
  std::string output{};  ///< "results.D", which the kernel does not give without it; or
  std::string push{};  ///< "curve", which stays 0 without it and is the adapter's constant with it
};

/// How somebody's functions are called: an entry point of ours around expressions of theirs.
struct FunctionEntry {
  std::string file{};  ///< under kernels/; without one there are no functions to give
  std::vector<FunctionSlot> slots{};
};

/// A list that a kernel makes of some of its candidates: their records, dense and in their order.
/// It is judged as a set, one uint a candidate that is 1 where the candidate is listed (decodeList
/// in harness/verdict/list.h makes it of what was observed).
struct ListSpec {
  std::string name{};     ///< of that set: "visible"
  std::string records{};  ///< the output buffer that holds the list
  std::string id{};       ///< the field of a record that names its candidate: "firstInstance"
  std::string source{};   ///< the input buffer with the candidates' records, of the same struct
  bool numbered = false;  ///< the kernel writes the id: the candidate's index. Else the id is the
                          ///< candidate's own, which strictly increases over the source
  std::string tally{};    ///< the output buffer of one element that says how many there are:
  std::string total{};    ///< its field for how many were found,
  std::string length{};   ///< for how many of them are listed: at most as many as fit,
  std::string overflowed{};  ///< and 1 where that is fewer than were found, else 0
  std::string padding{};     ///< the field of a record that is 0 in one that fills the list up
};

/// One entry of a stage: everything a run of it needs to know.
struct KernelRecord {
  int order = 0;        ///< of the stage, as a frame runs them (README's stage table)
  std::string stage{};  ///< "brdf"
  std::string entry{};  ///< "evaluate"
  std::string file{};   ///< under kernels/
  std::vector<BufferSpec> buffers{};
  std::vector<ImageSpec> images{};
  std::vector<ListSpec> lists{};
  Struct push;
  Grid grid{};                          ///< where it is not as many groups as cover the extent
  std::vector<std::string> features{};  ///< that the device must have, by GpuInfo::features name
  std::map<std::uint32_t, std::uint32_t> specialization{};  ///< constant id -> 32 bits
  bool deterministic = true;  ///< two runs on the same input agree to the bit
  bool mutates = true;  ///< false: `gnomon mutate` leaves it out, as it is generated or shared
  /// Where it shares code with another kernel, under which that is mutated: how ids of its own
  /// mutants begin, "culling/occlusion.glsl". Empty: all of it.
  std::vector<std::string> ownCode{};
  /// What a foreign kernel may express otherwise: convention -> values, ours first.
  std::map<std::string, std::vector<std::string>> conventions{};
  FunctionEntry functions{};
  Struct probes{};  ///< intermediates that a kernel may name (kernels/lib/probe.glsl), in order
  std::string summary{};  ///< one line for `gnomon list kernels`

  std::string name() const { return stage + "/" + entry; }
  const BufferSpec& buffer(std::string_view called) const;
  const ImageSpec& image(std::string_view called) const;
  const ListSpec& list(std::string_view called) const;
  /// Of an element of that buffer, a pixel of that image or a candidate of that list.
  Struct layoutOf(std::string_view output) const;
};

/// Groups of that many threads that cover the extent; at least one, so that an empty input still
/// runs the kernel's guard.
Grid coveringGrid(const std::array<unsigned, 3>& groupSize);

/// Adds a record to the catalogue; at namespace scope in kernels/<stage>/<stage>.cpp.
bool registerKernel(KernelRecord record);

/// All records, sorted by stage order, then by entry.
std::vector<const KernelRecord*> catalogue();

/// The record called "stage/entry"; throws UsageError that lists what there is.
const KernelRecord& findKernel(std::string_view name);

template <>
Field typeOfMember<float>();
template <>
Field typeOfMember<uint>();
template <>
Field typeOfMember<int>();
template <>
Field typeOfMember<vec2>();
template <>
Field typeOfMember<vec3>();
template <>
Field typeOfMember<vec4>();
template <>
Field typeOfMember<uvec2>();
template <>
Field typeOfMember<uvec3>();
template <>
Field typeOfMember<uvec4>();
template <>
Field typeOfMember<ivec2>();
template <>
Field typeOfMember<mat3>();
template <>
Field typeOfMember<mat4>();

}  // namespace gnomon
