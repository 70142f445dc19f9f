// Contract of stage precision: one built-in of the language, or one way of reading or writing an
// image, at a time, over arrays of arguments.
#ifndef GNOMON_PRECISION_H
#define GNOMON_PRECISION_H

#include "../contract.h"

GNOMON_CONTRACT(precision)

struct Arguments {
  float x;
  float y;  // used by operations of two arguments only
};

struct Result {
  float value;
};

struct Measure {  // push constants
  uint count;
};

struct Place {  // of a sample
  vec2 uv;      // normalised coordinates, any float
  float lod;    // explicit, any float
  float depth;  // that a comparison compares with; else unused
};

struct Texel {  // read, sampled or to be stored
  vec4 value;
};

struct Pixels {  // push constants of load_ and store_: one pixel a thread
  uvec2 size;    // of the image; buffers hold its pixels in rows, x fastest
};

// Which operation a pipeline computes: specialisation constant kOperationId. The order is that of
// reference/bound/rules.h for the operations that have an error of their own.
const uint kOperationId = 0;
const uint kDivide = 0;
const uint kInverseSqrt = 1;
const uint kSqrt = 2;
const uint kExp = 3;
const uint kExp2 = 4;
const uint kLog = 5;
const uint kLog2 = 6;
const uint kPow = 7;
const uint kSin = 8;
const uint kCos = 9;
const uint kTan = 10;
const uint kAsin = 11;
const uint kAcos = 12;
const uint kAtan = 13;
const uint kAtan2 = 14;
const uint kAdd = 15;
const uint kMultiply = 16;
const uint kFma = 17;

const uint kArguments = 0;  // binding numbers, set 0
const uint kResults = 1;
const uint kGroupSize = 256;
const uint kImage = 2;      // the image that is read, sampled or written
const uint kPlaces = 0;     // in the place of arguments
const uint kTexels = 0;     // likewise, what store_ stores
const uint kGroupSide = 8;  // of load_ and store_

GNOMON_CONTRACT_END

#endif
