// What the kernels of the depth pyramid share.
#ifndef GNOMON_HIZ_GLSL
#define GNOMON_HIZ_GLSL

// The bits of depths as they count. Those of numbers from 0 up are ordered as the numbers are, so a
// minimum of them is exact on any device, denormal or not. All else has bits from infinity's on.
uvec4 depthBits(vec4 depths) {
  const uvec4 bits = floatBitsToUint(depths);
  return mix(uvec4(0), bits, lessThan(bits, uvec4(0x7f800000u)));
}

uint depthBits(float depth) { return depthBits(vec4(depth)).x; }

const uint kBeyondDepth = 0xffffffffu;  // nearer than any depth: the minimum of none

#endif
