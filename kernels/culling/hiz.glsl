// What the kernels of the depth pyramid share.
#ifndef GNOMON_HIZ_GLSL
#define GNOMON_HIZ_GLSL

// The bits of a depth as it counts. Those of numbers from 0 up are ordered as the numbers are, so a
// minimum of them is exact on any device. Normal ones lie between denormals and infinity; all else
// counts as 0.
uint depthBits(float depth) {
  const uint bits = floatBitsToUint(depth);
  return bits >= 0x00800000u && bits < 0x7f800000u ? bits : 0u;
}

const uint kBeyondDepth = 0xffffffffu;  // nearer than any depth: the minimum of none

#endif
