// Threads of a compute group.
#ifndef GNOMON_THREAD_GLSL
#define GNOMON_THREAD_GLSL

// One of the group's, for what one has to do.
bool isFirstThread() { return gl_LocalInvocationIndex == 0u; }

#endif
