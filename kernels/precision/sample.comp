// One sample at an explicit level of detail; its filter and address mode are the record's.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "precision.h"

layout(local_size_x = kGroupSize) in;
layout(push_constant, scalar) uniform Push { Measure push; };
layout(set = 0, binding = kPlaces, scalar) readonly buffer In { Place places[]; };
layout(set = 0, binding = kResults, scalar) writeonly buffer Out { Texel results[]; };
layout(set = 0, binding = kImage) uniform sampler2D source;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) return;
  const Place place = places[i];
  results[i].value = textureLod(source, place.uv, place.lod);
}
