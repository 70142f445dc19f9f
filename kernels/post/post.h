// Contract of stage post: what a person looks at instead of the finished frame.
#ifndef GNOMON_POST_H
#define GNOMON_POST_H

#include "../contract.h"

GNOMON_CONTRACT(post)

// Debug views of the G-buffer, one a dispatch, encoded as they stand (no transfer function):
//   kAlbedo    albedo
//   kNormal    the world normal as the G-buffer keeps it, n / 2 + 1 / 2
//   kDepth     grey: linear depth / far
//   kCascades  the colour of the pixel's cascade over the dimmed scene
// The sky (depth == 0) is black in every view. Linear depth is near far / (near + depth (far -
// near)) of reverse-Z depth. Bad input is part of the contract: a component that is NaN or infinite
// counts as 0, so a bad depth is sky, and depth is clamped to [0, 1]; outputs lie in [0, 1].
struct Views {  // push constants
  uvec2 size;   // of every image, pixels; pixels beyond are not touched
  uint mode;    // kAlbedo .. kCascades; anything else counts as kAlbedo
  float near;   // distances of the clip planes, 0 < near < far
  float far;
  vec4 splits;  // view depth at which each cascade ends, ascending, the last one far
};

// What a kernel may name on its way, in the order of computation.
struct ViewsProbes {
  float depth;       // reverse-Z, as it counts, [0, 1]; 0 is sky, and then nothing else is reached
  vec3 albedo;       // as it counts, [0, 1]
  float distance;    // linear depth, near to far; of the views that need it
  uint cascade;      // the distance's, 0 to 3
  float blendStart;  // where that cascade's blend zone begins; not of the last
  vec3 tinted;       // its colour over the dimmed scene
  vec3 shown;        // the view, before it is clamped to [0, 1]
};

const uint kAlbedo = 0;  // 3 to 10 are left to views of other targets
const uint kNormal = 1;
const uint kDepth = 2;
const uint kCascades = 11;

const vec3 kCascadeColour0 = vec3(0, 1, 0);  // green, blue, yellow, red
const vec3 kCascadeColour1 = vec3(0, 0, 1);
const vec3 kCascadeColour2 = vec3(1, 1, 0);
const vec3 kCascadeColour3 = vec3(1, 0, 0);
const float kCascadeTint = 0.7f;   // of the colour, over
const float kCascadeDim = 0.3f;    // of the albedo
const float kCascadeBlend = 0.1f;  // the last tenth of a cascade's depth range, where shadows blend
const float kBlendBrighter = 1.25f;  // into the next one, is brightened; not of the last cascade

const uint kAlbedoImage = 0;  // binding numbers, set 0: texture2D, RGBA8 in a frame
const uint kNormalImage = 1;  // texture2D, RGBA16F in a frame
const uint kDepthImage = 2;   // texture2D, D32 in a frame
const uint kTarget = 3;       // image2D, RGBA8 in a frame
const uint kGroupSide = 8;

GNOMON_CONTRACT_END

#endif
