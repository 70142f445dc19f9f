#include "harness/mutate/module_view.h"

#include <algorithm>
#include <cctype>
#include <deque>

#include <spirv_cross/spirv.hpp>

namespace gnomon {
namespace {

constexpr std::size_t kBoundWord = 3;

/// The parser promises the zero byte that ends a literal string.
std::string literal(std::span<const std::uint32_t> words) {
  return reinterpret_cast<const char*>(words.data());
}

bool isConstant(std::uint32_t opcode) {
  return opcode == spv::OpConstant || opcode == spv::OpConstantComposite ||
         opcode == spv::OpConstantNull || opcode == spv::OpConstantTrue ||
         opcode == spv::OpConstantFalse;
}

/// "/home/me/gnomon/kernels/brdf/../lib/brdf.glsl" -> "lib/brdf.glsl".
std::string belowKernels(const std::string& path) {
  const std::string normal = std::filesystem::path(path).lexically_normal().generic_string();
  constexpr std::string_view kFolder = "/kernels/";
  const std::size_t at = normal.rfind(kFolder);
  return at == std::string::npos ? normal : normal.substr(at + kFolder.size());
}

std::string lineOf(const std::string& text, unsigned line) {
  std::size_t begin = 0;
  for (unsigned i = 1; i < line; ++i) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return {};
    ++begin;
  }
  std::string found = text.substr(begin, text.find('\n', begin) - begin);
  const auto isSpace = [](unsigned char c) { return std::isspace(c) != 0; };
  found.erase(found.begin(), std::find_if_not(found.begin(), found.end(), isSpace));
  while (!found.empty() && isSpace(static_cast<unsigned char>(found.back()))) found.pop_back();
  return found;
}

}  // namespace

ModuleView::ModuleView(std::span<const std::uint32_t> module) : parsed(parseSpirv(module)) {
  reach(survey());
}

std::vector<ModuleView::Function> ModuleView::survey() {
  std::vector<Function> functions;
  for (std::size_t i = 0; i < parsed.instructions.size(); ++i) {
    note(i);
    const SpirvInstruction& instruction = at(i);
    if (instruction.opcode == spv::OpFunction) {
      if (first == 0) first = i;
      functions.push_back({.id = instruction.resultId, .begin = i, .end = i});
    }
    if (functions.empty()) continue;
    functions.back().end = i + 1;
    if (instruction.opcode == spv::OpFunctionCall) functions.back().calls.push_back(wordsOf(i)[3]);
  }
  return functions;
}

void ModuleView::note(std::size_t index) {
  const SpirvInstruction& instruction = at(index);
  const std::span words = wordsOf(index);
  if (instruction.resultId != 0) definitions[instruction.resultId] = index;
  switch (instruction.opcode) {
    case spv::OpEntryPoint:
      entries.push_back(words[2]);
      break;
    case spv::OpName:
      names[words[1]] = literal(words.subspan(2));
      break;
    case spv::OpMemberName:
      memberNames[{words[1], words[2]}] = literal(words.subspan(3));
      break;
    case spv::OpString:
      strings[words[1]] = literal(words.subspan(2));
      break;
    case spv::OpSource:
      if (words.size() > 4) sources[words[3]] = literal(words.subspan(4));
      break;
    default:
      break;
  }
  if (!isConstant(instruction.opcode)) return;
  SpirvWords key(words.begin(), words.end());
  key.erase(key.begin() + 2);
  constants.emplace(std::move(key), instruction.resultId);
}

void ModuleView::reach(const std::vector<Function>& functions) {
  std::set<SpirvId> live;
  std::deque<SpirvId> next(entries.begin(), entries.end());
  for (; !next.empty(); next.pop_front()) {
    if (!live.insert(next.front()).second) continue;
    const auto found = std::ranges::find(functions, next.front(), &Function::id);
    if (found != functions.end()) next.insert(next.end(), found->calls.begin(), found->calls.end());
  }
  for (const Function& f : functions) {
    if (!live.contains(f.id)) continue;
    std::string name = nameOf(f.id);
    functionAt[f.begin] = name.substr(0, name.find('('));
    for (std::size_t i = f.begin; i < f.end; ++i) reached.push_back(i);
  }
}

SourcePlace ModuleView::placeOf(std::size_t index) const {
  SourcePlace place;
  const auto function = functionAt.upper_bound(index);
  if (function != functionAt.begin()) place.function = std::prev(function)->second;
  // A line holds until the next one or the end of its block.
  for (std::size_t i = index; i > first; --i) {
    if (at(i).opcode == spv::OpNoLine) break;
    if (at(i).opcode != spv::OpLine) continue;
    const std::span words = wordsOf(i);
    if (const auto file = strings.find(words[1]); file != strings.end())
      place.file = belowKernels(file->second);
    place.line = words[2];
    if (const auto source = sources.find(words[1]); source != sources.end())
      place.text = lineOf(source->second, place.line);
    break;
  }
  return place;
}

