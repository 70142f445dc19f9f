#include "harness/program/reflect.h"

#include <algorithm>
#include <memory>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <glslang/SPIRV/spirv.hpp>
#include <glslang/SPIRV/doc.h>
#include <spirv_cross/spirv_cross_c.h>

#include "harness/error.h"

namespace gnomon {
namespace {

/// SPIRV-Cross on one entry point. Pointers that it returns live as long as this.
class Cross {
 public:
  Cross(std::span<const std::uint32_t> module, const std::string& entryPoint);

  /// Throws what SPIRV-Cross has to say unless the call succeeded.
  void check(spvc_result result) const {
    if (result != SPVC_SUCCESS)
      throw UsageError(fmt::format("the module cannot be reflected: {}",
                                   spvc_context_get_last_error_string(context.get())));
  }

  spvc_type type(spvc_type_id id) const { return spvc_compiler_get_type_handle(compiler, id); }

  bool has(SpvId id, SpvDecoration decoration) const {
    return spvc_compiler_has_decoration(compiler, id, decoration) != SPVC_FALSE;
  }

  unsigned decoration(SpvId id, SpvDecoration decoration) const {
    return spvc_compiler_get_decoration(compiler, id, decoration);
  }

  unsigned constantValue(spvc_constant_id id) const {
    return spvc_constant_get_scalar_u32(spvc_compiler_get_constant_handle(compiler, id), 0, 0);
  }

  spvc_compiler compiler = nullptr;
  SpvExecutionModel model = SpvExecutionModelMax;
  spvc_resources resources = nullptr;

 private:
  void select(const std::string& entryPoint);

