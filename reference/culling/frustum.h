// CPU model of culling/frustum: spheres against planes.
#pragma once

#include "kernels/culling/culling.h"
#include "reference/bound/vec.h"

namespace gnomon::culling {

/// Whether a sphere is one at all; else the contract has its object visible.
bool isUsable(const Bounds& sphere);

/// 1 where the sphere, grown by push.pad, reaches the inner side of every plane: its centre is not
/// farther outside than its radius. 0 where it lies wholly outside one of them. Of bounds both,
/// where rounding may decide.
template <class T>
T inFrustum(const Camera& camera, const Bounds& sphere, const Frustum& push);

}  // namespace gnomon::culling
