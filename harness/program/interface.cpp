#include "harness/program/interface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/error.h"

namespace gnomon {
namespace {

constexpr unsigned kWord = 4;
constexpr double kMostThreads = 65535;  // the device says what it can; this is a number at all

/// "items[].n" and "items[4].n" name the same member of an element.
std::string withoutSizes(const std::string& path) {
  std::string plain;
  bool inside = false;
  for (const char c : path) {
    if (c == '[') inside = true;
    if (!inside) plain += c;
    if (c == ']') inside = false;
  }
  return plain;
}

/// Components of "vec3", "uint", "mat4".
unsigned components(const std::string& type) {
  if (type.starts_with("mat")) {
    const unsigned columns = static_cast<unsigned>(type[3] - '0');
    const std::size_t by = type.find('x');
    return columns *
           (by == std::string::npos ? columns : static_cast<unsigned>(type[by + 1] - '0'));
  }
  const char last = type.back();
  return last >= '2' && last <= '4' ? static_cast<unsigned>(last - '0') : 1;
}

bool isFloat(const std::string& type) {
  return type == "float" || type.starts_with("vec") || type.starts_with("mat");
}

/// The same scalars, or a wider vector of them: a contract's vec3 often stands in a vec4.
bool fits(const Field& ours, const ReflectedMember& theirs) {
  if (ours.type == theirs.type) return true;
  if (ours.type.starts_with("mat") || theirs.type.starts_with("mat")) return false;
  if (theirs.size != kWord * components(theirs.type)) return false;  // 16 or 64 bits
  return isFloat(ours.type) == isFloat(theirs.type) && components(theirs.type) >= ours.scalars;
}

/// Collects what contradicts, and says it all at once.
class Matcher {
 public:
  Matcher(const KernelRecord& r, const Reflection& m, const Adapter* a)
      : record(r), module(m), adapter(a) {}

  Interface match() {
    result.entryPoint = module.entryPoint;
    result.groupSize = result.covered = module.groupSize;
    if (adapter != nullptr && adapter->grid) result.covered = *adapter->grid;
    result.specialization = record.specialization;
    addBuffers();
    for (const BufferSpec& b : record.buffers)
      b.access == Access::kScratch ? placeScratch(b) : placeBuffer(b);
    placePush();
    for (const ImageSpec& i : record.images) placeImage(i);
    takeConstants();
    takeSpecialization();
    refuseUnknownNames();
    refuseHalfGiven();
    refuseLeftovers();
    return std::move(result);
  }

  const std::vector<std::string>& contradictions() const { return lines; }

 private:
  /// A name on the left of 'fields' or 'bindings' that is not the contract's would change nothing.
  void refuseUnknownNames() {
    if (adapter == nullptr) return;
    std::set<std::string> fields, bound;
    for (const Field& f : record.push.fields) fields.insert("push." + f.name);
    for (const BufferSpec& b : record.buffers) {
      bound.insert(b.name);
      if (b.access == Access::kScratch) continue;  // what a kernel keeps there is its own business
      for (const Field& f : b.element.fields) fields.insert(b.name + "." + f.name);
    }
    for (const ImageSpec& i : record.images) bound.insert(i.name);
    for (const auto& [key, path] : adapter->fields)
      if (!fields.contains(key))
        lines.push_back(fmt::format("'fields' maps {} to '{}'; the contract has {}", key, path,
                                    fmt::join(fields, ", ")));
    for (const auto& [name, at] : adapter->bindings)
      if (!bound.contains(name))
        lines.push_back(
            fmt::format("'bindings' puts '{}' at set {}, binding {}; the contract has {}", name,
                        at[0], at[1], fmt::join(bound, ", ")));
  }

  bool named(const std::string& key) const {
    return adapter != nullptr && adapter->fields.contains(key);
  }

