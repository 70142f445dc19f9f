// Contract of stage tonemap: linear HDR and its bloom in, colour encoded for a display out.
#ifndef GNOMON_TONEMAP_H
#define GNOMON_TONEMAP_H

#include "../contract.h"

GNOMON_CONTRACT(tonemap)

// For every pixel, in this order and each step once:
//   scene   = hdr + bloom * bloomIntensity    linear, Rec. 709 primaries, alpha is not looked at
//   exposed = clamp(scene * exposure, 0, kMaxScene)
//   display = clamp(curve(exposed), 0, 1)
//   target  = (transfer(display), 1)
// Bloom has any size: it is filtered bilinearly between texel centres, clamped to its edge. Bad
// input is part of the contract: a component of hdr or of a texel of bloom that is NaN or -Inf
// counts as 0, +Inf as kMaxScene, and any other is clamped to [-kMaxScene, kMaxScene], before
// anything is computed with it.
struct Resolve {         // push constants
  uvec2 size;            // of hdr and target, pixels; pixels beyond are not touched
  float exposure;        // 2^EV, computed on the host; 2^-32 to 2^32
  float bloomIntensity;  // 0 to 1
  uint curve;            // kLinear .. kHill; anything else counts as kLinear
  uint transfer;         // kNone .. kSrgb; anything else counts as kNone
};

// What a kernel may name on its way, in the order of computation; linear, Rec. 709 primaries.
struct ResolveProbes {
  vec3 hdr;      // of the pixel, as it counts, [-kMaxScene, kMaxScene]
  vec3 bloom;    // at the centre of the pixel, likewise
  vec3 scene;    // before exposure
  vec3 exposed;  // what enters the curve, [0, kMaxScene]
  vec3 curved;   // what leaves it
  vec3 display;  // [0, 1]
};

// Tone curves.
const uint kLinear = 0;     // x
const uint kReinhard = 1;   // Reinhard et al. 2002, eq. 3
const uint kNarkowicz = 2;  // Narkowicz 2015, ACES fit, without his optional 0.6
const uint kHill = 3;       // Hill 2016, RRT and sRGB ODT fit; mixes the components

// Transfer functions.
const uint kNone = 0;   // for a target whose format encodes
const uint kGamma = 1;  // x^(1 / 2.2); 0 below 2^-126, the smallest normal float
const uint kSrgb = 2;   // IEC 61966-2-1

const float kMaxScene = 4292870144.0f;  // 65504 * 2^16: the largest half at EV 16

const uint kHdr = 0;     // binding numbers, set 0: texture2D, RGBA16F in a frame
const uint kBloom = 1;   // texture2D, RGBA16F in a frame
const uint kTarget = 2;  // image2D, RGBA8 in a frame
const uint kGroupSide = 8;

GNOMON_CONTRACT_END

#endif
