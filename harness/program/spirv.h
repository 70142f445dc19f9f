// Reading, parsing, checking and rewriting SPIR-V modules through SPIRV-Tools.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace gnomon {

using SpirvWords = std::vector<std::uint32_t>;

/// Reads a SPIR-V file of either endianness. Throws UsageError naming the file: missing, size not
/// a multiple of four, no magic number.
SpirvWords readSpirv(const std::filesystem::path& file);

/// What spirv-val for Vulkan 1.2 with scalar block layout says; empty if the module is valid.
std::string validateSpirv(std::span<const std::uint32_t> module);

/// Readable assembly with friendly names, for messages and tests. Throws UsageError where the
/// words are no SPIR-V.
std::string disassemble(std::span<const std::uint32_t> module);

/// One instruction of a parsed module.
struct SpirvInstruction {
  std::uint16_t opcode = 0;    ///< spv::Op
  std::uint32_t typeId = 0;    ///< of the result; 0: none
  std::uint32_t resultId = 0;  ///< 0: none
  bool glsl = false;           ///< an OpExtInst of GLSL.std.450
  std::size_t offset = 0;      ///< of its first word in SpirvModule::words
  std::size_t length = 0;      ///< words, the first (length and opcode) included
};

/// A module cut into its instructions: what every rewrite starts from.
struct SpirvModule {
  SpirvWords words;  ///< all of it, the header's five words too, in this machine's byte order
  std::vector<SpirvInstruction> instructions;

  std::span<const std::uint32_t> wordsOf(const SpirvInstruction& instruction) const;
};

/// Checks every instruction against the SPIR-V grammar (operand counts and kinds, ids within the
/// bound), not against the rules of validity. Throws UsageError with the first violation.
SpirvModule parseSpirv(std::span<const std::uint32_t> module);

/// Words before the first instruction of any module.
inline constexpr std::size_t kSpirvHeaderWords = 5;

/// Adds one instruction: `opcode` is an spv::Op.
void appendInstruction(SpirvWords& words, std::uint32_t opcode, const SpirvWords& operands);

/// What the strict twin may declare on this device.
struct StrictOptions {
  bool signedZeroInfNanPreserve = false;
  bool roundingModeRte = false;
};

/// The strict twin (Vulkan specification, "Precision and Operation of SPIR-V Instructions"; SPIR-V
/// 2.16 NoContraction): the same module with NoContraction on every result of float type that an
/// arithmetic, dot, matrix or extended instruction makes (16, 32 or 64 bit, scalar, vector or
/// matrix), and the float-control execution modes for 32 bit on every entry point. Decorations
/// and modes that the module has already are not repeated, and a module that asks for
/// RoundingModeRTZ keeps it: the twin of a twin is itself. Throws UsageError where the words do
/// not parse; the twin of a valid module is valid.
SpirvWords strictTwin(std::span<const std::uint32_t> module, const StrictOptions& options);

/// What a front end leaves to be done after HLSL: SPIRV-Tools' legalisation passes. Throws
/// UsageError where they refuse.
SpirvWords legalized(std::span<const std::uint32_t> module);

/// What SPIRV-Tools' performance passes make of a valid module, without debug information. Throws
/// UsageError where they refuse.
SpirvWords optimizedForSpeed(std::span<const std::uint32_t> module);

/// The same module with storage images of no format, so that they can be bound to images of any: a
/// writer's arithmetic is judged in 32-bit floats before a narrow format rounds it.
SpirvWords withoutImageFormats(std::span<const std::uint32_t> module);

}  // namespace gnomon
