// Input that may be anything: tested on its bits, so that no compiler folds the test away.
#ifndef GNOMON_SAFE_GLSL
#define GNOMON_SAFE_GLSL

bool isFinite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

float finiteOrZero(float x) { return isFinite(x) ? x : 0.0; }

vec3 finiteOrZero(vec3 v) { return vec3(finiteOrZero(v.x), finiteOrZero(v.y), finiteOrZero(v.z)); }

// v / |v|, or zero for a vector whose largest component lies outside [shortest, longest].
// The test takes no arithmetic, so it cannot overflow.
vec3 unitOrZero(vec3 v, float shortest, float longest) {
  const float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
  const bool usable = largest >= shortest && largest <= longest;
  return usable ? v * inversesqrt(dot(v, v)) : vec3(0.0);
}

#endif
