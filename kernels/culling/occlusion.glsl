// Occlusion culling: the spheres of what the frustum has left against the pyramid of depths.
#include "culling.h"
#include "bounds.glsl"
#include "hiz.glsl"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Occlusion push; };
layout(set = 0, binding = kCamera, scalar) readonly buffer Cameras { Camera camera[]; };
layout(set = 0, binding = kBounds, scalar) readonly buffer Spheres { Bounds bounds[]; };
layout(set = 0, binding = kSurvivors, scalar) readonly buffer Survivors {
  DrawCommand survivors[];
};
layout(set = 0, binding = kFound, scalar) readonly buffer Found { Tally found[]; };
layout(set = 0, binding = kDraws, scalar) writeonly buffer Draws { DrawCommand draws[]; };
layout(set = 0, binding = kTally, scalar) writeonly buffer Tallies { Tally tally[]; };
layout(set = 0, binding = kScratch, scalar) coherent buffer Scratch { uint scratch[]; };
layout(set = 0, binding = kDepth) uniform texture2D depth;
layout(set = 0, binding = kPyramid) uniform texture2D pyramid;

#include "compact.glsl"

// What a sphere covers along one axis, as slopes x / d; the arrangement is the contract's.
// Mara and McGuire 2013, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere", eq.
// 1: the tangents from the eye.
vec2 slopes(float c, float d, float r, float nearest) {
  precise const float x = abs(c) / d, rho = r / d;
  precise const float rest = nearest / d * (1.0 + rho);  // 1 - rho^2
  precise const float t = sqrt(x * x + rest);
  precise const float side = t + rho * x;
  precise const float far = (t * x + rho) * side / (rest * (1.0 + x * x));
  precise const float near = (t * x - rho) / side;
  const vec2 both = vec2(near, far);
  return c < 0.0 ? -both : both;
}

// The same as clip coordinates x / w, in order.
vec2 covered(float c, float d, float r, float nearest, float scale, float skew, float shift,
             bool perspective) {
  precise vec2 clip;
  if (perspective)
    clip = scale * slopes(c, d, r, nearest) - skew;
  else
    clip = scale * vec2(c - r, c + r) + shift;
  return vec2(min(clip.x, clip.y), max(clip.x, clip.y));
}

// First and last pixel on the screen, clamped to it; a conversion rounds down what is not negative.
uvec2 pixels(vec2 clip, uint size) {
  precise const vec2 at = (clip * 0.5 + 0.5) * float(size);
  return uvec2(clamp(at, 0.0, float(size - 1)));
}

float texel(uvec2 at, uint level) {
  if (level > 0) return texelFetch(pyramid, ivec2(at), int(level) - 1).r;
  return uintBitsToFloat(depthBits(texelFetch(depth, ivec2(at), 0).r));
}

// findMSB of 0 is -1, so that a single pixel is on level 0. Where a level has no texel for a side
// but the one that takes all, x is 0 already, and 0 - 1 is beyond it.
float farthestIn(uvec2 x, uvec2 y) {
  const uint side = max(x[1] - x[0], y[1] - y[0]) + 1;
  const int last = findMSB(max(push.size.x, push.size.y));
  const uint level = uint(min(findMSB(side - 1) + 1, last));
  const uvec2 end = (push.size >> level) - 1;
  x = min(x >> level, end.x);
  y = min(y >> level, end.y);
  return min(min(texel(uvec2(x[0], y[0]), level), texel(uvec2(x[1], y[0]), level)),
             min(texel(uvec2(x[0], y[1]), level), texel(uvec2(x[1], y[1]), level)));
}

bool isNotHidden(vec3 centre, float r) {
  const mat4 projection = camera[0].projection;
  precise const vec3 c = (camera[0].view * vec4(centre, 1.0)).xyz;
  precise const float d = -c.z, nearest = d - r;
  if (nearest < camera[0].near) return true;
  const bool perspective = projection[2][3] != 0.0;
  if (perspective && !(max(abs(c.x), abs(c.y)) <= kSteepest * d)) return true;
  const vec2 x = covered(c.x, d, r, nearest, projection[0][0], projection[2][0], projection[3][0],
                         perspective);
  const vec2 y = covered(c.y, d, r, nearest, projection[1][1], projection[2][1], projection[3][1],
                         perspective);
  precise float z;
  if (perspective)
    z = projection[3][2] / nearest - projection[2][2];
  else
    z = projection[3][2] - projection[2][2] * nearest;
  return z >= farthestIn(pixels(x, push.size.x), pixels(y, push.size.y));
}

bool isVisible(uint candidate) {
  const uint object = survivors[candidate].firstInstance;
  if (object >= push.objects) return true;
  const Bounds b = bounds[object];
  if (!isUsable(b)) return true;
  precise const float reach = b.radius + push.pad;
  return isNotHidden(b.centre, reach);
}

void list(uint candidate, uint position) { draws[position] = survivors[candidate]; }

void main() { compact(min(found[0].listed, push.candidates), push.capacity, push.patience); }