  void addBuffers() {
    result.pushBytes = module.pushBytes;
    for (const ReflectedBinding& b : module.bindings) {
      if (b.kind != "storage buffer" && b.kind != "uniform buffer") continue;
      ModuleBuffer buffer{
          .name = b.name,
          .slot = {.set = b.set,
                   .binding = b.binding,
                   .kind = b.kind == "storage buffer" ? BindingSlot::Kind::kStorageBuffer
                                                      : BindingSlot::Kind::kUniformBuffer},
          .stride = b.stride,
          .bytes = b.stride > 0 ? 0 : b.bytes};
      for (const ReflectedMember& m : b.members)  // a header, then a runtime array
        if (b.stride == 0 && !m.arrays.empty() && m.arrays[0].count == 0) {
          buffer.stride = m.arrays[0].stride;
          buffer.bytes = std::min(buffer.bytes, m.offset);
        }
      blocks.push_back(&b);
      result.buffers.push_back(buffer);
    }
  }

  /// The binding that a contract's name stands for: as the adapter says, by name, or by number
  /// where the module has no names.
  const ReflectedBinding* binding(const std::string& name, unsigned number, const char* what,
                                  bool required) {
    const auto at = [&](unsigned set, unsigned slot) {
      return std::ranges::find_if(module.bindings, [&](const ReflectedBinding& b) {
        return b.set == set && b.binding == slot;
      });
    };
    auto found = module.bindings.end();
    if (adapter != nullptr && adapter->bindings.contains(name)) {
      const auto [set, slot] = adapter->bindings.at(name);
      found = at(set, slot);
      if (found == module.bindings.end()) {
        lines.push_back(
            fmt::format("'bindings' puts '{}' at set {}, binding {}, where the shader has nothing",
                        name, set, slot));
        return nullptr;
      }
    } else {
      found = std::ranges::find(module.bindings, name, &ReflectedBinding::name);
      if (found == module.bindings.end()) {
        const auto unnamed = at(0, number);
        if (unnamed != module.bindings.end() && unnamed->name.empty()) found = unnamed;
      }
    }
    if (found != module.bindings.end()) {
      used.insert(&*found);
      return &*found;
    }
    if (required)
      lines.push_back(
          fmt::format("the shader has no {} '{}', which the contract binds at set 0, binding {}",
                      what, name, number));
    return nullptr;
  }

  unsigned indexOf(const ReflectedBinding* block) const {
    return static_cast<unsigned>(std::ranges::find(blocks, block) - blocks.begin());
  }

  Place placeIn(const Field& ours, const ReflectedBinding* block, const ReflectedMember& m) {
    taken.insert(&m);
    return {.field = ours,
            .buffer = block == nullptr ? Place::kPush : indexOf(block),
            .offset = m.offset,
            .matrixStride = m.matrixStride,
            .rowMajor = m.rowMajor};
  }

  /// Whether a member is there once for each element of its block's runtime array.
  static bool repeated(const ReflectedBinding* block, const ReflectedMember& m) {
    return block != nullptr && (block->stride > 0 || (!m.arrays.empty() && m.arrays[0].count == 0));
  }

  /// A member by its path, below its binding's name or not.
  const ReflectedMember* member(const std::vector<ReflectedMember>& members,
                                const std::string& block, const std::string& path) const {
    const std::string wanted = withoutSizes(path);
    for (const ReflectedMember& m : members) {
      const std::string plain = withoutSizes(m.path);
      if (plain == wanted || (!block.empty() && block + "." + plain == wanted)) return &m;
      if (plain.empty() && block == wanted) return &m;  // a bare array of scalars or vectors
    }
    return nullptr;
  }

  /// A parameter may stand in a struct of its block: `uniform Push { Evaluate push; }`.
  const ReflectedMember* parameter(const std::vector<ReflectedMember>& members,
                                   const std::string& name) const {
    if (const ReflectedMember* found = member(members, {}, name)) return found;
    const auto nested = std::ranges::find_if(members, [&](const ReflectedMember& m) {
      return withoutSizes(m.path).ends_with("." + name);
    });
    return nested == members.end() ? nullptr : &*nested;
  }

  /// A member of the module, and the component of it that a path ends in.
  struct Found {
    const ReflectedBinding* block = nullptr;  ///< none: push constants
    const ReflectedMember* member = nullptr;
    unsigned component = 0;
    bool ofVector = false;
  };

