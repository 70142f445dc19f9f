// The whole pyramid of farthest depths in one dispatch. A group makes one texel of level kHizTile
// and all below it; the group that is done last makes the levels above from those texels, and does
// so tile by tile as well, kHizTile levels a round.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_memory_scope_semantics : require
#include "culling.h"
#include "../lib/thread.glsl"
#include "hiz.glsl"

layout(local_size_x = kHizGroup) in;
layout(push_constant, scalar) uniform Push { Hiz push; };
layout(set = 0, binding = kHizDepth) uniform texture2D depth;
layout(set = 0, binding = kHizNearest) uniform sampler nearest;
layout(set = 0, binding = kHizLevels) writeonly uniform image2D levels[kMaxLevels];
layout(set = 0, binding = kHizScratch, scalar) coherent buffer Scratch { uint scratch[]; };

// Of the second level that it makes a tile has a texel a thread, or up to 31 a side: the last tile
// of a row or column takes the rest.
const uint kSide = 1u << (kHizTile - 2u);
const uint kPitch = 2u * kSide - 1u;
shared uint tileTexels[kPitch * kPitch];
shared bool lastGroup;

uvec2 sizeOf(uint level) { return max(push.size >> level, uvec2(1)); }

uint lastLevel() { return uint(findMSB(max(push.size.x, push.size.y))); }

// Where the texels end that `at` covers, `steps` levels below `level`: the last one of its row or
// column takes the rest.
uvec2 endOf(uvec2 at, uint level, uint steps) {
  return mix((at + 1u) << steps, sizeOf(level - steps), equal(at, sizeOf(level) - 1u));
}

// An array of images may be indexed by constants on every device, by numbers on some.
void store(uint level, uvec2 at, uint bits) {
  if (level > lastLevel()) return;
  const vec4 texel = vec4(uintBitsToFloat(bits));
  // clang-format off
#define STORE(m) case m + 1: imageStore(levels[m], ivec2(at), texel); break;
  switch (level) {
    STORE(0) STORE(1) STORE(2) STORE(3) STORE(4) STORE(5) STORE(6)
    STORE(7) STORE(8) STORE(9) STORE(10) STORE(11) STORE(12) STORE(13)
  }
  // clang-format on
}

// A texel of a level from kHizTile on stands in scratch where the first texel of level kHizTile
// does that it covers: only the thread that makes it has read what was there.
uint placeOf(uint level, uvec2 at) {
  const uvec2 first = at << (level - kHizTile);
  return 1u + first.y * sizeOf(kHizTile).x + first.x;
}

// Of the 2 x 2 pixels around a corner.
uint leastAround(uvec2 corner) {
  const vec4 four =
      textureGather(sampler2D(depth, nearest), vec2(corner) / vec2(textureSize(depth, 0)));
  return min(min(depthBits(four.x), depthBits(four.y)), min(depthBits(four.z), depthBits(four.w)));
}

// A texel of level base + 1, of the texels [begin, end) of level base, up to 3 x 3. Pixels come
// four at a time, where there are three a side some of them twice.
uint firstStep(uint base, uvec2 begin, uvec2 end) {
  uint farthest = kBeyondDepth;
  if (base == 0u) {
    const uvec2 first = begin + 1u, last = max(end - 1u, first);
    for (uint y = first.y; y <= last.y; ++y)
      for (uint x = first.x; x <= last.x; ++x) farthest = min(farthest, leastAround(uvec2(x, y)));
  } else {
    for (uint y = begin.y; y < end.y; ++y)
      for (uint x = begin.x; x < end.x; ++x)
        farthest = min(farthest, scratch[placeOf(base, uvec2(x, y))]);
  }
  return farthest;
}

// A texel of level base + 2, and those of level base + 1 that it is made of.
uint secondStep(uint base, uvec2 at) {
  const uvec2 begin = 2u * at, end = endOf(at, base + 2u, 1u);
  uint farthest = kBeyondDepth;
  for (uint y = begin.y; y < end.y; ++y)
    for (uint x = begin.x; x < end.x; ++x) {
      const uvec2 child = uvec2(x, y);
      const uint texel = firstStep(base, 2u * child, endOf(child, base + 1u, 1u));
      store(base + 1u, child, texel);
      farthest = min(farthest, texel);
    }
  return farthest;
}

// Texels of later levels stand as far apart as the first ones that they are made of: only the
// thread that makes a texel reads what stands in its place.
uint sharedPlace(uvec2 local, uint step) { return (local.y * kPitch + local.x) << (step - 2u); }

// Of 3 x 3 texels at most: where there are fewer, some count twice.
uint laterStep(uvec2 begin, uvec2 last, uint step) {
  uint farthest = tileTexels[sharedPlace(begin, step - 1u)];
  [[dont_unroll]] for (uint i = 0u; i < 9u; ++i) {
    const uvec2 at = min(begin + uvec2(i % 3u, i / 3u), last);
    farthest = min(farthest, tileTexels[sharedPlace(at, step - 1u)]);
  }
  return farthest;
}

// Levels base + 1 to base + kHizTile of one tile, the last of them into scratch, where another
// round may go on from it. Neighbouring threads have neighbouring texels.
void reduce(uint base, uvec2 tile) {
  const uvec2 lane = uvec2(gl_LocalInvocationIndex % kSide, gl_LocalInvocationIndex / kSide);
  [[dont_unroll]] for (uint step = 2u; step <= kHizTile; ++step) {
    barrier();
    const uint up = kHizTile - step;
    const uvec2 begin = tile << up, size = endOf(tile, base + kHizTile, up) - begin;
    for (uint y = lane.y; y < size.y; y += kSide)
      for (uint x = lane.x; x < size.x; x += kSide) {
        const uvec2 local = uvec2(x, y), at = begin + local;
        const uvec2 last = endOf(at, base + step, 1u) - 2u * begin - 1u;
        const uint texel = step == 2u ? secondStep(base, at) : laterStep(2u * local, last, step);
        store(base + step, at, texel);
        tileTexels[sharedPlace(local, step)] = texel;
        if (step == kHizTile) scratch[placeOf(base + kHizTile, at)] = texel;
      }
  }
}

// Whether all other groups have written their texels of level kHizTile. The thread that counts a
// group has written its texel: nothing else has to be in order.
bool isLastGroup() {
  if (isFirstThread())
    lastGroup = atomicAdd(scratch[0], 1u, gl_ScopeDevice, gl_StorageSemanticsBuffer,
                          gl_SemanticsRelease) == gl_NumWorkGroups.x * gl_NumWorkGroups.y - 1u;
  barrier();
  return lastGroup;
}

void main() {
  // Tiles of a round. Those that take a rest have most to do, so their groups start first.
  uvec2 tiles = gl_NumWorkGroups.xy;
  uint first = tiles.x * (tiles.y - gl_WorkGroupID.y) - gl_WorkGroupID.x - 1u, end = first + 1u;
  for (uint base = 0u; base < lastLevel(); base += kHizTile) {
    for (uint t = first; t < end; ++t) reduce(base, uvec2(t % tiles.x, t / tiles.x));
    if (base == 0u && !isLastGroup()) return;
    memoryBarrierBuffer();  // the next round reads what this one and other groups have written
    tiles = sizeOf(base + 2u * kHizTile);
    first = 0u;
    end = tiles.x * tiles.y;
  }
  const uvec2 groups = sizeOf(kHizTile);
  for (uint i = gl_LocalInvocationIndex; i <= groups.x * groups.y; i += kHizGroup) scratch[i] = 0u;
}
