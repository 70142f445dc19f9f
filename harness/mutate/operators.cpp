#include "harness/mutate/operators.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <spirv_cross/GLSL.std.450.h>
#include <spirv_cross/spirv.hpp>

namespace gnomon {
namespace {

/// A constant's relative error, and that of 0. A tenth of the widest bound that the policy lets
/// pass (1e-3): whoever keeps that rule sees it wherever the constant reaches the result.
constexpr float kNudge = 1e-4f;

constexpr std::size_t kResult = 3;      // word of an instruction's first operand behind its result
constexpr std::size_t kExtOperand = 5;  // of an extended instruction's first operand
constexpr std::size_t kArgument = 4;    // of a function call's first argument

/// One instruction with what operators ask about it.
struct Site {
  const ModuleView& view;
  std::size_t index;
  const EditSink& sink;

  const SpirvInstruction& instruction() const { return view.at(index); }
  std::span<const std::uint32_t> words() const { return view.wordsOf(index); }
  std::uint32_t opcode() const { return instruction().opcode; }
  std::uint32_t glsl() const {
    return instruction().glsl ? words()[4] : std::uint32_t{GLSLstd450Bad};
  }

  Edit edit(std::string change) const {
    Edit made(view, index);
    made.change = std::move(change);
    return made;
  }
  void propose(std::string_view name, Edit edit) const { sink(name, std::move(edit)); }
  void exchange(std::string_view name, std::string change, std::size_t word,
                std::uint32_t value) const {
    Edit made = edit(std::move(change));
    made.exchange(word, value);
    propose(name, std::move(made));
  }
  void alias(std::string_view name, std::string change, SpirvId value) const {
    Edit made = edit(std::move(change));
    made.alias(value);
    propose(name, std::move(made));
  }
  /// The same instruction under another opcode.
  void become(std::string_view name, std::string change, std::uint32_t other) const {
    exchange(name, std::move(change), 0, (words()[0] & ~spv::OpCodeMask) | other);
  }
};

// ---- arithmetic: another operation, or one operand alone ------------------------------------

struct Swap {
  std::uint32_t from, to;
  const char* change;
};

constexpr Swap kArithmetic[] = {
    {spv::OpFAdd, spv::OpFSub, "+ becomes -"},
    {spv::OpFSub, spv::OpFAdd, "- becomes +"},
    {spv::OpFMul, spv::OpFDiv, "* becomes /"},
    {spv::OpFDiv, spv::OpFMul, "/ becomes *"},
    {spv::OpIAdd, spv::OpISub, "+ becomes -"},
    {spv::OpISub, spv::OpIAdd, "- becomes +"},
    {spv::OpIMul, spv::OpIAdd, "* becomes +"},
    {spv::OpUDiv, spv::OpIMul, "/ becomes *"},
    {spv::OpSDiv, spv::OpIMul, "/ becomes *"},
    {spv::OpUMod, spv::OpUDiv, "% becomes /"},
    {spv::OpSMod, spv::OpSDiv, "% becomes /"},
    {spv::OpSRem, spv::OpSDiv, "% becomes /"},
    {spv::OpFMod, spv::OpFDiv, "mod becomes /"},
    {spv::OpBitwiseAnd, spv::OpBitwiseOr, "& becomes |"},
    {spv::OpBitwiseOr, spv::OpBitwiseAnd, "| becomes &"},
    {spv::OpBitwiseXor, spv::OpBitwiseOr, "^ becomes |"},
    {spv::OpShiftLeftLogical, spv::OpShiftRightLogical, "<< becomes >>"},
    {spv::OpShiftRightLogical, spv::OpShiftLeftLogical, ">> becomes <<"},
    {spv::OpShiftRightArithmetic, spv::OpShiftLeftLogical, ">> becomes <<"}};

constexpr Swap kFunctions[] = {{GLSLstd450FMin, GLSLstd450FMax, "min becomes max"},
                               {GLSLstd450FMax, GLSLstd450FMin, "max becomes min"},
                               {GLSLstd450UMin, GLSLstd450UMax, "min becomes max"},
                               {GLSLstd450UMax, GLSLstd450UMin, "max becomes min"},
                               {GLSLstd450SMin, GLSLstd450SMax, "min becomes max"},
                               {GLSLstd450SMax, GLSLstd450SMin, "max becomes min"},
                               {GLSLstd450NMin, GLSLstd450NMax, "min becomes max"},
                               {GLSLstd450NMax, GLSLstd450NMin, "max becomes min"},
                               {GLSLstd450Sqrt, GLSLstd450InverseSqrt, "sqrt becomes inversesqrt"},
                               {GLSLstd450InverseSqrt, GLSLstd450Sqrt, "inversesqrt becomes sqrt"},
                               {GLSLstd450Floor, GLSLstd450Ceil, "floor becomes ceil"},
                               {GLSLstd450Ceil, GLSLstd450Floor, "ceil becomes floor"},
                               {GLSLstd450Exp, GLSLstd450Exp2, "exp becomes exp2"},
                               {GLSLstd450Exp2, GLSLstd450Exp, "exp2 becomes exp"},
                               {GLSLstd450Log, GLSLstd450Log2, "log becomes log2"},
                               {GLSLstd450Log2, GLSLstd450Log, "log2 becomes log"},
                               {GLSLstd450Sin, GLSLstd450Cos, "sin becomes cos"},
                               {GLSLstd450Cos, GLSLstd450Sin, "cos becomes sin"},
                               {GLSLstd450FindUMsb, GLSLstd450FindILsb, "findMSB becomes findLSB"},
                               {GLSLstd450FindILsb, GLSLstd450FindUMsb, "findLSB becomes findMSB"}};

/// Operations of two operands of the result's type.
bool isBinary(std::uint32_t opcode) {
  return std::ranges::any_of(kArithmetic, [&](const Swap& s) { return s.from == opcode; });
}

/// Factors and terms may be forgotten; of a quotient or remainder that is another mistake.
bool forgetsSecond(std::uint32_t opcode) {
  switch (opcode) {
    case spv::OpFAdd:
    case spv::OpFSub:
    case spv::OpFMul:
    case spv::OpIAdd:
    case spv::OpISub:
    case spv::OpIMul:
    case spv::OpVectorTimesScalar:
    case spv::OpMatrixTimesScalar:
      return true;
    default:
      return false;
  }
}

void arithmetic(const Site& site) {
  const std::uint32_t opcode = site.opcode();
  for (const Swap& s : kArithmetic)
    if (s.from == opcode) site.become("arithmetic", s.change, s.to);
  for (const Swap& s : kFunctions)
    if (s.from == site.glsl()) site.exchange("arithmetic", s.change, 4, s.to);
  const auto words = site.words();
  if (forgetsSecond(opcode))
    site.alias("arithmetic", "the second operand is forgotten", words[kResult]);
  if (opcode == spv::OpFNegate || opcode == spv::OpSNegate || opcode == spv::OpNot)
    site.alias("arithmetic", "the sign is forgotten", words[kResult]);
  if (opcode == spv::OpDot && words[kResult] != words[kResult + 1])
    site.exchange("arithmetic", "dot(a, b) becomes dot(a, a)", kResult + 1, words[kResult]);
  for (const std::size_t word : {kResult, kResult + 1}) {  // a matrix that is not applied
    const bool product = opcode == spv::OpMatrixTimesVector || opcode == spv::OpVectorTimesMatrix;
    if (product && site.view.typeOf(words[word]) == site.instruction().typeId)
      site.alias("arithmetic", "the matrix is forgotten", words[word]);
  }
}

// ---- operands: those of what does not commute, exchanged ------------------------------------

void swapOperands(const Site& site, std::size_t a, std::size_t b, std::string change) {
  const auto words = site.words();
  if (words[a] == words[b] || site.view.typeOf(words[a]) != site.view.typeOf(words[b])) return;
  Edit edit = site.edit(std::move(change));
  SpirvWords operands(words.begin() + 1, words.end());
  std::swap(operands[a - 1], operands[b - 1]);
  edit.put(site.opcode(), operands);
  site.propose("operands", std::move(edit));
}

bool commutes(std::uint32_t opcode) {
  return opcode == spv::OpFAdd || opcode == spv::OpFMul || opcode == spv::OpIAdd ||
         opcode == spv::OpIMul || opcode == spv::OpBitwiseAnd || opcode == spv::OpBitwiseOr ||
         opcode == spv::OpBitwiseXor;
}

void operands(const Site& site) {
  const std::uint32_t opcode = site.opcode();
  if (isBinary(opcode) && !commutes(opcode))
    swapOperands(site, kResult, kResult + 1, "its operands are exchanged");
  if (opcode == spv::OpSelect)
    swapOperands(site, kResult + 1, kResult + 2, "both choices are exchanged");
  switch (site.glsl()) {
    case GLSLstd450Pow:
    case GLSLstd450Atan2:
    case GLSLstd450Step:
    case GLSLstd450SmoothStep:
    case GLSLstd450FMix:
    case GLSLstd450Cross:
    case GLSLstd450Reflect:
    case GLSLstd450Ldexp:
      swapOperands(site, kExtOperand, kExtOperand + 1, "its first two operands are exchanged");
      break;
    default:
      break;
  }
  if (opcode != spv::OpFunctionCall) return;
  for (std::size_t w = kArgument; w + 1 < site.words().size(); ++w)
    swapOperands(site, w, w + 1, fmt::format("arguments {} and {} are exchanged", w - 3, w - 2));
}

// ---- comparison: its boundary, and its opposite ---------------------------------------------

struct Comparison {
  std::uint32_t opcode, boundary, opposite;
  const char* sign;
  const char* boundarySign;
};

// The opposite of an ordered comparison is unordered: of NaN both are false and true.
constexpr Comparison kComparisons[] = {
    {spv::OpFOrdLessThan, spv::OpFOrdLessThanEqual, spv::OpFUnordGreaterThanEqual, "<", "<="},
    {spv::OpFOrdLessThanEqual, spv::OpFOrdLessThan, spv::OpFUnordGreaterThan, "<=", "<"},
    {spv::OpFOrdGreaterThan, spv::OpFOrdGreaterThanEqual, spv::OpFUnordLessThanEqual, ">", ">="},
    {spv::OpFOrdGreaterThanEqual, spv::OpFOrdGreaterThan, spv::OpFUnordLessThan, ">=", ">"},
    {spv::OpFOrdEqual, spv::OpNop, spv::OpFUnordNotEqual, "==", ""},
    {spv::OpFUnordNotEqual, spv::OpNop, spv::OpFOrdEqual, "!=", ""},
    {spv::OpULessThan, spv::OpULessThanEqual, spv::OpUGreaterThanEqual, "<", "<="},
    {spv::OpULessThanEqual, spv::OpULessThan, spv::OpUGreaterThan, "<=", "<"},
    {spv::OpUGreaterThan, spv::OpUGreaterThanEqual, spv::OpULessThanEqual, ">", ">="},
    {spv::OpUGreaterThanEqual, spv::OpUGreaterThan, spv::OpULessThan, ">=", ">"},
    {spv::OpSLessThan, spv::OpSLessThanEqual, spv::OpSGreaterThanEqual, "<", "<="},
    {spv::OpSLessThanEqual, spv::OpSLessThan, spv::OpSGreaterThan, "<=", "<"},
    {spv::OpSGreaterThan, spv::OpSGreaterThanEqual, spv::OpSLessThanEqual, ">", ">="},
    {spv::OpSGreaterThanEqual, spv::OpSGreaterThan, spv::OpSLessThan, ">=", ">"},
    {spv::OpIEqual, spv::OpNop, spv::OpINotEqual, "==", ""},
    {spv::OpINotEqual, spv::OpNop, spv::OpIEqual, "!=", ""}};

void comparison(const Site& site) {
  for (const Comparison& c : kComparisons) {
    if (c.opcode != site.opcode()) continue;
    if (c.boundary != spv::OpNop)
      site.become("comparison", fmt::format("{} becomes {}", c.sign, c.boundarySign), c.boundary);
    site.become("comparison", fmt::format("{} becomes its opposite", c.sign), c.opposite);
  }
}

// ---- constant: nudged, off by one, of the other sign ----------------------------------------

/// The words of an instruction that are values it computes with: not scopes, semantics, images.
std::vector<std::size_t> valueOperands(const Site& site) {
  const auto words = site.words();
  std::size_t begin = kResult, end = words.size();
  switch (site.opcode()) {
    case spv::OpExtInst:
      if (site.glsl() == GLSLstd450Bad) return {};
      begin = kExtOperand;
      break;
    case spv::OpFunctionCall:
      begin = kArgument;
      break;
    case spv::OpStore:
    case spv::OpImageWrite:
      begin = 2;
      end = std::min<std::size_t>(end, site.opcode() == spv::OpStore ? 3 : 4);
      break;
    case spv::OpReturnValue:
      begin = 1;
      break;
    case spv::OpCompositeExtract:
      end = kResult + 1;
      break;
    case spv::OpVectorShuffle:
    case spv::OpCompositeInsert:
      end = kResult + 2;
      break;
    case spv::OpImageFetch:
      begin = kResult + 1;
      end = kResult + 2;
      break;
    default: {
      const std::uint32_t o = site.opcode();
      const bool computes = (o >= spv::OpConvertFToU && o <= spv::OpBitcast) ||
                            (o >= spv::OpSNegate && o <= spv::OpBitCount) ||
                            o == spv::OpCompositeConstruct;
      if (!computes) return {};
      break;
    }
  }
  std::vector<std::size_t> all;
  for (std::size_t w = begin; w < end; ++w) all.push_back(w);
  return all;
}

struct Nudged {
  std::uint32_t bits;
  std::string change;
};

std::vector<Nudged> nudgedFloats(std::uint32_t bits) {
  const float x = std::bit_cast<float>(bits);
  if (!std::isfinite(x)) return {{0, fmt::format("{} becomes 0", x)}};
  const float y = x == 0 ? kNudge : x * (1 + kNudge);
  std::vector<Nudged> all = {{std::bit_cast<std::uint32_t>(y), fmt::format("{} becomes {}", x, y)}};
  if (x != 0) all.push_back({bits ^ 0x80000000u, fmt::format("{} becomes {}", x, -x)});
  return all;
}

std::vector<Nudged> nudgedIntegers(std::uint32_t bits) {
  const auto shown = [](std::uint32_t b) { return static_cast<std::int32_t>(b); };
  return {{bits + 1, fmt::format("{} becomes {}", shown(bits), shown(bits + 1))},
          {bits - 1, fmt::format("{} becomes {}", shown(bits), shown(bits - 1))}};
}

std::vector<Nudged> nudged(const ModuleView& view, SpirvId type, std::uint32_t bits) {
  if (view.isFloat(type)) return nudgedFloats(bits);
  if (view.isInteger(type)) return nudgedIntegers(bits);
  return {};
}

bool isScalarConstant(const ModuleView& view, SpirvId id) {
  return view.opcodeOf(id) == spv::OpConstant || view.opcodeOf(id) == spv::OpSpecConstant;
}

/// Calls `use` with every constant that differs from this one in one place.
void nudge(const ModuleView& view, Edit blank, SpirvId id,
           const std::function<void(Edit, SpirvId)>& use) {
  const auto definition = view.definition(id);
  const SpirvId type = view.typeOf(id);
  if (isScalarConstant(view, id) && definition.size() == kResult + 1) {
    for (const Nudged& n : nudged(view, type, definition[kResult])) {
      Edit edit = blank;
      edit.change = n.change;
      const SpirvId made = edit.scalar(type, n.bits);
      use(std::move(edit), made);
    }
  }
  if (view.opcodeOf(id) == spv::OpConstantTrue || view.opcodeOf(id) == spv::OpConstantFalse) {
    const bool value = view.opcodeOf(id) == spv::OpConstantTrue;
    Edit edit = blank;
    edit.change = value ? "true becomes false" : "false becomes true";
    const SpirvId made = edit.boolean(type, !value);
    use(std::move(edit), made);
  }
  if (view.opcodeOf(id) != spv::OpConstantComposite) return;
  for (std::size_t part = 0; part + kResult < definition.size(); ++part)
    nudge(view, blank, definition[kResult + part], [&](Edit edit, SpirvId made) {
      SpirvWords parts(definition.begin() + kResult, definition.end());
      parts[part] = made;
      edit.change += fmt::format(" in component {}", part);
      const SpirvId whole = edit.composite(type, parts);
      use(std::move(edit), whole);
    });
}

void constant(const Site& site) {
  for (const std::size_t word : valueOperands(site))
    nudge(site.view, site.edit({}), site.words()[word], [&](Edit edit, SpirvId made) {
      edit.exchange(word, made);
      site.propose("constant", std::move(edit));
    });
}

// ---- removal: what limits, cleans or bends is forgotten --------------------------------------

const char* removable(std::uint32_t glsl) {
  switch (glsl) {
    case GLSLstd450FClamp:
    case GLSLstd450UClamp:
    case GLSLstd450SClamp:
    case GLSLstd450NClamp:
      return "clamp";
    case GLSLstd450FMin:
    case GLSLstd450UMin:
    case GLSLstd450SMin:
    case GLSLstd450NMin:
      return "min";
    case GLSLstd450FMax:
    case GLSLstd450UMax:
    case GLSLstd450SMax:
    case GLSLstd450NMax:
      return "max";
    case GLSLstd450Normalize:
      return "normalize";
    case GLSLstd450FAbs:
    case GLSLstd450SAbs:
      return "abs";
    case GLSLstd450Floor:
      return "floor";
    case GLSLstd450Ceil:
      return "ceil";
    case GLSLstd450Round:
    case GLSLstd450RoundEven:
      return "round";
    case GLSLstd450Fract:
      return "fract";
    case GLSLstd450Sqrt:
      return "sqrt";
    case GLSLstd450InverseSqrt:
      return "inversesqrt";
    case GLSLstd450Exp:
    case GLSLstd450Exp2:
      return "the exponential";
    case GLSLstd450Log:
    case GLSLstd450Log2:
      return "the logarithm";
    case GLSLstd450Pow:
      return "the power";
    case GLSLstd450FMix:
      return "mix";
    case GLSLstd450Trunc:
      return "trunc";
    default:
      return nullptr;
  }
}

/// How many operands may stand for the whole: of min, max and mix either.
std::size_t standIns(std::uint32_t glsl) {
  switch (glsl) {
    case GLSLstd450FMin:
    case GLSLstd450UMin:
    case GLSLstd450SMin:
    case GLSLstd450NMin:
    case GLSLstd450FMax:
    case GLSLstd450UMax:
    case GLSLstd450SMax:
    case GLSLstd450NMax:
    case GLSLstd450FMix:
      return 2;
    default:
      return 1;
  }
}

void removal(const Site& site) {
  const auto words = site.words();
  if (const char* what = removable(site.glsl()))
    for (std::size_t i = 0; i < standIns(site.glsl()); ++i)
      if (site.view.typeOf(words[kExtOperand + i]) == site.instruction().typeId)
        site.alias("removal", fmt::format("{} gives its operand {}", what, i + 1),
                   words[kExtOperand + i]);
  // A function of ours that gives back the type it takes: safe(x), cosine(x), transfer(x).
  if (site.opcode() != spv::OpFunctionCall) return;
  for (std::size_t w = kArgument; w < words.size(); ++w) {
    if (site.view.pointeeOf(words[w]) == site.instruction().typeId) {
      Edit edit = site.edit(fmt::format("the call gives its argument {}", w - kArgument + 1));
      edit.put(spv::OpLoad, {site.instruction().typeId, site.instruction().resultId, words[w]});
      site.propose("removal", std::move(edit));
    } else if (site.view.typeOf(words[w]) == site.instruction().typeId) {
      site.alias("removal", fmt::format("the call gives its argument {}", w - kArgument + 1),
                 words[w]);
    }
  }
}

// ---- store: forgotten ------------------------------------------------------------------------

bool isZero(const ModuleView& view, SpirvId id) {
  const auto definition = view.definition(id);
  switch (view.opcodeOf(id)) {
    case spv::OpConstantNull:
    case spv::OpConstantFalse:
      return true;
    case spv::OpConstant:
      return std::ranges::all_of(definition.subspan(kResult), [](auto w) { return w == 0; });
    case spv::OpConstantComposite:
      return std::ranges::all_of(definition.subspan(kResult),
                                 [&](SpirvId part) { return isZero(view, part); });
    default:
      return false;
  }
}

void store(const Site& site) {
  const auto words = site.words();
  if (site.opcode() == spv::OpImageWrite || site.opcode() == spv::OpAtomicStore) {
    Edit edit = site.edit("the store is forgotten");
    edit.put(spv::OpNop, {});
    site.propose("store", std::move(edit));
  }
  if (site.opcode() != spv::OpStore || isZero(site.view, words[2])) return;
  const SpirvId pointerType = site.view.typeOf(words[1]);
  const bool local = site.view.definition(pointerType)[2] == spv::StorageClassFunction;
  Edit edit = site.edit(local ? fmt::format("{} is 0", site.view.nameOf(words[1]))
                              : "the store is forgotten");
  // A variable that nobody has written could hold anything, the right value too: 0 is certain.
  if (local)
    edit.exchange(2, edit.null(site.view.typeOf(words[2])));
  else
    edit.put(spv::OpNop, {});
  site.propose("store", std::move(edit));
}

// ---- component: another one of a vector ------------------------------------------------------

void component(const Site& site) {
  const auto words = site.words();
  const auto letter = [](std::uint32_t i) { return i < 4 ? "xyzw"[i] : '?'; };
  if (site.opcode() == spv::OpVectorShuffle) {
    const std::uint32_t count = site.view.components(site.view.typeOf(words[kResult])) +
                                site.view.components(site.view.typeOf(words[kResult + 1]));
    for (std::size_t w = kResult + 2; w < words.size(); ++w)
      site.exchange("component", fmt::format("component {} is another one", w - kResult - 2), w,
                    (words[w] + 1) % count);
  }
  if (site.opcode() == spv::OpCompositeExtract && words.size() == kResult + 2) {
    const unsigned count = site.view.components(site.view.typeOf(words[kResult]));
    const std::uint32_t other = (words[kResult + 1] + 1) % std::max(1u, count);
    if (count > 1)
      site.exchange("component",
                    fmt::format(".{} becomes .{}", letter(words[kResult + 1]), letter(other)),
                    kResult + 1, other);
  }
  if (site.opcode() != spv::OpCompositeConstruct) return;
  for (std::size_t w = kResult; w + 1 < words.size(); ++w) {
    if (words[w] == words[w + 1] || site.view.typeOf(words[w]) != site.view.typeOf(words[w + 1]))
      continue;
    Edit edit = site.edit(fmt::format("components {} and {} are exchanged", w - 3, w - 2));
    SpirvWords parts(words.begin() + 1, words.end());
    std::swap(parts[w - 1], parts[w]);
    edit.put(site.opcode(), parts);
    site.propose("component", std::move(edit));
  }
}

// ---- index: another member, element, thread or texel -----------------------------------------

/// What an access chain goes through: the type that each of its indices picks from.
std::vector<SpirvId> typesAlong(const Site& site) {
  const ModuleView& view = site.view;
  std::vector<SpirvId> types;
  SpirvId type = view.pointeeOf(site.words()[kResult]);
  for (std::size_t w = kResult + 1; w < site.words().size() && type != 0; ++w) {
    types.push_back(type);
    const auto definition = view.definition(type);
    if (view.opcodeOf(type) == spv::OpTypeStruct) {
      const auto constant = view.definition(site.words()[w]);
      type = definition[2 + constant[kResult]];
    } else {
      type = definition[2];  // of a vector, matrix or array
    }
  }
  return types;
}

void otherMember(const Site& site, std::size_t word, SpirvId structType) {
  const auto members = site.view.definition(structType).subspan(2);
  const SpirvId indexId = site.words()[word];
  const std::uint32_t member = site.view.definition(indexId)[kResult];
  for (const std::uint32_t other : {member + 1, member - 1}) {
    if (other >= members.size() || members[other] != members[member]) continue;
    Edit edit = site.edit(fmt::format("{} becomes {}", site.view.memberName(structType, member),
                                      site.view.memberName(structType, other)));
    edit.exchange(word, edit.scalar(site.view.typeOf(indexId), other));
    site.propose("index", std::move(edit));
  }
}

void otherComponent(const Site& site, std::size_t word, unsigned count) {
  const SpirvId indexId = site.words()[word];
  const std::uint32_t at = site.view.definition(indexId)[kResult];
  const std::uint32_t other = (at + 1) % count;
  Edit edit = site.edit(fmt::format("component {} becomes {}", at, other));
  edit.exchange(word, edit.scalar(site.view.typeOf(indexId), other));
  site.propose("index", std::move(edit));
}

constexpr std::uint32_t kOne = 1;

/// The element behind, of a buffer or array.
void nextElement(const Site& site, std::size_t word) {
  const SpirvId type = site.view.typeOf(site.words()[word]);
  if (!site.view.isInteger(type)) return;
  Edit edit = site.edit("the element behind");
  const SpirvId next = edit.fresh();
  edit.put(spv::OpIAdd, {type, next, site.words()[word], edit.scalar(type, kOne)});
  edit.exchange(word, next);
  site.propose("index", std::move(edit));
}

void index(const Site& site) {
  const ModuleView& view = site.view;
  if (site.opcode() != spv::OpAccessChain && site.opcode() != spv::OpInBoundsAccessChain) return;
  const std::vector<SpirvId> types = typesAlong(site);
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::size_t word = kResult + 1 + i;
    const std::uint32_t kind = view.opcodeOf(types[i]);
    const bool fixed = isScalarConstant(view, site.words()[word]);
    if (kind == spv::OpTypeStruct)
      otherMember(site, word, types[i]);
    else if (kind == spv::OpTypeVector && fixed)
      otherComponent(site, word, view.components(types[i]));
    else
      nextElement(site, word);
  }
}

/// The texel beside, along each axis.
void offset(const Site& site) {
  std::size_t word = 0;
  if (site.opcode() == spv::OpImageFetch || site.opcode() == spv::OpImageRead) word = kResult + 1;
  if (site.opcode() == spv::OpImageWrite) word = 2;
  if (word == 0) return;
  const SpirvId type = site.view.typeOf(site.words()[word]);
  const SpirvId scalar = site.view.scalarOf(type);
  if (!site.view.isInteger(scalar)) return;
  const unsigned axes = site.view.components(type);
  for (unsigned axis = 0; axis < axes; ++axis) {
    Edit edit = site.edit(fmt::format("the texel beside in {}", "xyzw"[axis]));
    SpirvId step = edit.scalar(scalar, kOne);
    if (axes > 1) {
      SpirvWords parts(axes, edit.scalar(scalar, 0));
      parts[axis] = step;
      step = edit.composite(type, parts);
    }
    const SpirvId moved = edit.fresh();
    edit.put(spv::OpIAdd, {type, moved, site.words()[word], step});
    edit.exchange(word, moved);
    site.propose("index", std::move(edit));
  }
}

// ---- branch: the other way, always one way ----------------------------------------------------

void branch(const Site& site) {
  const auto words = site.words();
  switch (site.opcode()) {
    case spv::OpBranchConditional: {
      Edit swapped = site.edit("the condition is negated");
      swapped.put(spv::OpBranchConditional, {words[1], words[3], words[2]});
      site.propose("branch", std::move(swapped));
      for (const bool taken : {true, false}) {
        Edit edit = site.edit(taken ? "the condition is true" : "the condition is false");
        edit.exchange(1, edit.boolean(site.view.typeOf(words[1]), taken));
        site.propose("branch", std::move(edit));
      }
      break;
    }
    case spv::OpSwitch:
      for (std::size_t w = 3; w + 1 < words.size(); w += 2)
        if (words[w + 1] != words[2])
          site.exchange("branch", fmt::format("case {} is the default", words[w]), w + 1, words[2]);
      break;
    case spv::OpLogicalAnd:
      site.become("branch", "&& becomes ||", spv::OpLogicalOr);
      break;
    case spv::OpLogicalOr:
      site.become("branch", "|| becomes &&", spv::OpLogicalAnd);
      break;
    case spv::OpAny:
      site.become("branch", "any becomes all", spv::OpAll);
      break;
    case spv::OpAll:
      site.become("branch", "all becomes any", spv::OpAny);
      break;
    case spv::OpLogicalNot:
      site.alias("branch", "! is forgotten", words[kResult]);
      break;
    default:
      break;
  }
}

// ---- barrier, atomic, subgroup: threads that work together ------------------------------------

void barrier(const Site& site) {
  if (site.opcode() != spv::OpControlBarrier && site.opcode() != spv::OpMemoryBarrier) return;
  Edit edit = site.edit("the barrier is forgotten");
  edit.put(spv::OpNop, {});
  site.propose("barrier", std::move(edit));
}

/// What an atomic does, as an operation that is not one.
std::optional<std::uint32_t> plainOperation(std::uint32_t atomic) {
  switch (atomic) {
    case spv::OpAtomicIAdd:
    case spv::OpAtomicIIncrement:
      return spv::OpIAdd;
    case spv::OpAtomicISub:
    case spv::OpAtomicIDecrement:
      return spv::OpISub;
    case spv::OpAtomicAnd:
      return spv::OpBitwiseAnd;
    case spv::OpAtomicOr:
      return spv::OpBitwiseOr;
    case spv::OpAtomicXor:
      return spv::OpBitwiseXor;
    default:
      return std::nullopt;
  }
}

constexpr Swap kAtomics[] = {{spv::OpAtomicUMin, spv::OpAtomicUMax, "atomicMin becomes atomicMax"},
                             {spv::OpAtomicUMax, spv::OpAtomicUMin, "atomicMax becomes atomicMin"},
                             {spv::OpAtomicSMin, spv::OpAtomicSMax, "atomicMin becomes atomicMax"},
                             {spv::OpAtomicSMax, spv::OpAtomicSMin, "atomicMax becomes atomicMin"},
                             {spv::OpAtomicOr, spv::OpAtomicAnd, "atomicOr becomes atomicAnd"},
                             {spv::OpAtomicAnd, spv::OpAtomicOr, "atomicAnd becomes atomicOr"},
                             {spv::OpAtomicIAdd, spv::OpAtomicISub, "atomicAdd subtracts"}};

void atomic(const Site& site) {
  const std::uint32_t opcode = site.opcode();
  if (opcode < spv::OpAtomicExchange || opcode > spv::OpAtomicXor) return;
  const auto words = site.words();
  const SpirvId type = site.instruction().typeId, result = site.instruction().resultId;
  for (const Swap& s : kAtomics)
    if (s.from == opcode) site.become("atomic", s.change, s.to);

  Edit forgotten = site.edit("the atomic is forgotten");
  forgotten.put(spv::OpLoad, {type, result, words[kResult]});
  site.propose("atomic", std::move(forgotten));

  const auto plain = plainOperation(opcode);
  if (!plain && opcode != spv::OpAtomicExchange) return;
  Edit torn = site.edit("load and store instead of the atomic");
  constexpr std::size_t kValue = 6;
  SpirvId value = words.size() > kValue ? words[kValue] : torn.scalar(type, kOne);
  torn.put(spv::OpLoad, {type, result, words[kResult]});
  if (plain) {
    const SpirvId next = torn.fresh();
    torn.put(*plain, {type, next, result, value});
    value = next;
  }
  torn.put(spv::OpStore, {words[kResult], value});
  site.propose("atomic", std::move(torn));
}

void subgroup(const Site& site) {
  const std::uint32_t opcode = site.opcode();
  if (opcode < spv::OpGroupNonUniformElect || opcode > spv::OpGroupNonUniformQuadSwap) return;
  const auto words = site.words();
  if (opcode == spv::OpGroupNonUniformElect) {
    Edit edit = site.edit("every lane is elected");
    edit.alias(edit.boolean(site.instruction().typeId, true));
    site.propose("subgroup", std::move(edit));
  }
  for (std::size_t w = kResult + 1; w < words.size(); ++w)
    if (site.view.typeOf(words[w]) == site.instruction().typeId) {
      site.alias("subgroup", "the lane's own value", words[w]);
      break;
    }
  const bool scans =
      opcode == spv::OpGroupNonUniformBallotBitCount ||
      (opcode >= spv::OpGroupNonUniformIAdd && opcode <= spv::OpGroupNonUniformLogicalXor);
  if (!scans) return;
  constexpr std::array kNames = {"reduction", "inclusive scan", "exclusive scan"};
  for (std::uint32_t to = spv::GroupOperationReduce; to <= spv::GroupOperationExclusiveScan; ++to)
    if (words[kResult + 1] < kNames.size() && to != words[kResult + 1])
      site.exchange("subgroup",
                    fmt::format("{} becomes {}", kNames[words[kResult + 1]], kNames[to]),
                    kResult + 1, to);
}

}  // namespace

const std::vector<OperatorInfo>& mutationOperators() {
  static const std::vector<OperatorInfo> all = {
      {"arithmetic", "+ for -, * for /, min for max, an operand forgotten"},
      {"operands", "operands of what does not commute, and arguments, exchanged"},
      {"comparison", "its boundary moved, or its opposite"},
      {"constant", "nudged by 1e-4, off by one, of the other sign"},
      {"removal", "clamp, min, max, normalize, mix or a function gives its operand"},
      {"store", "forgotten; a local variable is 0"},
      {"component", "another component of a vector"},
      {"index", "another member, element or texel"},
      {"branch", "negated, always or never taken; && for ||"},
      {"barrier", "forgotten"},
      {"atomic", "forgotten, torn into load and store, or another one"},
      {"subgroup", "another scan, or the lane's own value"}};
  return all;
}

void proposeEdits(const ModuleView& view, std::size_t index_, const EditSink& sink) {
  const Site site{view, index_, sink};
  arithmetic(site);
  operands(site);
  comparison(site);
  constant(site);
  removal(site);
  store(site);
  component(site);
  index(site);
  offset(site);
  branch(site);
  barrier(site);
  atomic(site);
  subgroup(site);
}

}  // namespace gnomon
