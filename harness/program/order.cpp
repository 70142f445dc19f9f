#include "harness/program/order.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <spirv_cross/spirv.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Id = std::uint32_t;
using BuiltIn = std::uint32_t;

constexpr std::size_t kBoundWord = 3;
constexpr Id kMaxBound = 0x3fffff;  // SPIR-V 2.17, "Universal Limits"

bool isMirrored(BuiltIn builtIn) {
  switch (builtIn) {
    case spv::BuiltInGlobalInvocationId:
    case spv::BuiltInLocalInvocationId:
    case spv::BuiltInLocalInvocationIndex:
    case spv::BuiltInWorkgroupId:
    case spv::BuiltInSubgroupId:
      return true;
    default:
      return false;
  }
}

/// What operations between lanes ask for; each built-in of subgroups asks for one of them too.
bool isOfSubgroups(std::uint32_t capability) {
  return (capability >= spv::CapabilityGroupNonUniform &&
          capability <= spv::CapabilityGroupNonUniformQuad) ||
         capability == spv::CapabilityGroups || capability == spv::CapabilitySubgroupDispatch ||
         capability == spv::CapabilitySubgroupBallotKHR ||
         capability == spv::CapabilitySubgroupVoteKHR ||
         capability == spv::CapabilitySubgroupShuffleINTEL ||
         capability == spv::CapabilityGroupNonUniformPartitionedNV ||
         capability == spv::CapabilityCooperativeMatrixNV;
}

bool isOfDerivatives(std::uint32_t capability) {
  return capability == spv::CapabilityComputeDerivativeGroupQuadsNV ||
         capability == spv::CapabilityComputeDerivativeGroupLinearNV;
}

/// A module that parses may still name what it does not declare.
template <typename Map>
const typename Map::mapped_type& declared(const Map& map, Id id) {
  const auto found = map.find(id);
  if (found == map.end())
    throw UsageError(fmt::format("malformed SPIR-V: id {} is not declared as its use needs", id));
  return found->second;
}

// ---- what the module says ------------------------------------------------------------------

struct GroupSize {
  bool literal = true;  ///< numbers; else ids of constants
  std::array<std::uint32_t, 3> values{};
};

/// What the twin has to know of a module, gathered in one pass.
struct Survey {
  std::map<Id, BuiltIn> builtIns;    ///< of decorated ids
  std::map<SpirvWords, Id> globals;  ///< types and constants, by all their words but the result
  std::map<Id, Id> types;            ///< of constants and global variables
  std::map<Id, Id> pointees;         ///< of pointer types
  std::map<BuiltIn, Id> inputs;      ///< one variable of each built-in
  std::set<Id> inputVariables;
  std::set<std::uint32_t> capabilities;
  std::map<Id, GroupSize> groupSizes;         ///< of entry points' functions
  Id workgroupSize = 0;                       ///< the constant that overrides them; 0: none
  std::map<Id, std::vector<Id>> interfaceOf;  ///< the same; two entry points may share one
  std::set<Id> called;
  /// Of functions, behind label and variables: an index of an instruction, as both below.
  std::map<Id, std::size_t> bodies;
  std::size_t firstFunction = 0;
  std::size_t builtInDecoration = 0;  ///< any one of them
};

constexpr std::size_t kEntryName = 3;  // word of an OpEntryPoint

/// The parser promises the zero byte that ends it.
std::string_view entryName(std::span<const std::uint32_t> words) {
  return reinterpret_cast<const char*>(words.data() + kEntryName);
}

std::span<const Id> interfaceIn(std::span<const std::uint32_t> words) {
  return words.subspan(kEntryName + entryName(words).size() / sizeof(std::uint32_t) + 1);
}

void noteEntryPoint(Survey& survey, std::span<const std::uint32_t> words) {
  if (words[1] != spv::ExecutionModelGLCompute)
    throw UsageError(fmt::format("entry point \"{}\" is no compute shader: no order to reverse",
                                 entryName(words)));
  const auto ids = interfaceIn(words);
  std::vector<Id>& interface = survey.interfaceOf[words[2]];
  interface.insert(interface.end(), ids.begin(), ids.end());
}

void noteDecoration(Survey& survey, std::span<const std::uint32_t> words, std::size_t at) {
  const std::uint32_t opcode = words[0] & spv::OpCodeMask;
  if (opcode == spv::OpDecorate && words[2] == spv::DecorationBuiltIn) {
    survey.builtIns[words[1]] = words[3];
    survey.builtInDecoration = at;
  }
  if (opcode == spv::OpMemberDecorate && words[3] == spv::DecorationBuiltIn && isMirrored(words[4]))
    throw UsageError("a built-in of the invocation is a member of a struct: not supported");
}

