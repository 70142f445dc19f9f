// One built-in of the language, chosen when the pipeline is made.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "precision.h"

layout(constant_id = kOperationId) const uint operation = 0;
layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Measure push; };
layout(set = 0, binding = kArguments, scalar) readonly buffer In { Arguments arguments[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Out { Result results[]; };

float apply(float x, float y) {
  switch (operation) {
    case kDivide:
      return x / y;
    case kInverseSqrt:
      return inversesqrt(x);
    case kSqrt:
      return sqrt(x);
    case kExp:
      return exp(x);
    case kExp2:
      return exp2(x);
    case kLog:
      return log(x);
    case kLog2:
      return log2(x);
    case kPow:
      return pow(x, y);
    case kSin:
      return sin(x);
    case kCos:
      return cos(x);
    case kTan:
      return tan(x);
    case kAsin:
      return asin(x);
    case kAcos:
      return acos(x);
    case kAtan:
      return atan(x);
    case kAtan2:
      return atan(x, y);
    case kAdd:
      return x + y;
    case kMultiply:
      return x * y;
    default:
      return fma(x, y, x);
  }
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  results[i].value = apply(arguments[i].x, arguments[i].y);
}
