// Entry culling/frustum_subgroups: the same with subgroup operations.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_memory_scope_semantics : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#define GNOMON_SUBGROUPS
#include "frustum.glsl"
