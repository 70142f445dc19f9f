// A level of a depth pyramid whose first level has the power of two below the image's size: the
// smallest of the four texels that a linear filter would touch at the texel's centre.
#version 450
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform texture2D parent;
layout(binding = 1, r32f) writeonly uniform image2D level;

float depthAt(uvec2 at, uvec2 size) {
  const float depth = texelFetch(parent, ivec2(min(at, size - 1u)), 0).r;
  return depth >= 1.175494351e-38 && depth <= 3.402823466e38 ? depth : 0.0;
}

void main() {
  const uvec2 at = gl_GlobalInvocationID.xy;
  const uvec2 size = uvec2(imageSize(level)), from = uvec2(textureSize(parent, 0));
  if (any(greaterThanEqual(at, size))) return;
  const uvec2 tap = ((2u * at + 1u) * from - size) / (2u * size);
  const float farthest =
      min(min(depthAt(tap, from), depthAt(tap + uvec2(1, 0), from)),
          min(depthAt(tap + uvec2(0, 1), from), depthAt(tap + uvec2(1, 1), from)));
  imageStore(level, ivec2(at), vec4(farthest));
}
