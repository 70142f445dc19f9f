// A SPIR-V module as mutation sees it: the code that can run, where its source stands, and edits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "harness/program/spirv.h"

namespace gnomon {

using SpirvId = std::uint32_t;

/// Where an instruction comes from, as far as the module's debug information tells.
struct SourcePlace {
  std::string function{};  ///< "D_GGX"
  std::string file{};      ///< below kernels/: "lib/brdf.glsl"
  unsigned line = 0;       ///< from 1; 0: not known
  std::string text{};      ///< of that line, without the space around it
};

/// Reads what operators ask of a module. The module must be valid SPIR-V; the words must outlive
/// nothing: they are copied.
class ModuleView {
 public:
  /// Throws UsageError where the words do not parse.
  explicit ModuleView(std::span<const std::uint32_t> module);

  const SpirvModule& module() const { return parsed; }
  SpirvId bound() const { return parsed.words[3]; }

  /// Indices of the instructions of functions that an entry point reaches, in their order.
  const std::vector<std::size_t>& code() const { return reached; }
  const SpirvInstruction& at(std::size_t index) const { return parsed.instructions[index]; }
  std::span<const std::uint32_t> wordsOf(std::size_t index) const {
    return parsed.wordsOf(at(index));
  }
  SourcePlace placeOf(std::size_t index) const;

  /// The instruction that makes an id; empty if there is none (a valid module has one).
  std::span<const std::uint32_t> definition(SpirvId id) const;
  std::uint32_t opcodeOf(SpirvId id) const;
  SpirvId typeOf(SpirvId id) const;     ///< 0: it has none
  SpirvId pointeeOf(SpirvId id) const;  ///< of a pointer's type; 0: it is none
  /// Of a float or integer of 32 bits, or a vector of such: that scalar type; else 0.
  SpirvId scalarOf(SpirvId type) const;
  bool isFloat(SpirvId type) const;         ///< scalar type of 32 bits
  bool isInteger(SpirvId type) const;       ///< scalar type of 32 bits
  unsigned components(SpirvId type) const;  ///< of a vector; else 1

  std::string nameOf(SpirvId id) const;  ///< from OpName, "?" without one
  std::string memberName(SpirvId structType, unsigned member) const;

  /// A constant with these words behind its result, if the module has it.
  std::optional<SpirvId> constant(std::uint16_t opcode, SpirvId type,
                                  std::span<const std::uint32_t> operands) const;
  /// Index of the first instruction of a function: what is declared stands before it.
  std::size_t firstFunction() const { return first; }

 private:
  struct Function {
    SpirvId id = 0;
    std::size_t begin = 0, end = 0;
    std::vector<SpirvId> calls{};
  };

  std::vector<Function> survey();
  void note(std::size_t index);
  void reach(const std::vector<Function>& functions);

  SpirvModule parsed;
  std::map<SpirvId, std::size_t> definitions;
  std::map<SpirvId, std::string> names, strings, sources;
  std::map<std::pair<SpirvId, unsigned>, std::string> memberNames;
  std::map<SpirvWords, SpirvId> constants;  ///< by their words without the result
  std::vector<SpirvId> entries;
  std::vector<std::size_t> reached;
  std::map<std::size_t, std::string> functionAt;  ///< by the index of its first instruction
  std::size_t first = 0;
};

/// One instruction replaced by others, with the constants that those need.
class Edit {
 public:
  Edit(const ModuleView& v, std::size_t at) : view(&v), index(at), nextId(v.bound()) {}

  SpirvId fresh() { return nextId++; }
  /// A constant of a scalar type; found or declared.
  SpirvId scalar(SpirvId type, std::uint32_t bits);
  SpirvId composite(SpirvId type, const SpirvWords& parts);
  SpirvId null(SpirvId type);
  SpirvId boolean(SpirvId type, bool value);

  /// Adds an instruction in place of the one that goes; `opcode` is an spv::Op.
  void put(std::uint32_t opcode, const SpirvWords& operands);
  /// The instruction itself with one word exchanged.
  void exchange(std::size_t word, std::uint32_t value);
  /// The instruction's result is that other value of the same type.
  void alias(SpirvId value);

  SpirvWords applied() const;

  std::string change{};  ///< in words: "* becomes /"

 private:
  SpirvId declare(std::uint32_t opcode, SpirvId type, const SpirvWords& operands);

  const ModuleView* view;
  std::size_t index;
  SpirvId nextId;
  SpirvWords globals{}, code{};
};

}  // namespace gnomon
