// Depth of a reverse-Z buffer: 1 at the near plane, 0 at the far one.
#ifndef GNOMON_DEPTH_GLSL
#define GNOMON_DEPTH_GLSL

// Distance along the view axis, near to far: the inverse of d = n (f - z) / (z (f - n)).
float linearDepth(float d, float near, float far) { return near * far / (near + d * (far - near)); }

#endif
