// Copies a buffer: the fastest traffic that a compute kernel of this device has, and a sweep that
// leaves nothing of a kernel's inputs in the caches. No stage, so it is not in the catalogue.
#version 450

const uint kThreads = 256, kEach = 4;  // 16 KiB a group: bench/stopwatch.cpp counts on it

layout(local_size_x = kThreads) in;
layout(set = 0, binding = 0) readonly buffer From { uvec4 from[]; };
layout(set = 0, binding = 1) writeonly buffer To { uvec4 to[]; };

void main() {
  const uint first = gl_WorkGroupID.x * kThreads * kEach + gl_LocalInvocationID.x;
  for (uint i = 0; i < kEach; ++i) to[first + i * kThreads] = from[first + i * kThreads];
}
