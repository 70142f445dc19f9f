// A level of a depth pyramid where each texel of an odd parent takes three columns or rows.
#version 450
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 16, local_size_y = 16) in;
layout(binding = 0) uniform texture2D parent;
layout(binding = 1, r32f) writeonly uniform image2D level;
layout(push_constant) uniform Push { uvec2 parentSize; };

void main() {
  const ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = ivec2(parentSize);
  if (any(greaterThanEqual(at, max(size / 2, ivec2(1))))) return;
  const ivec2 taps = 2 + (size & 1);
  float farthest = 3.402823466e38;
  for (int y = 0; y < taps.y; ++y)
    for (int x = 0; x < taps.x; ++x) {
      const float depth = texelFetch(parent, min(2 * at + ivec2(x, y), size - 1), 0).r;
      farthest = min(farthest, depth >= 1.175494351e-38 && depth <= 3.402823466e38 ? depth : 0.0);
    }
  imageStore(level, at, vec4(farthest));
}