void noteMode(Survey& survey, std::span<const std::uint32_t> words) {
  const bool literal = words[2] == spv::ExecutionModeLocalSize;
  if (literal || words[2] == spv::ExecutionModeLocalSizeId)
    survey.groupSizes[words[1]] = {literal, {words[3], words[4], words[5]}};
}

void noteGlobal(Survey& survey, const SpirvInstruction& instruction,
                std::span<const std::uint32_t> words) {
  const Id id = instruction.resultId;
  if (instruction.typeId != 0) survey.types[id] = instruction.typeId;
  switch (instruction.opcode) {
    case spv::OpTypePointer:
      survey.pointees[id] = words[3];
      [[fallthrough]];
    case spv::OpTypeBool:
    case spv::OpTypeInt:
    case spv::OpTypeVector:
    case spv::OpConstant:
    case spv::OpConstantComposite: {
      SpirvWords key(words.begin(), words.end());
      key.erase(key.begin() + (instruction.typeId == 0 ? 1 : 2));  // the result
      survey.globals.emplace(std::move(key), id);
      break;
    }
    default:
      break;
  }
  const auto builtIn = survey.builtIns.find(id);
  if (builtIn == survey.builtIns.end()) return;
  if (builtIn->second == spv::BuiltInWorkgroupSize) survey.workgroupSize = id;
  if (instruction.opcode == spv::OpVariable && words[3] == spv::StorageClassInput) {
    survey.inputs.emplace(builtIn->second, id);
    survey.inputVariables.insert(id);
  }
}

/// Functions: where their bodies begin. Returns the function that the instruction stands in.
Id noteFunction(Survey& survey, Id function, const SpirvModule& module, std::size_t at) {
  const SpirvInstruction& instruction = module.instructions[at];
  switch (instruction.opcode) {
    case spv::OpFunction:
      if (survey.firstFunction == 0) survey.firstFunction = at;
      return instruction.resultId;
    case spv::OpLabel:
      survey.bodies.emplace(function, at + 1);
      return function;
    case spv::OpVariable:
      if (function != 0) survey.bodies[function] = at + 1;
      return function;
    case spv::OpFunctionCall:
      survey.called.insert(module.wordsOf(instruction)[3]);
      return function;
    case spv::OpFunctionEnd:
      return 0;
    default:
      return function;
  }
}

Survey surveyOf(const SpirvModule& module) {
  Survey survey;
  Id function = 0;
  for (std::size_t i = 0; i < module.instructions.size(); ++i) {
    const SpirvInstruction& instruction = module.instructions[i];
    const std::span words = module.wordsOf(instruction);
    if (instruction.opcode == spv::OpCapability) survey.capabilities.insert(words[1]);
    if (instruction.opcode == spv::OpEntryPoint) noteEntryPoint(survey, words);
    if (instruction.opcode == spv::OpExecutionMode || instruction.opcode == spv::OpExecutionModeId)
      noteMode(survey, words);
    noteDecoration(survey, words, i);
    function = noteFunction(survey, function, module, i);
    if (function == 0 && instruction.resultId != 0) noteGlobal(survey, instruction, words);
  }
  if (survey.interfaceOf.empty()) throw UsageError("no compute shader: no entry point");
  if (function != 0) throw UsageError("malformed SPIR-V: it ends inside a function");
  for (const auto& [entry, interface] : survey.interfaceOf) declared(survey.bodies, entry);
  for (const Id callee : survey.called) declared(survey.bodies, callee);
  return survey;
}

// ---- the twin ------------------------------------------------------------------------------

/// What one entry point's function gets.
struct Prologue {
  SpirvWords code;
  std::vector<Id> inputs;    ///< that it reads
  std::vector<Id> privates;  ///< that it writes
};

class OrderTwin {
 public:
  OrderTwin(const SpirvModule& parsed, const OrderOptions& options)
      : module(parsed),
        survey(surveyOf(parsed)),
        subgroupSize(options.subgroupSize),
        bound(parsed.words[kBoundWord]) {}

  SpirvWords words() {
    for (const auto& [function, interface] : survey.interfaceOf) mirror(function, interface);
    SpirvWords rewritten = rewrite();
    rewritten[kBoundWord] = bound;
    return rewritten;
  }

 private:
  using Vector = std::array<Id, 3>;

  Id fresh() {
    if (bound >= kMaxBound) throw UsageError("malformed SPIR-V: no ids are left");
    return bound++;
  }

  // Globals: found or declared.

