// Contract of stage culling: which objects a camera can see, as a list of draws.
#ifndef GNOMON_CULLING_H
#define GNOMON_CULLING_H

#include "../contract.h"
#include "../scene.h"

GNOMON_CONTRACT(culling)
#ifdef __cplusplus
using scene::Bounds;
using scene::Camera;
using scene::DrawCommand;
#endif

// Lists. `frustum` and `occlusion` copy the draw of every visible candidate into `draws`, dense and
// in input order. Where more are visible than `capacity`, the first of them are listed. Draws
// beyond the list stay untouched: a host without vkCmdDrawIndexedIndirectCount zeroes the buffer
// first and draws all of it. A dispatch has a group for every kBlock candidates, at least one.
struct Tally {      // of one dispatch; a host reads it some frames later
  uint tested;      // candidates
  uint total;       // of them visible
  uint listed;      // min(total, capacity); the count of vkCmdDrawIndexedIndirectCount
  uint overflowed;  // 1 where total > capacity, else 0
  uint recounted;   // blocks that were counted again because nobody answered in time
};

// frustum: a candidate is visible unless its sphere, grown by `pad`, lies wholly outside one plane;
// touching is visible. Its draw is commands[i] with firstInstance = i.
// Bad input: bounds that are not finite, exceed kMostWorld in a number, or have a negative radius
// (-0 too) make an object visible.
struct Frustum {     // push constants
  uint count;        // of bounds and commands
  uint capacity;     // of draws
  uint noNearPlane;  // 1: casters of shadows count though they lie before the near plane
  float pad;         // world units, >= 0, added to every radius: makes up for rounding (camera.h)
  uint patience;     // see kPatience
};

// occlusion: of the draws that frustum has listed those that are not hidden behind the depth
// buffer. The object's sphere, grown by `pad`, has nearest depth z and covers pixels [x0, x1] x
// [y0, y1] of the screen (clamped to it). With the smallest level L >= 0 so that 2^L >= the longer
// side in pixels, but at most the last level, it is visible where z >= the smallest of the texels
// (min(x >> L, width - 1), min(y >> L, height - 1)) of the four corners, level 0 being the depth
// buffer itself. A sphere that reaches nearer than the near plane is visible, and one so far to the
// side that x or y below exceeds kSteepest.
// The rectangle and z, in this arrangement (Mara and McGuire 2013, scaled by the distance d of the
// centre along the view axis; perspective; c is the centre in view space):
//   x = |c.x| / d, rho = r / d, t = sqrt(x^2 + (1 - rho) (1 + rho)), 1 - rho = (d - r) / d
//   far side  (t x + rho) (t + rho x) / ((1 - rho) (1 + rho) (1 + x^2)),
//   near side (t x - rho) / (t + rho x), as slopes c.x / d, mirrored where c.x < 0
// Orthographic: c.x -+ r, and z at d - r in both.
// Bad input: as of frustum; a draw whose firstInstance is no object is visible.
struct Occlusion {  // push constants
  uvec2 size;       // of the depth buffer, pixels
  uint objects;     // of bounds
  uint candidates;  // that `survivors` holds; the frustum's tally says how many there are
  uint capacity;    // of draws
  float pad;        // as of frustum
  uint patience;    // see kPatience
};

// hiz: the pyramid of farthest depths. Level 0 is the depth buffer; level L has max(1, floor(w /
// 2^L)) x max(1, floor(h / 2^L)) texels, down to 1 x 1. Texel x of it covers the columns [x 2^L, (x
// + 1) 2^L), the last one to the end of the image; rows likewise; its value is the smallest depth
// there, bit-exact. Element m of `levels` is level m + 1.
// Bad input: a depth that is NaN, infinite or negative counts as 0, the farthest; -0 is 0. So does
// one below the smallest normal float, since a device may read a denormal as 0.
struct Hiz {   // push constants
  uvec2 size;  // of the depth buffer, pixels
};

// hiz_level: one level from the one before it (or the first from the depth buffer), for devices
// that cannot write all levels in one dispatch. Pixels beyond the size are not touched.
struct HizLevel {  // push constants
  uvec2 size;      // of the parent, pixels
};

const float kSteepest = 1048576.0f;            // 2^20
const float kMostWorld = 1125899906842624.0f;  // 2^50: its squares are far from overflow

const uint kGroupSize = 256;  // threads of frustum and occlusion: each has four candidates
const uint kBlock = 1024;     // candidates that one group counts

// How often a thread asks other groups for their counts in vain, in all, before it counts for
// itself; 0 asks nobody. Mesa's llvmpipe ends every loop of a thread that has made 65,535 passes
// through loops, so it stays well below.
const uint kPatience = 20000;

// Scratch of frustum and occlusion, zero before and after a dispatch: kBlocks + one a block.
const uint kTicket = 0;     // blocks taken so far
const uint kFinished = 1;   // groups that are done
const uint kTotal = 2;      // visible candidates, as far as said; of the last block all
const uint kRecounted = 3;  // blocks counted again
const uint kBlocks = 4;     // from here on for each block its count + 1, 0: not counted yet

const uint kCamera = 0;  // binding numbers of frustum, set 0
const uint kBounds = 1;
const uint kCommands = 2;
const uint kDraws = 3;
const uint kTally = 4;
const uint kScratch = 5;

const uint kSurvivors = 2;  // of occlusion, the others as of frustum
const uint kFound = 6;      // the frustum's tally
const uint kDepth = 7;      // texture2D, D32 in a frame
const uint kPyramid = 8;    // texture2D, R32F; its mip level m is level m + 1

const uint kHizDepth = 0;    // of hiz
const uint kHizLevels = 1;   // image2D[kMaxLevels], R32F
const uint kHizScratch = 2;  // uint: groups that are done, then a texel of level kHizTile a group
const uint kHizNearest = 3;  // sampler: of the nearest texel, clamped to the edge
const uint kMaxLevels = 14;  // of images up to 32767 pixels a side
const uint kHizTile = 6;     // a group makes one texel of this level, and all below it
const uint kHizGroup = 256;

const uint kHizParent = 0;  // of hiz_level: texture2D, D32 or R32F
const uint kHizLevel = 1;   // image2D, R32F
const uint kHizGroupSide = 8;

GNOMON_CONTRACT_END

#endif
