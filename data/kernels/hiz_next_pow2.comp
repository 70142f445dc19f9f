// A level of a depth pyramid over the next power of two: twice two texels of the parent a texel,
// whatever the size; beyond the image its edge is repeated.
#version 450
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 16, local_size_y = 16) in;
layout(binding = 0) uniform texture2D parent;
layout(binding = 1, r32f) writeonly uniform image2D level;
layout(push_constant) uniform Push { uvec2 size; };  // of the parent

float depthAt(ivec2 at) {
  const float depth = texelFetch(parent, min(at, ivec2(size) - 1), 0).r;
  return depth >= 1.175494351e-38 && depth <= 3.402823466e38 ? depth : 0.0;
}

ivec2 halfOfNextPowerOfTwo() { return ivec2(1) << max(findMSB(ivec2(size) - 1), 0); }

void main() {
  const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, halfOfNextPowerOfTwo()))) return;
  const float farthest = min(min(depthAt(2 * at), depthAt(2 * at + ivec2(1, 0))),
                             min(depthAt(2 * at + ivec2(0, 1)), depthAt(2 * at + ivec2(1, 1))));
  imageStore(level, at, vec4(farthest));
}