  Id global(spv::Op opcode, Id typeId, SpirvWords operands) {
    if (typeId != 0) operands.insert(operands.begin(), typeId);
    SpirvWords key;
    appendInstruction(key, opcode, operands);
    key[0] += 1u << spv::WordCountShift;  // the result counts in the length
    const auto [found, isNew] = survey.globals.emplace(key, 0);
    if (isNew) {
      found->second = fresh();
      operands.insert(operands.begin() + (typeId != 0), found->second);
      appendInstruction(declarations, opcode, operands);
      if (opcode == spv::OpTypePointer) survey.pointees[found->second] = operands[2];
    }
    return found->second;
  }

  Id boolean() { return global(spv::OpTypeBool, 0, {}); }
  Id uint() { return global(spv::OpTypeInt, 0, {32, 0}); }
  Id uvec3() { return global(spv::OpTypeVector, 0, {uint(), 3}); }
  Id constant(std::uint32_t value) { return global(spv::OpConstant, uint(), {value}); }

  Id pointerTo(Id pointee, spv::StorageClass storage) {
    return global(spv::OpTypePointer, 0, {static_cast<std::uint32_t>(storage), pointee});
  }

  Id variable(Id pointee, spv::StorageClass storage) {
    const Id pointer = pointerTo(pointee, storage);
    const Id id = fresh();
    appendInstruction(declarations, spv::OpVariable,
                      {pointer, id, static_cast<std::uint32_t>(storage)});
    survey.types[id] = pointer;
    return id;
  }

  Id pointeeOf(Id variableId) const {
    return declared(survey.pointees, declared(survey.types, variableId));
  }

  /// The variable that stands for an Input variable, with its type.
  Id privateOf(Id input) {
    const auto [found, isNew] = privates.emplace(input, 0);
    if (isNew) found->second = variable(pointeeOf(input), spv::StorageClassPrivate);
    return found->second;
  }

  // Code at the start of an entry point.

  Id add(spv::Op opcode, Id typeId, SpirvWords operands) {
    const Id id = fresh();
    operands.insert(operands.begin(), {typeId, id});
    appendInstruction(prologue->code, opcode, operands);
    return id;
  }

  Id uintOf(spv::Op opcode, Id a, Id b) { return add(opcode, uint(), {a, b}); }
  Id vectorOf(spv::Op opcode, Id a, Id b) { return add(opcode, uvec3(), {a, b}); }

  /// Built-ins and group sizes may be signed.
  Id cast(Id value, Id from, Id to) {
    return from == to ? value : add(spv::OpBitcast, to, {value});
  }

  /// The device's own value of a built-in.
  Id load(const std::vector<Id>& interface, BuiltIn builtIn, Id typeId) {
    const auto isIt = [&](Id id) {
      return survey.inputVariables.contains(id) && survey.builtIns.at(id) == builtIn;
    };
    const auto found = std::ranges::find_if(interface, isIt);
    const Id from = found != interface.end() ? *found : inputOf(builtIn, typeId);
    prologue->inputs.push_back(from);
    const Id pointee = pointeeOf(from);
    return cast(add(spv::OpLoad, pointee, {from}), pointee, typeId);
  }

  Id inputOf(BuiltIn builtIn, Id typeId) {
    const auto [found, isNew] = survey.inputs.emplace(builtIn, 0);
    if (isNew) {
      found->second = variable(typeId, spv::StorageClassInput);
      appendInstruction(decorations, spv::OpDecorate,
                        {found->second, spv::DecorationBuiltIn, builtIn});
    }
    return found->second;
  }

  Vector groupSize(Id function) {
    if (const Id size = survey.workgroupSize; size != 0) {
      const Id whole = cast(size, declared(survey.types, size), uvec3());
      Vector parts{};
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        parts[axis] = add(spv::OpCompositeExtract, uint(), {whole, axis});
      return parts;
    }
    const GroupSize& size = declared(survey.groupSizes, function);
    Vector parts = size.values;
    for (Id& part : parts)
      part = size.literal ? constant(part) : cast(part, declared(survey.types, part), uint());
    return parts;
  }

  Id allOf(const Vector& size) {
    return uintOf(spv::OpIMul, uintOf(spv::OpIMul, size[0], size[1]), size[2]);
  }

  bool asksFor(bool (*kind)(std::uint32_t)) const {
    return std::ranges::any_of(survey.capabilities, kind);
  }

