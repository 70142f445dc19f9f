// Entry culling/occlusion.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_memory_scope_semantics : require
#extension GL_EXT_samplerless_texture_functions : require
#include "occlusion.glsl"
