// One level of the pyramid of farthest depths from the one before it: one texel a thread.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#include "culling.h"
#include "hiz.glsl"

layout(local_size_x = kHizGroupSide, local_size_y = kHizGroupSide) in;
layout(push_constant, scalar) uniform Push { HizLevel push; };
layout(set = 0, binding = kHizParent) uniform texture2D parent;
layout(set = 0, binding = kHizLevel) writeonly uniform image2D level;

void main() {
  const uvec2 size = max(push.size / 2u, uvec2(1));
  const uvec2 at = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(at, size))) return;
  const uvec2 begin = 2u * at;
  // The last texel takes what is left: three of an odd parent, one of a parent of one.
  const uvec2 end = mix(begin + 2u, push.size, equal(at, size - 1u));
  uint farthest = kBeyondDepth;
  for (uint y = begin.y; y < end.y; ++y)
    for (uint x = begin.x; x < end.x; ++x)
      farthest = min(farthest, depthBits(texelFetch(parent, ivec2(x, y), 0).r));
  imageStore(level, ivec2(at), vec4(uintBitsToFloat(farthest)));
}