  /// Whether subgroups swap places: more than one, and all of them full.
  Id swaps(Id count) {
    if (asksFor(isOfDerivatives)) return global(spv::OpConstantFalse, boolean(), {});
    const Id rest = uintOf(spv::OpUMod, count, constant(subgroupSize));
    const Id full = add(spv::OpIEqual, boolean(), {rest, constant(0)});
    const Id several = add(spv::OpUGreaterThan, boolean(), {count, constant(subgroupSize)});
    return add(spv::OpLogicalAnd, boolean(), {full, several});
  }

  Id mirroredIndex(Id index, Id count, Id swap) {
    const Id size = constant(subgroupSize);
    const Id first = uintOf(spv::OpIMul, uintOf(spv::OpUDiv, index, size), size);
    const Id lane = uintOf(spv::OpISub, index, first);
    const Id mirroredFirst = uintOf(spv::OpISub, uintOf(spv::OpISub, count, size), first);
    const Id swapped = uintOf(spv::OpIAdd, mirroredFirst, lane);
    const bool keepsLanes = asksFor(isOfSubgroups) || asksFor(isOfDerivatives);
    const Id reversed = keepsLanes ? index : fromTheEnd(index, count);
    return add(spv::OpSelect, uint(), {swap, swapped, reversed});
  }

  Id fromTheEnd(Id index, Id count) {
    return uintOf(spv::OpISub, uintOf(spv::OpISub, count, constant(1)), index);
  }

  Id localOf(Id index, const Vector& size) {
    const Id rows = uintOf(spv::OpUDiv, index, size[0]);
    const Id x = uintOf(spv::OpUMod, index, size[0]);
    const Id y = uintOf(spv::OpUMod, rows, size[1]);
    const Id z = uintOf(spv::OpUDiv, rows, size[1]);
    return add(spv::OpCompositeConstruct, uvec3(), {x, y, z});
  }

  Id mirroredGroup(const std::vector<Id>& interface) {
    const Id groups = load(interface, spv::BuiltInNumWorkgroups, uvec3());
    const Id group = load(interface, spv::BuiltInWorkgroupId, uvec3());
    const Id one = constant(1);
    const Id ones = global(spv::OpConstantComposite, uvec3(), {one, one, one});
    return vectorOf(spv::OpISub, vectorOf(spv::OpISub, groups, ones), group);
  }

  Id mirroredSubgroup(const std::vector<Id>& interface, Id swap) {
    const Id subgroup = load(interface, spv::BuiltInSubgroupId, uint());
    const Id mirrored = fromTheEnd(subgroup, load(interface, spv::BuiltInNumSubgroups, uint()));
    return add(spv::OpSelect, uint(), {swap, mirrored, subgroup});
  }

  /// Everything that the function reads instead of the built-ins in its interface.
  void mirror(Id function, const std::vector<Id>& interface) {
    std::map<Id, BuiltIn> seen;
    for (const Id id : interface)
      if (survey.inputVariables.contains(id) && isMirrored(survey.builtIns.at(id)))
        seen[id] = survey.builtIns.at(id);
    if (seen.empty()) return;

    prologue = &prologues[function];
    const Vector size = groupSize(function);
    const Id count = allOf(size);
    const Id swap = swaps(count);
    const Id group = mirroredGroup(interface);
    const Id index = load(interface, spv::BuiltInLocalInvocationIndex, uint());
    const Id mirrored = mirroredIndex(index, count, swap);
    const Id local = localOf(mirrored, size);
    const Id extent = add(spv::OpCompositeConstruct, uvec3(), {size[0], size[1], size[2]});
    const Id corner = vectorOf(spv::OpIMul, group, extent);
    const Id invocation = vectorOf(spv::OpIAdd, corner, local);
    for (const auto& [input, builtIn] : seen) switch (builtIn) {
        case spv::BuiltInGlobalInvocationId:
          store(input, invocation, uvec3());
          break;
        case spv::BuiltInLocalInvocationId:
          store(input, local, uvec3());
          break;
        case spv::BuiltInLocalInvocationIndex:
          store(input, mirrored, uint());
          break;
        case spv::BuiltInWorkgroupId:
          store(input, group, uvec3());
          break;
        default:
          store(input, mirroredSubgroup(interface, swap), uint());
          break;
      }
  }

  void store(Id input, Id value, Id typeId) {
    const Id to = privateOf(input);
    appendInstruction(prologue->code, spv::OpStore, {to, cast(value, typeId, pointeeOf(input))});
    prologue->privates.push_back(to);
  }

  // The module again, with all that.

