// What a SPIR-V module says of its own interface: bindings by name, layouts by offset.
//
// Names come from the module's debug instructions. A stripped module has none: every name is then
// empty, and so is each piece of a member's path.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gnomon {

/// One dimension of an array: its elements and the bytes from one to the next.
struct ReflectedArray {
  unsigned count = 0;  ///< 0: a runtime array
  unsigned stride = 0;
  bool operator==(const ReflectedArray&) const = default;
};

/// A scalar, vector or matrix inside a block, flattened. Arrays are not unrolled: element [i][j]
/// stands at offset + i * arrays[0].stride + j * arrays[1].stride.
struct ReflectedMember {
  /// Member names joined by '.', with each array's size behind its name ("camera.view",
  /// "lights[4].color", "ids[]"), without the block's own name. Empty for the element of a block
  /// that is one runtime array of scalars, vectors or matrices.
  std::string path{};
  std::string type{};   ///< GLSL spelling: "float", "vec3", "uint", "mat4", "mat3x2"
  unsigned offset = 0;  ///< bytes from the start of the element (runtime array) or block
  unsigned size = 0;    ///< bytes of one scalar, vector or matrix, of all its array elements not
  std::vector<ReflectedArray> arrays{};  ///< the dimensions in the path, outermost first
  unsigned matrixStride = 0;  ///< bytes from column to column, or row to row; 0: no matrix
  bool rowMajor = false;
};

struct ReflectedBinding {
  /// The variable's name. A GLSL block without an instance name goes by its member where it has
  /// exactly one (`buffer Block { float results[]; };` is "results", as in the shader's text),
  /// else by the block's name.
  std::string name{};
  /// The descriptor type that it needs: "storage buffer", "uniform buffer", "storage image",
  /// "sampled image", "combined image sampler", "sampler", "uniform texel buffer", "storage texel
  /// buffer", "input attachment" or "acceleration structure".
  std::string kind{};
  std::string type{};  ///< GLSL spelling of an image or sampler: "image2D", "sampler2DShadow"
  unsigned set = 0;
  unsigned binding = 0;
  unsigned count = 1;  ///< descriptors of an array of bindings; 0: sized at run time
  unsigned stride =
      0;  ///< bytes from element to element of a block that is one runtime array; 0: none
  unsigned bytes = 0;                      ///< of a block, its runtime array taken as empty
  bool readOnly = false;                   ///< NonWritable
  bool writeOnly = false;                  ///< NonReadable
  std::vector<ReflectedMember> members{};  ///< of one element where stride > 0, else of the block
};

struct ReflectedConstant {
  std::string name{};
  std::uint32_t id = 0;
  std::string type{};
  std::uint32_t value = 0;  ///< the default's 32 bits (of a 64-bit constant the lower ones)
};

struct Reflection {
  std::string entryPoint{};
  std::string stage{};                         ///< "compute", "vertex", "fragment", ...
  std::array<unsigned, 3> groupSize{1, 1, 1};  ///< with every specialisation constant's default
  /// Ids of the specialisation constants that set the group size.
  std::array<std::optional<std::uint32_t>, 3> groupSizeIds;
  /// Sorted by set, then binding. Of a module with one entry point, all that it declares; of one
  /// with several, those that this entry point uses.
  std::vector<ReflectedBinding> bindings{};
  std::vector<ReflectedMember> push{};         ///< push-constant members
  unsigned pushBytes = 0;                      ///< end of the last push-constant member
  std::vector<ReflectedConstant> constants{};  ///< specialisation constants, by id
  std::vector<std::string> capabilities{};     ///< "Shader", "Float64", ...
};

/// Reflects the named entry point of a valid module through SPIRV-Cross. Throws UsageError where
/// the module has no such entry point (the message lists those it has) or cannot be reflected.
Reflection reflect(std::span<const std::uint32_t> module, const std::string& entryPoint = "main");

}  // namespace gnomon
