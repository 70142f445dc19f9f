// Stores floats in an image and computes nothing.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_image_load_formatted : require
#include "precision.h"

layout(local_size_x = kGroupSide, local_size_y = kGroupSide) in;
layout(push_constant, scalar) uniform Push { Pixels push; };
layout(set = 0, binding = kTexels, scalar) readonly buffer In { Texel texels[]; };
layout(set = 0, binding = kImage) writeonly uniform image2D target;

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(at, push.size))) return;
  imageStore(target, ivec2(at), texels[at.y * push.size.x + at.x].value);
}