  SpirvWords withInterface(std::span<const std::uint32_t> words) const {
    const auto found = prologues.find(words[2]);
    if (found == prologues.end()) return {words.begin(), words.end()};
    std::vector<Id> wanted = found->second.inputs;
    const bool namesAllGlobals = module.words[1] >= 0x00010400;  // SPIR-V 1.4
    const std::vector<Id>& locals = found->second.privates;
    if (namesAllGlobals) wanted.insert(wanted.end(), locals.begin(), locals.end());
    const auto named = interfaceIn(words);
    std::erase_if(wanted, [&](Id id) { return std::ranges::count(named, id) > 0; });
    SpirvWords operands(words.begin() + 1, words.end());
    operands.insert(operands.end(), wanted.begin(), wanted.end());
    SpirvWords instruction;
    appendInstruction(instruction, spv::OpEntryPoint, operands);
    return instruction;
  }

  /// An instruction that reads, through a pointer to an Input variable, what is private now. No
  /// other may take such a pointer: functions have no parameters of that storage class (SPIR-V
  /// 2.16.1, "Universal Validation Rules").
  SpirvWords redirected(const SpirvInstruction& instruction, std::span<const std::uint32_t> words) {
    SpirvWords copy(words.begin(), words.end());
    const bool derives = instruction.opcode == spv::OpAccessChain ||
                         instruction.opcode == spv::OpInBoundsAccessChain ||
                         instruction.opcode == spv::OpCopyObject;
    if (!derives && instruction.opcode != spv::OpLoad && instruction.opcode != spv::OpCopyMemory)
      return copy;
    Id& pointer = copy[instruction.opcode == spv::OpCopyMemory ? 2 : 3];
    if (const auto found = privates.find(pointer); found != privates.end())
      pointer = found->second;
    else if (!derived.contains(pointer))
      return copy;
    if (derives) {
      copy[1] = pointerTo(declared(survey.pointees, instruction.typeId), spv::StorageClassPrivate);
      derived.insert(instruction.resultId);
    }
    return copy;
  }

  SpirvWords functions() {
    std::map<std::size_t, const SpirvWords*> insertions;
    for (const auto& [function, own] : prologues)
      insertions[survey.bodies.at(function)] = &own.code;
    SpirvWords words;
    for (std::size_t i = survey.firstFunction; i < module.instructions.size(); ++i) {
      if (const auto found = insertions.find(i); found != insertions.end())
        words.insert(words.end(), found->second->begin(), found->second->end());
      const SpirvInstruction& instruction = module.instructions[i];
      const SpirvWords copy = redirected(instruction, module.wordsOf(instruction));
      words.insert(words.end(), copy.begin(), copy.end());
    }
    return words;
  }

  SpirvWords rewrite() {
    const SpirvWords code = functions();  // first, for it may declare types
    SpirvWords words(module.words.begin(), module.words.begin() + kSpirvHeaderWords);
    for (std::size_t i = 0; i < survey.firstFunction; ++i) {
      const std::span old = module.wordsOf(module.instructions[i]);
      const bool isEntryPoint = module.instructions[i].opcode == spv::OpEntryPoint;
      const SpirvWords copy =
          isEntryPoint ? withInterface(old) : SpirvWords(old.begin(), old.end());
      words.insert(words.end(), copy.begin(), copy.end());
      if (i == survey.builtInDecoration)
        words.insert(words.end(), decorations.begin(), decorations.end());
    }
    words.insert(words.end(), declarations.begin(), declarations.end());
    words.insert(words.end(), code.begin(), code.end());
    return words;
  }

  const SpirvModule& module;
  Survey survey;
  std::uint32_t subgroupSize;
  Id bound;
  SpirvWords decorations;
  SpirvWords declarations;
  std::map<Id, Id> privates;  ///< by the Input variable
  std::set<Id> derived;       ///< pointers into them
  std::map<Id, Prologue> prologues;
  Prologue* prologue = nullptr;  ///< the one in the making
};

}  // namespace

SpirvWords orderTwin(std::span<const std::uint32_t> module, const OrderOptions& options) {
  if (options.subgroupSize == 0) throw std::logic_error("orderTwin: a subgroup size of 0");
  const SpirvModule parsed = parseSpirv(module);
  return OrderTwin(parsed, options).words();
}

bool threadsCommunicate(std::span<const std::uint32_t> module) {
  const SpirvModule parsed = parseSpirv(module);
  return std::ranges::any_of(parsed.instructions, [&](const SpirvInstruction& i) {
    const auto words = parsed.wordsOf(i);
    if (i.opcode == spv::OpCapability) return isOfSubgroups(words[1]);
    if (i.opcode == spv::OpVariable) return words[3] == spv::StorageClassWorkgroup;
    return i.opcode >= spv::OpAtomicLoad && i.opcode <= spv::OpAtomicXor;
  });
}

}  // namespace gnomon