  /// In the preferred block first, for a path may leave its name out.
  Found memberAt(const std::string& path, const ReflectedBinding* preferred) const {
    std::vector<const ReflectedBinding*> order = blocks;
    if (preferred != nullptr) order.insert(order.begin(), preferred);
    if (const std::size_t at = path.find('@'); at != std::string::npos)
      return memberByOffset(path.substr(0, at), path.substr(at + 1), preferred);
    for (const ReflectedBinding* block : order)
      if (const ReflectedMember* m = member(block->members, block->name, path)) return {block, m};
    if (const ReflectedMember* m = member(module.push, "push", path)) return {nullptr, m};
    return {};
  }

  /// "push@8", "points@16": for modules without names.
  Found memberByOffset(const std::string& block, const std::string& offset,
                       const ReflectedBinding* preferred) const {
    const auto at = [&](const std::vector<ReflectedMember>& members) -> const ReflectedMember* {
      for (const ReflectedMember& m : members)
        if (std::to_string(m.offset) == offset) return &m;
      return nullptr;
    };
    if (block == "push") return {nullptr, at(module.push)};
    if (preferred != nullptr) return {preferred, at(preferred->members)};
    return {};
  }

  Found componentAt(const std::string& path, const ReflectedBinding* preferred) const {
    Found found = memberAt(path, preferred);
    const std::size_t dot = path.rfind('.');
    if (found.member != nullptr || dot == std::string::npos || dot + 2 != path.size()) return found;
    const std::size_t component = std::string_view("xyzwrgba").find(path.back());
    if (component == std::string_view::npos) return found;
    found = memberAt(path.substr(0, dot), preferred);
    found.component = component % 4;
    return found;
  }

  /// Where the adapter's path leads: any block of the module, or its push constants.
  std::optional<Place> adaptedPlace(const std::string& key, const Field& ours,
                                    const ReflectedBinding* preferred) {
    const std::string& path = adapter->fields.at(key);
    const Found found = componentAt(path, preferred);
    if (found.member == nullptr) {
      lines.push_back(
          fmt::format("'fields' maps {} to '{}', which the shader does not have", key, path));
      return std::nullopt;
    }
    const bool inside =
        found.component == 0 || found.component + ours.scalars <= components(found.member->type);
    if (!fits(ours, *found.member) || !inside) {
      lines.push_back(fmt::format("'fields' maps {}, a {}, to '{}', in a {}", key, ours.type, path,
                                  found.member->type));
      return std::nullopt;
    }
    const bool parameter = key.starts_with("push.");
    if (!parameter && found.block == nullptr) {
      lines.push_back(fmt::format(
          "'fields' maps {}, of which there are many, to '{}', a push constant", key, path));
      return std::nullopt;
    }
    if (parameter && repeated(found.block, *found.member)) {
      lines.push_back(fmt::format(
          "'fields' maps {}, of which there is one, to '{}', in a runtime array", key, path));
      return std::nullopt;
    }
    if (found.block != nullptr) used.insert(found.block);
    Place place = placeIn(ours, found.block, *found.member);
    place.offset += kWord * found.component;
    return place;
  }

  /// By name; by offset where the module has no names.
  std::optional<Place> sameNamed(const std::string& where, const Field& ours,
                                 const ReflectedBinding& block) {
    const ReflectedMember* found = member(block.members, {}, ours.name);
    if (found == nullptr)  // behind a header
      found = member(block.members, {}, where + "." + ours.name);
    if (found == nullptr)
      for (const ReflectedMember& m : block.members)
        if (m.path.find_first_not_of(".[]") == std::string::npos && m.offset == ours.offset &&
            (block.name.empty() || fits(ours, m)))  // a bare array has a name, its element none
          found = &m;
    if (found == nullptr) {
      missing.push_back(
          fmt::format("{} has no member '{}' in the shader; the contract has {} {} at byte {}",
                      where, ours.name, ours.type, ours.name, ours.offset));
      return std::nullopt;
    }
    if (!fits(ours, *found) || (adapter == nullptr && found->type != ours.type)) {
      lines.push_back(fmt::format("{}.{} is {} in the shader, {} in the contract", where, ours.name,
                                  found->type, ours.type));
    } else if (adapter == nullptr && found->offset != ours.offset) {
      lines.push_back(fmt::format("{}.{} is at byte {} in the shader, {} in the contract", where,
                                  ours.name, found->offset, ours.offset));
    }
    return placeIn(ours, &block, *found);
  }

