// The whole pyramid of farthest depths in one dispatch. A group makes one texel of level kHizTile
// and all below it; the group that is done last makes the levels above from those texels, and does
// so tile by tile as well, kHizTile levels a round.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_shader_image_load_formatted : require
#extension GL_EXT_control_flow_attributes : require
#include "culling.h"
#include "hiz.glsl"

layout(local_size_x = kHizGroup) in;
layout(push_constant, scalar) uniform Push { Hiz push; };
layout(set = 0, binding = kHizDepth) uniform texture2D depth;
layout(set = 0, binding = kHizLevels) writeonly uniform image2D levels[kMaxLevels];
layout(set = 0, binding = kHizScratch, scalar) coherent buffer Scratch { uint scratch[]; };

// A tile has up to 127 texels a side (the last one takes the rest), and one level on up to 63.
const uint kPitch = (1u << kHizTile) - 1u;
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
    STORE(0) STORE(1) STORE(2) STORE(3) STORE(4) STORE(5) STORE(6) STORE(7)
    STORE(8) STORE(9) STORE(10) STORE(11) STORE(12) STORE(13) STORE(14)
  }
  // clang-format on
}

// A texel of a level from kHizTile on stands in scratch where the first texel of level kHizTile
// does that it covers: only the thread that makes it has read what was there.
uint placeOf(uint level, uvec2 at) {
  const uvec2 first = at << (level - kHizTile);
  return 1u + first.y * sizeOf(kHizTile).x + first.x;
}

uint load(uint level, uvec2 at) {
  if (level == 0u) return depthBits(texelFetch(depth, ivec2(at), 0).r);
  return scratch[placeOf(level, at)];
}

// A texel of level base + 1.
uint firstStep(uint base, uvec2 at) {
  const uvec2 begin = 2u * at, end = endOf(at, base + 1u, 1u);
  if (end == begin + 2u)  // all but the last: no loop, so that the loads overlap
    return min(min(load(base, begin), load(base, begin + uvec2(1, 0))),
               min(load(base, begin + uvec2(0, 1)), load(base, begin + 1u)));
  uint farthest = kBeyondDepth;
  for (uint y = begin.y; y < end.y; ++y)
    for (uint x = begin.x; x < end.x; ++x) farthest = min(farthest, load(base, uvec2(x, y)));
  return farthest;
}

// A texel of a later level from those of the one before, which stand as far apart as the first ones
// that they are made of: only the thread that makes a texel reads what stands in its place.
uint laterStep(uvec2 begin, uvec2 end, uint step) {
  uint farthest = kBeyondDepth;
  for (uint y = begin.y; y < end.y; ++y)
    for (uint x = begin.x; x < end.x; ++x)
      farthest = min(farthest, tileTexels[(y * kPitch + x) << (step - 2u)]);
  return farthest;
}

uint least(uint a, uint b, uint c, uint d) { return min(min(a, b), min(c, d)); }

uint depthAt(uvec2 at) { return depthBits(texelFetch(depth, ivec2(at), 0).r); }

// A texel of level 1 that covers 2 x 2 pixels.
uint quad(uvec2 at) {
  const uvec2 first = 2u * at;
  return least(depthAt(first), depthAt(first + uvec2(1, 0)), depthAt(first + uvec2(0, 1)),
               depthAt(first + 1u));
}

// The same for a tile of the depth buffer that takes no rest: every thread has 4 x 4 pixels, all
// loaded before the first is stored, and nothing has to be divided.
void reduceWholeTile(uvec2 tile) {
  const uint side = 1u << (kHizTile - 2u);
  const uvec2 local = uvec2(gl_LocalInvocationIndex % side, gl_LocalInvocationIndex / side);
  const uvec2 at = tile * side + local, first = 2u * at;
  const uvec2 right = first + uvec2(1, 0), below = first + uvec2(0, 1), both = first + 1u;
  const uint a = quad(first), b = quad(right), c = quad(below), d = quad(both);
  const uint texel = least(a, b, c, d);
  store(1u, first, a);
  store(1u, right, b);
  store(1u, below, c);
  store(1u, both, d);
  store(2u, at, texel);
  tileTexels[gl_LocalInvocationIndex] = texel;
  [[dont_unroll]] for (uint level = 3u; level <= kHizTile; ++level) {
    barrier();
    const uint texels = 1u << (kHizTile - level), apart = 1u << (level - 3u);
    if (gl_LocalInvocationIndex < texels * texels) {
      const uvec2 mine = uvec2(gl_LocalInvocationIndex % texels, gl_LocalInvocationIndex / texels);
      const uint first = (mine.y * side + mine.x) * 2u * apart;
      const uint lower =
          least(tileTexels[first], tileTexels[first + apart], tileTexels[first + side * apart],
                tileTexels[first + side * apart + apart]);
      store(level, tile * texels + mine, lower);
      tileTexels[first] = lower;
    }
  }
  if (gl_LocalInvocationIndex == 0u) scratch[placeOf(kHizTile, tile)] = tileTexels[0];
}

// Levels base + 1 to base + kHizTile of one tile, the last of them into scratch where another round
// goes on from it.
void reduceTile(uint base, uvec2 tile) {
  [[dont_unroll]] for (uint step = 1u; step <= kHizTile; ++step) {
    barrier();
    const uint up = kHizTile - step;
    const uvec2 begin = tile << up, size = endOf(tile, base + kHizTile, up) - begin;
    for (uint i = gl_LocalInvocationIndex; i < size.x * size.y; i += kHizGroup) {
      const uvec2 local = uvec2(i % size.x, i / size.x), at = begin + local;
      const uint texel = step == 1u
                             ? firstStep(base, at)
                             : laterStep(2u * local, endOf(at, base + step, 1u) - 2u * begin, step);
      store(base + step, at, texel);
      tileTexels[(local.y * kPitch + local.x) << (step - 1u)] = texel;
    }
  }
  if (gl_LocalInvocationIndex == 0u && base + kHizTile < lastLevel())
    scratch[placeOf(base + kHizTile, tile)] = tileTexels[0];
}

void reduce(uint base, uvec2 tile) {
  if (base == 0u && endOf(tile, kHizTile, kHizTile) == (tile + 1u) << kHizTile)
    reduceWholeTile(tile);
  else
    reduceTile(base, tile);
}

// Whether all other groups have written their texels of level kHizTile.
bool isLastGroup() {
  if (gl_LocalInvocationIndex == 0u) {
    memoryBarrierBuffer();
    lastGroup = atomicAdd(scratch[0], 1u) == gl_NumWorkGroups.x * gl_NumWorkGroups.y - 1u;
    memoryBarrierBuffer();
  }
  barrier();
  return lastGroup;
}

void main() {
  // Tiles of a round. Those that take a rest have most to do, so their groups start first.
  uvec2 first = gl_NumWorkGroups.xy - 1u - gl_WorkGroupID.xy, end = first + 1u;
  for (uint base = 0u; base == 0u || base < lastLevel(); base += kHizTile) {
    for (uint y = first.y; y < end.y; ++y)
      for (uint x = first.x; x < end.x; ++x) reduce(base, uvec2(x, y));
    if (base == 0u && !isLastGroup()) return;
    memoryBarrierBuffer();  // the next round, behind its barrier, reads what thread 0 has written
    first = uvec2(0);
    end = sizeOf(base + 2u * kHizTile);
  }
  const uvec2 groups = sizeOf(kHizTile);
  for (uint i = gl_LocalInvocationIndex; i <= groups.x * groups.y; i += kHizGroup) scratch[i] = 0u;
}
