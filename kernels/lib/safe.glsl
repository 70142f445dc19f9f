// Input that may be anything: tested on its bits, so that no compiler folds the test away.
#ifndef GNOMON_SAFE_GLSL
#define GNOMON_SAFE_GLSL

bool isFinite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

bool isPositiveInfinity(float x) { return floatBitsToUint(x) == 0x7f800000u; }

float finiteOrZero(float x) { return isFinite(x) ? x : 0.0; }

vec3 finiteOrZero(vec3 v) { return vec3(finiteOrZero(v.x), finiteOrZero(v.y), finiteOrZero(v.z)); }

float largestComponent(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

#endif
