// Structs that stages share: what a scene is to a kernel.
#ifndef GNOMON_SCENE_H
#define GNOMON_SCENE_H

#include "contract.h"

GNOMON_CONTRACT(scene)

// A camera, as the host rounds it from double (kernels/culling/camera.h). View space is
// right-handed and looks down -Z; clip space has z in [0, 1], near at 1 and far at 0 (reverse-Z). A
// plane is (n, d) with n of unit length and pointing inward: p is inside where dot(n, p) + d >= 0.
// A plane that there is not, as the far one of an infinite projection, is 0.
struct Camera {
  mat4 view;            // world to view; rotation and translation alone
  mat4 projection;      // view to clip: perspective (projection[2][3] == -1) or orthographic (0)
  mat4 viewProjection;  // world to clip
  vec4 left;            // planes of the frustum, in world space
  vec4 right;
  vec4 bottom;
  vec4 top;
  vec4 nearPlane;
  vec4 farPlane;
  float near;  // distance of the near plane along the view axis, > 0
};

// A sphere around an object, world space.
struct Bounds {
  vec3 centre;
  float radius;
};

// VkDrawIndexedIndirectCommand.
struct DrawCommand {
  uint indexCount;
  uint instanceCount;
  uint firstIndex;
  int vertexOffset;
  uint firstInstance;  // the index of the object
};

GNOMON_CONTRACT_END

#endif