  void placeBuffer(const BufferSpec& spec) {
    const bool elsewhere = std::ranges::all_of(
        spec.element.fields, [&](const Field& f) { return named(spec.name + "." + f.name); });
    const ReflectedBinding* block = binding(spec.name, spec.binding, "buffer", !elsewhere);
    if (block != nullptr && block->kind != "storage buffer" && block->kind != "uniform buffer") {
      refuseKind(spec, *block);
      block = nullptr;
    }
    if (adapter == nullptr && block != nullptr) compareStrictly(spec, *block);
    std::vector<std::optional<Place>> places;
    for (const Field& f : spec.element.fields) {
      const std::string key = spec.name + "." + f.name;
      missing.clear();
      std::optional<Place> place;
      if (named(key))
        place = adaptedPlace(key, f, block);
      else if (block != nullptr)
        place = sameNamed(spec.name, f, *block);
      if (leftOut(key)) place.reset();
      if (place && spec.access == Access::kWrite) result.buffers[place->buffer].written = true;
      // An output that a foreign kernel does not give is told, not an error; an input it need not
      // read.
      if (adapter == nullptr) lines.insert(lines.end(), missing.begin(), missing.end());
      if (!place && spec.access == Access::kWrite) result.unmapped.push_back(key);
      places.push_back(place);
    }
    if (adapter != nullptr && spec.access == Access::kWrite &&
        std::ranges::none_of(places, [](const auto& p) { return p.has_value(); }))
      lines.push_back(fmt::format("no field of the output '{}' is found in the shader", spec.name));
    result.places[spec.name] = std::move(places);
  }

  /// A foreign kernel need not have it, and may keep there what it likes.
  void placeScratch(const BufferSpec& spec) {
    std::vector<std::optional<Place>>& places = result.places[spec.name];
    places.resize(spec.element.fields.size());
    const bool named = std::ranges::find(module.bindings, spec.name, &ReflectedBinding::name) !=
                       module.bindings.end();
    if (adapter != nullptr && !named && !adapter->bindings.contains(spec.name)) return;
    const ReflectedBinding* block = binding(spec.name, spec.binding, "buffer", true);
    if (block == nullptr) return;
    if (block->kind != "storage buffer") return refuseKind(spec, *block);
    result.scratch[spec.name] = indexOf(block);
    result.buffers[indexOf(block)].written = true;
    if (adapter != nullptr) return;
    compareStrictly(spec, *block);
    missing.clear();
    for (std::size_t f = 0; f < places.size(); ++f)
      places[f] = sameNamed(spec.name, spec.element.fields[f], *block);
    lines.insert(lines.end(), missing.begin(), missing.end());
  }

  void refuseKind(const BufferSpec& spec, const ReflectedBinding& block) {
    lines.push_back(fmt::format("'{}' is a {} in the shader, a storage buffer in the contract",
                                spec.name, block.kind));
  }

  /// Functions stand for the outputs that they are given for, though the entry around them has all.
  bool leftOut(const std::string& key) const {
    if (adapter == nullptr || adapter->functions.empty()) return false;
    return std::ranges::any_of(record.functions.slots, [&](const FunctionSlot& slot) {
      return slot.output == key && !adapter->functions.contains(slot.name);
    });
  }

  void compareStrictly(const BufferSpec& spec, const ReflectedBinding& block) {
    if (block.set != 0 || block.binding != spec.binding)
      lines.push_back(fmt::format(
          "'{}' is at set {}, binding {} in the shader, set 0, binding {} in the contract",
          spec.name, block.set, block.binding, spec.binding));
    if (block.stride != spec.element.size)
      lines.push_back(
          fmt::format("an element of '{}' takes {} bytes in the shader, {} in the contract",
                      spec.name, block.stride, spec.element.size));
  }

  void placePush() {
    if (adapter == nullptr && module.pushBytes != record.push.size)
      lines.push_back(fmt::format("push constants take {} bytes in the shader, {} in the contract",
                                  module.pushBytes, record.push.size));
    for (const Field& f : record.push.fields) {
      const std::string key = "push." + f.name;
      std::optional<Place> place;
      if (named(key))
        place = adaptedPlace(key, f, nullptr);
      else
        place = pushNamed(f);
      if (place) result.push.push_back(*place);
    }
  }

