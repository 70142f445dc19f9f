// Frustum culling: spheres against planes, the draws of what is visible compacted in order.
#include "culling.h"
#include "bounds.glsl"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Frustum push; };
layout(set = 0, binding = kCamera, scalar) readonly buffer Cameras { Camera camera[]; };
layout(set = 0, binding = kBounds, scalar) readonly buffer Spheres { Bounds bounds[]; };
layout(set = 0, binding = kCommands, scalar) readonly buffer Commands { DrawCommand commands[]; };
layout(set = 0, binding = kDraws, scalar) writeonly buffer Draws { DrawCommand draws[]; };
layout(set = 0, binding = kTally, scalar) writeonly buffer Tallies { Tally tally[]; };
layout(set = 0, binding = kScratch, scalar) coherent buffer Scratch { uint scratch[]; };

#include "compact.glsl"

bool touches(vec4 plane, vec3 centre, float reach) {
  precise const float distance = dot(plane.xyz, centre) + plane.w;
  return distance >= -reach;
}

bool isVisible(uint candidate) {
  const Bounds b = bounds[candidate];
  if (!isUsable(b)) return true;
  precise const float reach = b.radius + push.pad;
  return touches(camera[0].left, b.centre, reach) && touches(camera[0].right, b.centre, reach) &&
         touches(camera[0].bottom, b.centre, reach) && touches(camera[0].top, b.centre, reach) &&
         (push.noNearPlane != 0 || touches(camera[0].nearPlane, b.centre, reach)) &&
         touches(camera[0].farPlane, b.centre, reach);
}

void list(uint candidate, uint position) {
  draws[position] = commands[candidate];
  draws[position].firstInstance = candidate;
}

void main() { compact(push.count, push.capacity, push.patience); }