std::span<const std::uint32_t> ModuleView::definition(SpirvId id) const {
  const auto found = definitions.find(id);
  if (found == definitions.end()) return {};
  return wordsOf(found->second);
}

std::uint32_t ModuleView::opcodeOf(SpirvId id) const {
  const auto found = definitions.find(id);
  return found == definitions.end() ? std::uint32_t{spv::OpNop} : at(found->second).opcode;
}

SpirvId ModuleView::typeOf(SpirvId id) const {
  const auto found = definitions.find(id);
  return found == definitions.end() ? 0 : at(found->second).typeId;
}

SpirvId ModuleView::pointeeOf(SpirvId id) const {
  const SpirvId type = typeOf(id);
  return opcodeOf(type) == spv::OpTypePointer ? definition(type)[3] : 0;
}

SpirvId ModuleView::scalarOf(SpirvId type) const {
  if (opcodeOf(type) == spv::OpTypeVector) type = definition(type)[2];
  return isFloat(type) || isInteger(type) ? type : 0;
}

bool ModuleView::isFloat(SpirvId type) const {
  return opcodeOf(type) == spv::OpTypeFloat && definition(type)[2] == 32;
}

bool ModuleView::isInteger(SpirvId type) const {
  return opcodeOf(type) == spv::OpTypeInt && definition(type)[2] == 32;
}

unsigned ModuleView::components(SpirvId type) const {
  return opcodeOf(type) == spv::OpTypeVector ? definition(type)[3] : 1;
}

std::string ModuleView::nameOf(SpirvId id) const {
  const auto found = names.find(id);
  return found == names.end() || found->second.empty() ? "?" : found->second;
}

std::string ModuleView::memberName(SpirvId structType, unsigned member) const {
  const auto found = memberNames.find({structType, member});
  return found == memberNames.end() ? std::to_string(member) : found->second;
}

std::optional<SpirvId> ModuleView::constant(std::uint16_t opcode, SpirvId type,
                                            std::span<const std::uint32_t> operands) const {
  SpirvWords key = {static_cast<std::uint32_t>(operands.size() + 3) << spv::WordCountShift | opcode,
                    type};
  key.insert(key.end(), operands.begin(), operands.end());
  const auto found = constants.find(key);
  return found == constants.end() ? std::nullopt : std::optional(found->second);
}

SpirvId Edit::declare(std::uint32_t opcode, SpirvId type, const SpirvWords& operands) {
  if (const auto found = view->constant(static_cast<std::uint16_t>(opcode), type, operands))
    return *found;
  const SpirvId id = fresh();
  SpirvWords all = {type, id};
  all.insert(all.end(), operands.begin(), operands.end());
  appendInstruction(globals, opcode, all);
  return id;
}

SpirvId Edit::scalar(SpirvId type, std::uint32_t bits) {
  return declare(spv::OpConstant, type, {bits});
}

SpirvId Edit::composite(SpirvId type, const SpirvWords& parts) {
  return declare(spv::OpConstantComposite, type, parts);
}

SpirvId Edit::null(SpirvId type) { return declare(spv::OpConstantNull, type, {}); }

SpirvId Edit::boolean(SpirvId type, bool value) {
  return declare(value ? spv::OpConstantTrue : spv::OpConstantFalse, type, {});
}

void Edit::put(std::uint32_t opcode, const SpirvWords& operands) {
  appendInstruction(code, opcode, operands);
}

void Edit::exchange(std::size_t word, std::uint32_t value) {
  const std::span words = view->wordsOf(index);
  const std::size_t begin = code.size();
  code.insert(code.end(), words.begin(), words.end());
  code[begin + word] = value;
}

void Edit::alias(SpirvId value) {
  put(spv::OpCopyObject, {view->at(index).typeId, view->at(index).resultId, value});
}

SpirvWords Edit::applied() const {
  const SpirvModule& module = view->module();
  const auto end = module.words.begin();
  const auto offset = [&](std::size_t i) {
    return end + static_cast<std::ptrdiff_t>(module.instructions[i].offset);
  };
  const SpirvInstruction& gone = module.instructions[index];
  SpirvWords words(module.words.begin(), offset(view->firstFunction()));
  words.insert(words.end(), globals.begin(), globals.end());
  words.insert(words.end(), offset(view->firstFunction()), offset(index));
  words.insert(words.end(), code.begin(), code.end());
  words.insert(words.end(), offset(index) + static_cast<std::ptrdiff_t>(gone.length),
               module.words.end());
  words[kBoundWord] = nextId;
  return words;
}

}  // namespace gnomon
