// Host side of culling: cameras, bounding spheres and the padding that makes rounding harmless. In
// double, rounded once at the end.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "kernels/scene.h"

namespace gnomon::culling {

using scene::Bounds;
using scene::Camera;

/// Reverse-Z projections of a right-handed view space that looks down -Z, y downward on the screen
/// (Vulkan). fovY is the vertical angle in radians, aspect width / height, distances in world units
/// with 0 < near < far. Without a far plane: infinite.
glm::dmat4 perspective(double fovY, double aspect, double near, double far);
glm::dmat4 perspective(double fovY, double aspect, double near);
/// Through the rectangle [left, right] x [bottom, top] of the near plane, which need not hold the
/// axis: tiles of a wall of screens, jitter, mirrors.
glm::dmat4 offAxis(double left, double right, double bottom, double top, double near);
glm::dmat4 orthographic(double left, double right, double bottom, double top, double near,
                        double far);

/// Planes after Gribb and Hartmann 2001, "Fast Extraction of Viewing Frustum Planes from the
/// World-View-Projection Matrix": rows of the matrix, here with z in [0, 1] and reversed: near is w
/// - z >= 0, far z >= 0. Normalised; a plane whose normal is shorter than 2^-50 of the longest row
/// is none. `view` is a rotation and a translation.
Camera cameraOf(const glm::dmat4& view, const glm::dmat4& projection, double near);

/// The sphere around a sphere that an affine transform may stretch, shear or mirror. Its radius
/// grows by the transform's largest stretch, bounded from above after Gershgorin: the largest sum
/// of magnitudes in a row of M^T M, which is exact for a rotation after any scale along axes.
Bounds boundsOf(const glm::dmat4& transform, const glm::dvec3& centre, double radius);

/// What to add to every radius so that rounding never hides an object. `extent` is the largest
/// distance between any two points of the scene, the camera, and the origin.
///
/// With u = 2^-23 (a product or sum may be rounded either way): a plane's four terms and its
/// rounded normal err by (4 + 3) u extent; the transform into view space by 4 sqrt(3) u extent
/// along each axis; a slope or a depth, in some ten operations of relative error u (a division 2.5
/// u), is that of a sphere moved by less than 15 u d, d <= extent; the depth buffer itself is
/// rounded once. In all less than 32 u extent. What is left, the rounding of a pixel's coordinate,
/// is far below the half pixel between a pixel's edge and the centre that has to be covered.
float padAgainstRounding(double extent);

}  // namespace gnomon::culling