  /// Push constants are often parameters in a uniform buffer elsewhere.
  std::optional<Place> pushNamed(const Field& f) {
    const ReflectedMember* found = parameter(module.push, f.name);
    if (found == nullptr && adapter == nullptr)
      for (const ReflectedMember& m : module.push)
        if (m.path.empty() && m.offset == f.offset) found = &m;
    if (found != nullptr &&
        (!fits(f, *found) || (adapter == nullptr && found->offset != f.offset))) {
      lines.push_back(fmt::format(
          "the push constant '{}' is {} at byte {} in the shader, {} at byte {} in the contract",
          f.name, found->type, found->offset, f.type, f.offset));
      return std::nullopt;
    }
    if (found != nullptr) return placeIn(f, nullptr, *found);
    for (const ReflectedBinding* block : blocks) {
      if (block->stride != 0 || block->kind != "uniform buffer") continue;
      const ReflectedMember* m = parameter(block->members, f.name);
      if (m == nullptr || !fits(f, *m)) continue;
      used.insert(block);
      return placeIn(f, block, *m);
    }
    return std::nullopt;
  }

  /// An image and its sampler may be one variable or two, and an input may be a storage image.
  static bool agree(const std::string& ours, const std::string& theirs) {
    const auto shape = [](const std::string& type) {
      const std::size_t at = type.find_first_of("123C");
      return at == std::string::npos ? type : type.substr(at);
    };
    if (ours == theirs) return true;
    if (ours.starts_with("image")) return false;
    return ours != "sampler" && shape(ours) == shape(theirs);
  }

  void placeImage(const ImageSpec& spec) {
    // How a kernel reads an image is its own affair: it may fetch where ours takes a sampler.
    const bool required = spec.kind() != BindingSlot::Kind::kSampler;
    const ReflectedBinding* found = binding(spec.name, spec.binding, "image", required);
    if (found == nullptr) return;
    if (!(adapter == nullptr ? found->type == spec.type : agree(spec.type, found->type))) {
      lines.push_back(fmt::format("'{}' is {} in the shader, {} in the contract", spec.name,
                                  found->type.empty() ? "a " + found->kind : found->type,
                                  spec.type));
      return;
    }
    if (adapter == nullptr && (found->set != 0 || found->binding != spec.binding))
      lines.push_back(fmt::format(
          "'{}' is at set {}, binding {} in the shader, set 0, binding {} in the contract",
          spec.name, found->set, found->binding, spec.binding));
    refuseDescriptors(spec, *found);
    result.images.push_back({.name = spec.name,
                             .slot = {.set = found->set,
                                      .binding = found->binding,
                                      .kind = kindOf(*found),
                                      .count = found->count},
                             .asArray = found->type.ends_with("2DArray")});
  }

  /// A foreign kernel may write fewer mip levels than the contract has room for.
  void refuseDescriptors(const ImageSpec& spec, const ReflectedBinding& found) {
    if (found.count == spec.descriptors) return;
    if (adapter != nullptr && found.count > 0 && found.count < spec.descriptors) return;
    const auto inWords = [](unsigned count) {
      return count == 0   ? std::string("an array without a size")
             : count == 1 ? std::string("one image")
                          : fmt::format("an array of {}", count);
    };
    lines.push_back(fmt::format("'{}' is {} in the shader, {} in the contract", spec.name,
                                inWords(found.count), inWords(spec.descriptors)));
  }

  static BindingSlot::Kind kindOf(const ReflectedBinding& b) {
    if (b.kind == "storage image") return BindingSlot::Kind::kStorageImage;
    if (b.kind == "combined image sampler") return BindingSlot::Kind::kCombined;
    return b.kind == "sampler" ? BindingSlot::Kind::kSampler : BindingSlot::Kind::kSampledImage;
  }

