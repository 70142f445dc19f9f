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

/// Of one candidate in a list.
Struct membership() {
  Field visible = typed("uint", ScalarType::kUint, 1);
  visible.name = "visible";
  return {.name = "Membership", .size = 4, .fields = {visible}};
}

}  // namespace

std::string Field::scalarName(unsigned component) const {
  if (scalars == 1) return name;
  return scalars <= 4 ? fmt::format("{}.{}", name, "xyzw"[component])
                      : fmt::format("{}[{}]", name, component);
}

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

const ListSpec& KernelRecord::list(std::string_view called) const {
  return named(*this, lists, called, "list");
}

Struct KernelRecord::layoutOf(std::string_view output) const {
  if (std::ranges::find(lists, output, &ListSpec::name) != lists.end()) return membership();
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
