#include "harness/mutate/normal_form.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include <spirv-tools/libspirv.hpp>
#include <spirv_cross/spirv.hpp>

#include "harness/cases/hash.h"
#include "harness/program/spirv.h"

namespace gnomon {
namespace {

bool isDebug(std::uint16_t opcode) {
  switch (opcode) {
    case spv::OpLine:
    case spv::OpNoLine:
    case spv::OpName:
    case spv::OpMemberName:
    case spv::OpSource:
    case spv::OpSourceContinued:
    case spv::OpSourceExtension:
    case spv::OpString:
    case spv::OpModuleProcessed:
    case spv::OpNop:
      return true;
    default:
      return false;
  }
}

bool isId(spv_operand_type_t type) {
  return type == SPV_OPERAND_TYPE_ID || type == SPV_OPERAND_TYPE_TYPE_ID ||
         type == SPV_OPERAND_TYPE_SCOPE_ID || type == SPV_OPERAND_TYPE_MEMORY_SEMANTICS_ID;
}

bool commutes(std::uint16_t opcode) {
  switch (opcode) {
    case spv::OpFAdd:
    case spv::OpFMul:
    case spv::OpIAdd:
    case spv::OpIMul:
    case spv::OpDot:
    case spv::OpBitwiseAnd:
    case spv::OpBitwiseOr:
    case spv::OpBitwiseXor:
    case spv::OpLogicalAnd:
    case spv::OpLogicalOr:
    case spv::OpLogicalEqual:
    case spv::OpLogicalNotEqual:
    case spv::OpIEqual:
    case spv::OpINotEqual:
    case spv::OpFOrdEqual:
    case spv::OpFUnordEqual:
    case spv::OpFUnordNotEqual:
      return true;
    default:
      return false;
  }
}

/// Hashes instruction by instruction. An id stands for the hash of what defines it, so constants
/// and types may stand in any order and be numbered in any way.
class Hasher {
 public:
  std::uint64_t add(const spv_parsed_instruction_t& i) {
    std::vector<std::uint64_t> parts;
    for (std::uint16_t o = 0; o < i.num_operands; ++o) {
      const spv_parsed_operand_t& operand = i.operands[o];
      if (operand.type == SPV_OPERAND_TYPE_RESULT_ID) continue;
      for (std::uint16_t w = 0; w < operand.num_words; ++w) {
        const std::uint32_t word = i.words[operand.offset + w];
        parts.push_back(isId(operand.type) ? meaningOf(word) : word);
      }
    }
    if (commutes(i.opcode) && parts.size() >= 2) std::ranges::sort(parts.end() - 2, parts.end());
    std::uint64_t hash = mixed(kHashBasis, i.opcode);
    for (const std::uint64_t part : parts) hash = mixed(hash, part);
    // What stands in a function has its place too: two loads of one variable are not the same.
    if (inFunction) hash = mixed(hash, ++place);
    if (i.opcode == spv::OpFunction) inFunction = true;
    if (i.result_id == 0) return hash;
    // Two variables of one type differ in what was said of them before: decorations, an interface.
    const auto named = meanings.find(i.result_id);
    if (!inFunction && named != meanings.end()) hash = mixed(hash, named->second);
    meanings[i.result_id] = hash;
    return hash;
  }

 private:
  /// A jump ahead names what is not defined yet: numbered in the order of such names.
  std::uint64_t meaningOf(std::uint32_t id) {
    const auto [found, isNew] = meanings.emplace(id, 0);
    if (isNew) found->second = mixed(kHashBasis, ++ahead);
    return found->second;
  }

  static std::uint64_t mixed(std::uint64_t hash, std::uint64_t part) {
    return hashOf({reinterpret_cast<const char*>(&part), sizeof part}, hash);
  }

  std::map<std::uint32_t, std::uint64_t> meanings;
  std::uint64_t place = 0, ahead = 0;
  bool inFunction = false;
};

struct Total {
  Hasher hasher;
  std::uint64_t declarations = 0;  ///< a sum: their order says nothing
  std::uint64_t code = kHashBasis;
  bool inFunction = false;
};

spv_result_t take(void* data, const spv_parsed_instruction_t* i) {
  Total& total = *static_cast<Total*>(data);
  if (isDebug(i->opcode)) return SPV_SUCCESS;
  total.inFunction |= i->opcode == spv::OpFunction;
  const std::uint64_t hash = total.hasher.add(*i);
  if (total.inFunction)
    total.code = hashOf({reinterpret_cast<const char*>(&hash), sizeof hash}, total.code);
  else if (i->result_id == 0)  // what has a result counts where it is used
    total.declarations += hash;
  return SPV_SUCCESS;
}

}  // namespace

std::uint64_t normalForm(std::span<const std::uint32_t> module) {
  const SpirvWords words = optimizedForSpeed(module);
  const spvtools::Context context(SPV_ENV_UNIVERSAL_1_6);
  Total total;
  spvBinaryParse(context.CContext(), &total, words.data(), words.size(), nullptr, take, nullptr);
  return total.code ^ total.declarations;
}

std::uint64_t hashWithoutDebug(std::span<const std::uint32_t> module) {
  const SpirvModule parsed = parseSpirv(module);
  std::uint64_t hash = kHashBasis;
  for (const SpirvInstruction& i : parsed.instructions) {
    if (isDebug(i.opcode)) continue;
    const auto words = parsed.wordsOf(i);
    hash = hashOf({reinterpret_cast<const char*>(words.data()), words.size_bytes()}, hash);
  }
  return hash;
}

}  // namespace gnomon
