// What a shader reads of each stored texel.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#include "precision.h"

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Pixels push; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Out { Texel results[]; };
layout(set = 0, binding = kImage) uniform texture2D source;

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(at, push.size))) return;
  results[at.y * push.size.x + at.x].value = texelFetch(source, ivec2(at), 0);
}
