#include "harness/program/kernel.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "harness/error.h"

namespace gnomon {
namespace {

std::vector<KernelRecord>& records() {
  static std::vector<KernelRecord> all;
  return all;
}

// A record that has no such thing is a mistake in the code that asks.
template <class Spec>
const Spec& named(const KernelRecord& record, const std::vector<Spec>& all, std::string_view called,
                  const char* what) {
  const auto found = std::ranges::find(all, called, &Spec::name);
  if (found == all.end())
    throw std::logic_error(fmt::format("{} has no {} '{}'", record.name(), what, called));
  return *found;
}

Field typed(const char* type, ScalarType scalar, unsigned scalars) {
  return {.name = {}, .type = type, .scalar = scalar, .scalars = scalars};
}

// Members of a struct against those that the shader declares, position by position.
void compareMembers(std::vector<std::string>& lines, const std::string& where, const Struct& ours,
                    const std::vector<ReflectedMember>& theirs) {
  for (const Field& f : ours.fields) {
    const auto found = std::ranges::find(theirs, f.name, &ReflectedMember::path);
    if (found == theirs.end()) {
      lines.push_back(
          fmt::format("{} has no member '{}' in the shader; the contract has {} {} at "
                      "byte {}",
                      where, f.name, f.type, f.name, f.offset));
    } else if (found->type != f.type) {
      lines.push_back(fmt::format("{}.{} is {} in the shader, {} in the contract", where, f.name,
                                  found->type, f.type));
    } else if (found->offset != f.offset) {
      lines.push_back(fmt::format("{}.{} is at byte {} in the shader, {} in the contract", where,
                                  f.name, found->offset, f.offset));
    }
  }
  for (const ReflectedMember& m : theirs)
    if (std::ranges::find(ours.fields, m.path, &Field::name) == ours.fields.end())
      lines.push_back(fmt::format("{}.{} ({}) stands in the shader but not in the contract", where,
                                  m.path, m.type));
}

// The binding of that name, if it stands where the contract has it.
const ReflectedBinding* compareBinding(std::vector<std::string>& lines, const char* what,
                                       const std::string& name, unsigned binding,
                                       const Reflection& reflection) {
  const auto found = std::ranges::find(reflection.bindings, name, &ReflectedBinding::name);
  if (found == reflection.bindings.end()) {
    lines.push_back(
        fmt::format("the shader has no {} '{}', which the contract binds at set 0, binding {}",
                    what, name, binding));
    return nullptr;
  }
  if (found->set != 0 || found->binding != binding)
    lines.push_back(fmt::format(
        "'{}' is at set {}, binding {} in the shader, set 0, binding {} in the contract", name,
        found->set, found->binding, binding));
  return &*found;
}

void compareBuffer(std::vector<std::string>& lines, const BufferSpec& ours,
                   const Reflection& reflection) {
  const ReflectedBinding* theirs =
      compareBinding(lines, "buffer", ours.name, ours.binding, reflection);
  if (theirs == nullptr) return;
  if (theirs->kind != "storage buffer") {
    lines.push_back(fmt::format("'{}' is a {} in the shader, a storage buffer in the contract",
                                ours.name, theirs->kind));
    return;
  }
  if (theirs->stride != ours.element.size)
    lines.push_back(
        fmt::format("an element of '{}' takes {} bytes in the shader, {} in the contract",
                    ours.name, theirs->stride, ours.element.size));
  compareMembers(lines, ours.name, ours.element, theirs->members);
}

void compareImage(std::vector<std::string>& lines, const ImageSpec& ours,
                  const Reflection& reflection) {
  const ReflectedBinding* theirs =
      compareBinding(lines, "image", ours.name, ours.binding, reflection);
  if (theirs == nullptr) return;
  if (theirs->type != ours.type)
    lines.push_back(fmt::format("'{}' is {} in the shader, {} in the contract", ours.name,
                                theirs->type.empty() ? "a " + theirs->kind : theirs->type,
                                ours.type));
}

bool bindsNothingOf(const KernelRecord& record, const std::string& name) {
  return std::ranges::find(record.buffers, name, &BufferSpec::name) == record.buffers.end() &&
         std::ranges::find(record.images, name, &ImageSpec::name) == record.images.end();
}

}  // namespace

unsigned Struct::scalars() const {
  unsigned n = 0;
  for (const Field& f : fields) n += f.scalars;
  return n;
}

BindingSlot::Kind ImageSpec::kind() const {
  if (type == "sampler") return BindingSlot::Kind::kSampler;
  // Of integers they begin with a letter more: "uimage2D".
  if (type.find("image") != type.npos) return BindingSlot::Kind::kStorageImage;
  if (type.find("sampler") != type.npos) return BindingSlot::Kind::kCombined;
  return BindingSlot::Kind::kSampledImage;
}

Struct pixelLayout(PixelFormat format) {
  const ScalarType scalar = format == PixelFormat::kR32ui ? ScalarType::kUint : ScalarType::kFloat;
  const unsigned n = channels(format);
  Struct pixel{.name = "pixel", .size = 4 * n, .fields = {}};
  for (unsigned c = 0; c < n; ++c)
    pixel.fields.push_back({.name = std::string(1, "rgba"[c]),
                            .type = scalar == ScalarType::kUint ? "uint" : "float",
                            .scalar = scalar,
                            .offset = 4 * c,
                            .scalars = 1});
  return pixel;
}

const BufferSpec& KernelRecord::buffer(std::string_view called) const {
  return named(*this, buffers, called, "buffer");
}

const ImageSpec& KernelRecord::image(std::string_view called) const {
  return named(*this, images, called, "image");
}

Struct KernelRecord::layoutOf(std::string_view output) const {
  const auto found = std::ranges::find(images, output, &ImageSpec::name);
  return found != images.end() ? pixelLayout(found->format) : buffer(output).element;
}

Grid coveringGrid(const std::array<unsigned, 3>& groupSize) {
  return [groupSize](const Extent& extent) {
    const std::array sizes = {extent.width, extent.height, extent.depth};
    std::array<std::uint32_t, 3> groups{};
    for (std::size_t i = 0; i < groups.size(); ++i)
      groups[i] = static_cast<std::uint32_t>(
          std::max<std::size_t>(1, (sizes[i] + groupSize[i] - 1) / groupSize[i]));
    return groups;
  };
}

bool registerKernel(KernelRecord record) {
  records().push_back(std::move(record));
  return true;
}

std::vector<const KernelRecord*> catalogue() {
  std::vector<const KernelRecord*> all;
  for (const KernelRecord& r : records()) all.push_back(&r);
  std::ranges::sort(
      all, {}, [](const KernelRecord* r) { return std::make_tuple(r->order, r->stage, r->entry); });
  return all;
}

const KernelRecord& findKernel(std::string_view name) {
  std::vector<std::string> names;
  for (const KernelRecord* r : catalogue()) {
    if (r->name() == name) return *r;
    names.push_back(r->name());
  }
  throw UsageError(
      fmt::format("there is no kernel '{}'.\nKernels: {}", name, fmt::join(names, ", ")));
}

std::vector<std::string> contradictions(const KernelRecord& record, const Reflection& reflection) {
  std::vector<std::string> lines;
  for (const BufferSpec& b : record.buffers) compareBuffer(lines, b, reflection);
  for (const ImageSpec& i : record.images) compareImage(lines, i, reflection);
  for (const ReflectedBinding& b : reflection.bindings)
    if (bindsNothingOf(record, b.name))
      lines.push_back(
          fmt::format("the shader binds {} '{}' (set {}, binding {}), which the contract "
                      "does not know",
                      b.kind, b.name, b.set, b.binding));
  if (reflection.groupSize != record.groupSize)
    lines.push_back(fmt::format("a group is {} threads in the shader, {} in the contract",
                                fmt::join(reflection.groupSize, " x "),
                                fmt::join(record.groupSize, " x ")));
  if (reflection.pushBytes != record.push.size)
    lines.push_back(fmt::format("push constants take {} bytes in the shader, {} in the contract",
                                reflection.pushBytes, record.push.size));
  return lines;
}

template <>
Field typeOfMember<float>() {
  return typed("float", ScalarType::kFloat, 1);
}
template <>
Field typeOfMember<uint>() {
  return typed("uint", ScalarType::kUint, 1);
}
template <>
Field typeOfMember<int>() {
  return typed("int", ScalarType::kInt, 1);
}
template <>
Field typeOfMember<vec2>() {
  return typed("vec2", ScalarType::kFloat, 2);
}
template <>
Field typeOfMember<vec3>() {
  return typed("vec3", ScalarType::kFloat, 3);
}
template <>
Field typeOfMember<vec4>() {
  return typed("vec4", ScalarType::kFloat, 4);
}
template <>
Field typeOfMember<uvec2>() {
  return typed("uvec2", ScalarType::kUint, 2);
}
template <>
Field typeOfMember<uvec3>() {
  return typed("uvec3", ScalarType::kUint, 3);
}
template <>
Field typeOfMember<uvec4>() {
  return typed("uvec4", ScalarType::kUint, 4);
}
template <>
Field typeOfMember<ivec2>() {
  return typed("ivec2", ScalarType::kInt, 2);
}
template <>
Field typeOfMember<mat3>() {
  return typed("mat3", ScalarType::kFloat, 9);
}
template <>
Field typeOfMember<mat4>() {
  return typed("mat4", ScalarType::kFloat, 16);
}

}  // namespace gnomon