  void takeConstants() {
    if (adapter == nullptr) return;
    for (const auto& [name, value] : adapter->constants) {
      const std::string& key = name;  // what a lambda may capture
      if (presetNamed(key, value)) continue;
      const auto push = std::ranges::find(record.push.fields, key, &Field::name);
      if (push == record.push.fields.end()) {
        lines.push_back(fmt::format(
            "'constants' gives '{}' a value, which neither the shader nor the contract has", key));
        continue;
      }
      // The entry around somebody's functions has them all; the functions are one curve.
      if (adapter->functions.empty() &&
          std::ranges::any_of(result.push, [&](const Place& p) { return p.field.name == key; }))
        lines.push_back(
            fmt::format("'constants' fixes '{}', which the shader takes from the contract", key));
      result.fixed[key] = value;
    }
  }

  /// "params.tint", "params.tint.y", "push@8".
  bool presetNamed(const std::string& key, double value) {
    const Found found = parameterAt(key);
    if (found.member == nullptr) return false;
    const ReflectedMember& m = *found.member;
    if (taken.contains(&m) && !given.contains(&m)) return false;  // the contract's
    taken.insert(&m);
    if (found.block != nullptr) used.insert(found.block);
    const std::string type = found.ofVector ? scalarOf(m.type) : m.type;
    if (repeated(found.block, m))
      lines.push_back(fmt::format("'constants' gives '{}' a value, in a runtime array", key));
    else if (holds("constants", key, type, value))
      result.presets.push_back({found.block == nullptr ? Place::kPush : indexOf(found.block),
                                m.offset + kWord * found.component, bitsOf(type, value)});
    given[&m] += found.ofVector ? 1 : components(m.type);
    return true;
  }

  Found parameterAt(const std::string& path) const {
    if (const Found whole = wholeParameterAt(path); whole.member != nullptr) return whole;
    if (path.size() < 3 || path[path.size() - 2] != '.') return {};
    const std::size_t component = std::string_view("xyzwrgba").find(path.back());
    if (component == std::string_view::npos) return {};
    Found found = wholeParameterAt(path.substr(0, path.size() - 2));
    if (found.member == nullptr || found.member->matrixStride > 0 ||
        component % 4 >= components(found.member->type))
      return {};
    found.component = component % 4;
    found.ofVector = true;
    return found;
  }

  Found wholeParameterAt(const std::string& path) const {
    const std::size_t at = path.find('@');
    const auto in = [&](const std::vector<ReflectedMember>& members, const std::string& block) {
      if (at == std::string::npos) return member(members, block, path);
      const auto found = std::ranges::find_if(members, [&](const ReflectedMember& m) {
        return path == fmt::format("{}@{}", block, m.offset);
      });
      return found == members.end() ? nullptr : &*found;
    };
    if (const ReflectedMember* m = in(module.push, "push")) return {nullptr, m};
    for (const ReflectedBinding* block : blocks)
      if (const ReflectedMember* m = in(block->members, block->name)) return {block, m};
    return {};
  }

  static std::string scalarOf(const std::string& vector) {
    if (vector.starts_with("vec")) return "float";
    if (vector.starts_with("uvec")) return "uint";
    return vector.starts_with("ivec") ? "int" : vector;
  }

  void refuseHalfGiven() {
    for (const auto& [m, count] : given)
      if (count < components(m->type))
        lines.push_back(fmt::format("'constants' gives {} of the {} components of '{}'", count,
                                    components(m->type), m->path));
  }

  /// Whether a scalar of that type can be this number; else it is a contradiction.
  bool holds(const char* where, const std::string& key, const std::string& type, double value) {
    const bool whole = value == std::trunc(value);
    const bool fine = type == "float"  ? std::abs(value) <= std::numeric_limits<float>::max()
                      : type == "uint" ? whole && value >= 0 && value <= 4294967295.0
                      : type == "int"  ? whole && std::abs(value) <= 2147483647.0
                                       : type == "bool" && (value == 0 || value == 1);
    if (!fine)
      lines.push_back(fmt::format("'{}' gives '{}' the number {}, but it is {} in the shader",
                                  where, key, value, type));
    return fine;
  }

  static std::uint32_t bitsOf(const std::string& type, double value) {
    if (isFloat(type)) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    if (value < 0) return static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
    return static_cast<std::uint32_t>(value);
  }