  std::unique_ptr<spvc_context_s, void (*)(spvc_context)> context{nullptr, spvc_context_destroy};
};

Cross::Cross(std::span<const std::uint32_t> module, const std::string& entryPoint) {
  spvc_context made = nullptr;
  if (spvc_context_create(&made) != SPVC_SUCCESS) throw std::bad_alloc();
  context.reset(made);
  spvc_parsed_ir ir = nullptr;
  check(spvc_context_parse_spirv(made, module.data(), module.size(), &ir));
  check(spvc_context_create_compiler(made, SPVC_BACKEND_NONE, ir, SPVC_CAPTURE_MODE_TAKE_OWNERSHIP,
                                     &compiler));
  select(entryPoint);
}

void Cross::select(const std::string& entryPoint) {
  const spvc_entry_point* found = nullptr;
  std::size_t count = 0;
  check(spvc_compiler_get_entry_points(compiler, &found, &count));
  const std::span entries(found, count);
  const auto entry = std::ranges::find(
      entries, std::string_view(entryPoint),
      [](const spvc_entry_point& candidate) { return std::string_view(candidate.name); });
  if (entry == entries.end()) {
    std::vector<std::string_view> names;
    for (const spvc_entry_point& candidate : entries) names.push_back(candidate.name);
    throw UsageError(
        fmt::format("no entry point '{}' in the module; it has: {}", entryPoint,
                    names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  model = entry->execution_model;
  check(spvc_compiler_set_entry_point(compiler, entryPoint.c_str(), model));
  if (count == 1) return check(spvc_compiler_create_shader_resources(compiler, &resources));
  spvc_set active = nullptr;
  check(spvc_compiler_get_active_interface_variables(compiler, &active));
  check(spvc_compiler_create_shader_resources_for_active_variables(compiler, &resources, active));
}

// ---- types ---------------------------------------------------------------------------------

struct Spelling {
  spvc_basetype base;
  const char* scalar;
  const char* vectorPrefix;  ///< of vec3 and mat4
};

constexpr Spelling kSpellings[] = {
    {SPVC_BASETYPE_BOOLEAN, "bool", "b"},      {SPVC_BASETYPE_INT8, "int8_t", "i8"},
    {SPVC_BASETYPE_UINT8, "uint8_t", "u8"},    {SPVC_BASETYPE_INT16, "int16_t", "i16"},
    {SPVC_BASETYPE_UINT16, "uint16_t", "u16"}, {SPVC_BASETYPE_INT32, "int", "i"},
    {SPVC_BASETYPE_UINT32, "uint", "u"},       {SPVC_BASETYPE_INT64, "int64_t", "i64"},
    {SPVC_BASETYPE_UINT64, "uint64_t", "u64"}, {SPVC_BASETYPE_FP16, "float16_t", "f16"},
    {SPVC_BASETYPE_FP32, "float", ""},         {SPVC_BASETYPE_FP64, "double", "d"},
};

Spelling spellingOf(spvc_type type) {
  const auto* found = std::ranges::find(kSpellings, spvc_type_get_basetype(type), &Spelling::base);
  return found == std::end(kSpellings) ? Spelling{SPVC_BASETYPE_UNKNOWN, "?", "?"} : *found;
}

std::string spelled(spvc_type type) {
  const Spelling spelling = spellingOf(type);
  const unsigned rows = spvc_type_get_vector_size(type);
  const unsigned columns = spvc_type_get_columns(type);
  if (columns > 1 && columns == rows) return fmt::format("{}mat{}", spelling.vectorPrefix, rows);
  if (columns > 1) return fmt::format("{}mat{}x{}", spelling.vectorPrefix, columns, rows);
  if (rows > 1) return fmt::format("{}vec{}", spelling.vectorPrefix, rows);
  return spelling.scalar;
}

const char* dimensionOf(spvc_type type) {
  switch (spvc_type_get_image_dimension(type)) {
    case SpvDim1D:
      return "1D";
    case SpvDim2D:
      return "2D";
    case SpvDim3D:
      return "3D";
    case SpvDimCube:
      return "Cube";
    case SpvDimRect:
      return "2DRect";
    case SpvDimBuffer:
      return "Buffer";
    default:
      return "";  // subpass data
  }
}

/// "image2D", "utexture2DArray", "sampler2DShadow"; separate samplers are plain "sampler".
std::string spelledOpaque(const Cross& cross, spvc_type type, std::string_view noun) {
  const spvc_basetype base = spvc_type_get_basetype(type);
  if (base != SPVC_BASETYPE_IMAGE && base != SPVC_BASETYPE_SAMPLED_IMAGE) return std::string(noun);
  const char* prefix = spellingOf(cross.type(spvc_type_get_image_sampled_type(type))).vectorPrefix;
  const bool shadow = base == SPVC_BASETYPE_SAMPLED_IMAGE && spvc_type_get_image_is_depth(type);
  return fmt::format("{}{}{}{}{}{}", prefix, noun, dimensionOf(type),
                     spvc_type_get_image_multisampled(type) ? "MS" : "",
                     spvc_type_get_image_arrayed(type) ? "Array" : "", shadow ? "Shadow" : "");
}

/// Element counts of a type's array dimensions, outermost first; 0: runtime.
std::vector<unsigned> arrayCounts(const Cross& cross, spvc_type type) {
  std::vector<unsigned> counts;
  for (unsigned i = spvc_type_get_num_array_dimensions(type); i-- > 0;) {  // innermost is 0
    const SpvId size = spvc_type_get_array_dimension(type, i);
    const bool literal = spvc_type_array_dimension_is_literal(type, i) != SPVC_FALSE;
    counts.push_back(literal ? size : cross.constantValue(size));
  }
  return counts;
}

// ---- blocks --------------------------------------------------------------------------------

/// Where a walk through nested structs stands.
struct Place {
  std::string path;
  unsigned offset = 0;
  std::vector<ReflectedArray> arrays;
};

/// One member of a struct in SPIRV-Cross's eyes.
struct Member {
  spvc_type_id owner = 0;
  unsigned index = 0;

  unsigned get(const Cross& cross,
               spvc_result (*query)(spvc_compiler, spvc_type, unsigned, unsigned*)) const {
    unsigned value = 0;
    cross.check(query(cross.compiler, cross.type(owner), index, &value));
    return value;
  }

  spvc_type type(const Cross& cross) const {
    return cross.type(spvc_type_get_member_type(cross.type(owner), index));
  }

  /// SPIRV-Cross tells the outermost stride only. The inner ones follow: an inner array fills its
  /// element of the outer one, in std140, std430 and scalar layout alike.
  std::vector<ReflectedArray> arrays(const Cross& cross) const {
    std::vector<ReflectedArray> dimensions;
    for (const unsigned count : arrayCounts(cross, type(cross))) {
      const unsigned stride = dimensions.empty()
                                  ? get(cross, spvc_compiler_type_struct_member_array_stride)
                                  : dimensions.back().stride / std::max(count, 1u);
      dimensions.push_back({count, stride});
    }
    return dimensions;
  }

  Place under(const Cross& cross, const Place& block) const {
    const std::string_view name = spvc_compiler_get_member_name(cross.compiler, owner, index);
    Place place = block;
    place.path += place.path.empty() || name.empty() ? "" : ".";
    place.path += name;
    place.offset += get(cross, spvc_compiler_type_struct_member_offset);
    for (const ReflectedArray& array : arrays(cross)) {
      place.path += array.count == 0 ? "[]" : fmt::format("[{}]", array.count);
      place.arrays.push_back(array);
    }
    return place;
  }
};

/// A pointer into device memory (buffer_reference) ends the walk: what it points to is no part of
/// the block, and may be the block itself again.
bool isReference(spvc_type type) {
  return spvc_type_get_storage_class(type) == SpvStorageClassPhysicalStorageBuffer;
}

ReflectedMember leafOf(const Cross& cross, const Member& member, const Place& place) {
  const spvc_type type = member.type(cross);
  ReflectedMember leaf;
  leaf.path = place.path;
  leaf.offset = place.offset;
  leaf.arrays = place.arrays;
  if (isReference(type)) {
    leaf.type = "uint64_t";
    leaf.size = 8;
    return leaf;
  }
  const unsigned rows = spvc_type_get_vector_size(type);
  const unsigned columns = spvc_type_get_columns(type);
  leaf.type = spelled(type);
  leaf.size = rows * spvc_type_get_bit_width(type) / 8;
  if (columns > 1) {
    leaf.matrixStride = member.get(cross, spvc_compiler_type_struct_member_matrix_stride);
    leaf.rowMajor = spvc_compiler_has_member_decoration(cross.compiler, member.owner, member.index,
                                                        SpvDecorationRowMajor) != SPVC_FALSE;
    leaf.size = leaf.matrixStride * (leaf.rowMajor ? rows : columns);
  }
  return leaf;
}

void flatten(const Cross& cross, spvc_type_id block, const Place& at,
             std::vector<ReflectedMember>& into) {
  for (unsigned i = 0; i < spvc_type_get_num_member_types(cross.type(block)); ++i) {
    const Member member{block, i};
    const Place place = member.under(cross, at);
    const spvc_type type = member.type(cross);
    if (spvc_type_get_basetype(type) == SPVC_BASETYPE_STRUCT && !isReference(type))
      flatten(cross, spvc_type_get_base_type_id(type), place, into);
    else
      into.push_back(leafOf(cross, member, place));
  }
}

/// The block's members; where it is nothing but one runtime array, those of an element.
void describeBlock(const Cross& cross, spvc_type_id block, ReflectedBinding& binding) {
  std::size_t bytes = 0;
  cross.check(spvc_compiler_get_declared_struct_size(cross.compiler, cross.type(block), &bytes));
  binding.bytes = static_cast<unsigned>(bytes);
  flatten(cross, block, {}, binding.members);
  if (spvc_type_get_num_member_types(cross.type(block)) != 1) return;
  const Member only{block, 0};
  const std::vector<ReflectedArray> arrays = only.arrays(cross);
  if (arrays.empty() || arrays[0].count != 0) return;
  binding.stride = arrays[0].stride;
  const std::string_view array = spvc_compiler_get_member_name(cross.compiler, block, 0);
  for (ReflectedMember& member : binding.members) {
    member.path.erase(0, array.size() + std::string_view("[]").size());
    if (member.path.starts_with('.')) member.path.erase(0, 1);
    member.arrays.erase(member.arrays.begin());
  }
}

// ---- bindings ------------------------------------------------------------------------------

struct Kind {
  spvc_resource_type resource;
  const char* name;
  const char* texelBuffer;  ///< the kind where the image's dimension is Buffer
  const char* noun;         ///< of the GLSL type; empty: a block
};

constexpr Kind kKinds[] = {
    {SPVC_RESOURCE_TYPE_STORAGE_BUFFER, "storage buffer", "", ""},
    {SPVC_RESOURCE_TYPE_UNIFORM_BUFFER, "uniform buffer", "", ""},
    {SPVC_RESOURCE_TYPE_STORAGE_IMAGE, "storage image", "storage texel buffer", "image"},
    {SPVC_RESOURCE_TYPE_SAMPLED_IMAGE, "combined image sampler", "uniform texel buffer", "sampler"},
    {SPVC_RESOURCE_TYPE_SEPARATE_IMAGE, "sampled image", "uniform texel buffer", "texture"},
    {SPVC_RESOURCE_TYPE_SEPARATE_SAMPLERS, "sampler", "", "sampler"},
    {SPVC_RESOURCE_TYPE_SUBPASS_INPUT, "input attachment", "", "subpassInput"},
    {SPVC_RESOURCE_TYPE_ACCELERATION_STRUCTURE, "acceleration structure", "",
     "accelerationStructureEXT"},
};

std::span<const spvc_reflected_resource> resourcesOf(const Cross& cross, spvc_resource_type type) {
  const spvc_reflected_resource* found = nullptr;
  std::size_t count = 0;
  cross.check(spvc_resources_get_resource_list_for_type(cross.resources, type, &found, &count));
  return {found, count};
}

std::string nameOf(const Cross& cross, const spvc_reflected_resource& resource, bool isBlock) {
  const std::string instance = spvc_compiler_get_name(cross.compiler, resource.id);
  if (!instance.empty() || !isBlock) return instance;
  if (spvc_type_get_num_member_types(cross.type(resource.base_type_id)) == 1)
    return spvc_compiler_get_member_name(cross.compiler, resource.base_type_id, 0);
  return spvc_compiler_get_name(cross.compiler, resource.base_type_id);
}

/// NonWritable and NonReadable stand on the variable, or on every member of its block.
void describeAccess(const Cross& cross, SpvId variable, bool isBlock, ReflectedBinding& binding) {
  binding.readOnly = cross.has(variable, SpvDecorationNonWritable);
  binding.writeOnly = cross.has(variable, SpvDecorationNonReadable);
  if (!isBlock) return;
  const SpvDecoration* found = nullptr;
  std::size_t count = 0;
  cross.check(spvc_compiler_get_buffer_block_decorations(cross.compiler, variable, &found, &count));
  for (const SpvDecoration decoration : std::span(found, count)) {
    binding.readOnly |= decoration == SpvDecorationNonWritable;
    binding.writeOnly |= decoration == SpvDecorationNonReadable;
  }
}

ReflectedBinding bindingOf(const Cross& cross, const Kind& kind,
                           const spvc_reflected_resource& resource) {
  const bool isBlock = std::string_view(kind.noun).empty();
  const spvc_type type = cross.type(resource.type_id);
  ReflectedBinding binding;
  binding.name = nameOf(cross, resource, isBlock);
  binding.kind = kind.name;
  binding.set = cross.decoration(resource.id, SpvDecorationDescriptorSet);
  binding.binding = cross.decoration(resource.id, SpvDecorationBinding);
  for (const unsigned count : arrayCounts(cross, type)) binding.count *= count;
  describeAccess(cross, resource.id, isBlock, binding);
  if (isBlock) {
    describeBlock(cross, resource.base_type_id, binding);
    return binding;
  }
  binding.type = spelledOpaque(cross, type, kind.noun);
  if (binding.type.ends_with("Buffer")) binding.kind = kind.texelBuffer;
  return binding;
}

std::vector<ReflectedBinding> bindingsOf(const Cross& cross) {
  std::vector<ReflectedBinding> bindings;
  for (const Kind& kind : kKinds)
    for (const spvc_reflected_resource& resource : resourcesOf(cross, kind.resource))
      bindings.push_back(bindingOf(cross, kind, resource));
  std::ranges::stable_sort(bindings, {}, [](const ReflectedBinding& binding) {
    return std::pair(binding.set, binding.binding);
  });
  return bindings;
}

// ---- the rest of the interface -------------------------------------------------------------

const char* stageName(SpvExecutionModel model) {
  switch (model) {
    case SpvExecutionModelGLCompute:
      return "compute";
    case SpvExecutionModelVertex:
      return "vertex";
    case SpvExecutionModelFragment:
      return "fragment";
    case SpvExecutionModelTessellationControl:
      return "tessellation control";
    case SpvExecutionModelTessellationEvaluation:
      return "tessellation evaluation";
    case SpvExecutionModelGeometry:
      return "geometry";
    case SpvExecutionModelTaskEXT:
      return "task";
    case SpvExecutionModelMeshEXT:
      return "mesh";
    default:
      return "other";
  }
}

/// SPIRV-Cross answers alike for LocalSize, LocalSizeId and what overrides them: a constant with
/// the WorkgroupSize built-in (which is how glslang writes local_size_x_id before SPIR-V 1.6).
void describeGroupSize(const Cross& cross, Reflection& reflection) {
  std::array<spvc_specialization_constant, 3> constants{};
  spvc_compiler_get_work_group_size_specialization_constants(cross.compiler, &constants[0],
                                                             &constants[1], &constants[2]);
  for (unsigned i = 0; i < 3; ++i) {
    reflection.groupSize[i] = spvc_compiler_get_execution_mode_argument_by_index(
        cross.compiler, SpvExecutionModeLocalSize, i);
    if (constants[i].id == 0) continue;
    reflection.groupSize[i] = cross.constantValue(constants[i].id);
    reflection.groupSizeIds[i] = constants[i].constant_id;
  }
}

void describePush(const Cross& cross, Reflection& reflection) {
  for (const spvc_reflected_resource& resource :
       resourcesOf(cross, SPVC_RESOURCE_TYPE_PUSH_CONSTANT)) {
    std::size_t bytes = 0;
    cross.check(spvc_compiler_get_declared_struct_size(cross.compiler,
                                                       cross.type(resource.base_type_id), &bytes));
    reflection.pushBytes = static_cast<unsigned>(bytes);
    flatten(cross, resource.base_type_id, {}, reflection.push);
  }
}

std::vector<ReflectedConstant> constantsOf(const Cross& cross) {
  const spvc_specialization_constant* found = nullptr;
  std::size_t count = 0;
  cross.check(spvc_compiler_get_specialization_constants(cross.compiler, &found, &count));
  std::vector<ReflectedConstant> constants;
  for (const auto& [id, constantId] : std::span(found, count)) {
    const spvc_constant constant = spvc_compiler_get_constant_handle(cross.compiler, id);
    constants.push_back({.name = spvc_compiler_get_name(cross.compiler, id),
                         .id = constantId,
                         .type = spelled(cross.type(spvc_constant_get_type(constant))),
                         .value = cross.constantValue(id)});
  }
  std::ranges::sort(constants, {}, &ReflectedConstant::id);
  return constants;
}

std::vector<std::string> capabilitiesOf(const Cross& cross) {
  const SpvCapability* found = nullptr;
  std::size_t count = 0;
  cross.check(spvc_compiler_get_declared_capabilities(cross.compiler, &found, &count));
  std::vector<std::string> names;
  for (const SpvCapability capability : std::span(found, count))
    names.emplace_back(spv::CapabilityString(static_cast<int>(capability)));
  return names;
}

}  // namespace

Reflection reflect(std::span<const std::uint32_t> module, const std::string& entryPoint) {
  const Cross cross(module, entryPoint);
  Reflection reflection;
  reflection.entryPoint = entryPoint;
  reflection.stage = stageName(cross.model);
  if (cross.model == SpvExecutionModelGLCompute) describeGroupSize(cross, reflection);
  reflection.bindings = bindingsOf(cross);
  describePush(cross, reflection);
  reflection.constants = constantsOf(cross);
  reflection.capabilities = capabilitiesOf(cross);
  return reflection;
}

}  // namespace gnomon