  void takeSpecialization() {
    if (adapter == nullptr) return;
    for (const auto& [name, value] : adapter->specialization) {
      const std::string& key = name;  // what a lambda may capture
      const auto found = std::ranges::find_if(module.constants, [&](const ReflectedConstant& c) {
        return (!c.name.empty() && c.name == key) || std::to_string(c.id) == key;
      });
      if (found == module.constants.end()) {
        lines.push_back(fmt::format(
            "'specialization' gives '{}' a value, but the shader has no such constant", key));
        continue;
      }
      if (!holds("specialization", key, found->type, value)) continue;
      result.specialization[found->id] = bitsOf(found->type, value);
      for (unsigned axis = 0; axis < 3; ++axis)
        if (module.groupSizeIds[axis] == found->id) resizeGroup(axis, value);
    }
  }

  void resizeGroup(unsigned axis, double value) {
    if (value < 1 || value > kMostThreads) {
      lines.push_back(
          fmt::format("'specialization' makes a group of {} threads on axis {}", value, axis));
      return;
    }
    const auto threads = static_cast<unsigned>(value);
    result.groupSize[axis] = threads;
    if (!adapter->grid) result.covered[axis] = threads;
  }

  void refuseLeftovers() {
    for (const ReflectedBinding& b : module.bindings) {
      if (b.kind == "sampler" && adapter != nullptr && !used.contains(&b)) {
        result.images.push_back(
            {.slot = {.set = b.set, .binding = b.binding, .kind = BindingSlot::Kind::kSampler}});
        continue;
      }
      if (!used.contains(&b))
        lines.push_back(fmt::format(
            "the shader binds {} '{}' (set {}, binding {}), which the contract does not know",
            b.kind, b.name, b.set, b.binding));
    }
    for (const ReflectedBinding* block : blocks) {
      if (!used.contains(block)) continue;
      const bool parameters = block->kind == "uniform buffer";
      if (adapter == nullptr || parameters) refuseMembers(block->members, block->name, parameters);
    }
    if (adapter != nullptr || record.push.size == module.pushBytes)
      refuseMembers(module.push, "push", true);
  }

  void refuseMembers(const std::vector<ReflectedMember>& members, const std::string& block,
                     bool parameters) {
    for (const ReflectedMember& m : members) {
      if (taken.contains(&m)) continue;
      const bool unnamed = m.path.find_first_not_of(".[]") == std::string::npos;
      const std::string name =
          unnamed ? fmt::format("{}@{}", block, m.offset) : fmt::format("{}.{}", block, m.path);
      lines.push_back(
          parameters && adapter != nullptr
              ? fmt::format("nothing gives '{}' ({}) a value: name it in 'fields' or 'constants'",
                            name, m.type)
              : fmt::format("{} ({}) stands in the shader but not in the contract", name, m.type));
    }
  }

  const KernelRecord& record;
  const Reflection& module;
  const Adapter* adapter;
  Interface result;
  std::vector<const ReflectedBinding*> blocks;  ///< as result.buffers
  std::set<const ReflectedBinding*> used;
  std::set<const ReflectedMember*> taken;
  std::map<const ReflectedMember*, unsigned> given;  ///< components that 'constants' names
  std::vector<std::string> lines;
  std::vector<std::string> missing;  ///< of the field at hand
};

void refuseConventions(const KernelRecord& record, const Adapter& adapter,
                       std::vector<std::string>& lines) {
  for (const auto& [name, value] : adapter.conventions) {
    const auto known = record.conventions.find(name);
    if (known == record.conventions.end())
      lines.push_back(fmt::format("the convention '{}' says nothing for this kernel", name));
    else if (std::ranges::find(known->second, value) == known->second.end())
      lines.push_back(fmt::format("the convention '{}' is one of {}, not '{}'", name,
                                  fmt::join(known->second, ", "), value));
  }
}

}  // namespace

Interface interfaceOf(const KernelRecord& record, const Reflection& reflection,
                      const Adapter* adapter, const std::string& origin) {
  Matcher matcher(record, reflection, adapter);
  Interface result = matcher.match();
  std::vector<std::string> lines = matcher.contradictions();
  if (adapter != nullptr) refuseConventions(record, *adapter, lines);
  if (!lines.empty())
    throw UsageError(fmt::format("{} does not fit the contract of {}:\n  {}", origin, record.name(),
                                 fmt::join(lines, "\n  ")));
  return result;
}

}  // namespace gnomon
