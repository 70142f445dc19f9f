// Names for intermediate values, so that a failure can say which of them went wrong first. Without
// GNOMON_PROBES all of this compiles to nothing. The harness compiles a kernel that failed once
// more with it, defined as a free binding of set 0, and reads the struct of the contract there.
//
//   GNOMON_PROBE_BUFFER(EvaluateProbes)   once, after the includes, without a semicolon
//   GNOMON_PROBE_ELEMENT(i, count);       once, first in main: which element this thread computes;
//   GNOMON_PROBE_PIXEL(at, size);         or which pixel. Beyond the end it probes nothing.
//   GNOMON_PROBE(NoV, NoV);               keeps a value under a name of the struct
//   GNOMON_PROBED(bloom, bloomAt(at))     the same around an expression that has no variable
//
// They stand in a kernel, not in functions that several kernels share: each has its own struct.
#ifndef GNOMON_PROBE_GLSL
#define GNOMON_PROBE_GLSL

#ifdef GNOMON_PROBES

// The buffer is longer than its elements, by a guard band that nobody reads: what belongs to no
// element goes to the last place of that.
#define GNOMON_PROBE_BUFFER(Struct)                                                \
  layout(set = 0, binding = GNOMON_PROBES, scalar) writeonly buffer GnomonProbes { \
    Struct gnomonProbes[];                                                         \
  };                                                                               \
  uint gnomonProbe = 0xffffffffu;                                                  \
  uint gnomonPlace() { return min(gnomonProbe, uint(gnomonProbes.length()) - 1u); }
#define GNOMON_PROBE_ELEMENT(i, count) gnomonProbe = (i) < (count) ? (i) : 0xffffffffu
#define GNOMON_PROBE_PIXEL(at, size) \
  gnomonProbe = all(lessThan(at, size)) ? (at).y * (size).x + (at).x : 0xffffffffu
#define GNOMON_PROBED(name, x) (gnomonProbes[gnomonPlace()].name = (x))
#define GNOMON_PROBE(name, x) GNOMON_PROBED(name, x)

#else

#define GNOMON_PROBE_BUFFER(Struct)
#define GNOMON_PROBE_ELEMENT(i, count)
#define GNOMON_PROBE_PIXEL(at, size)
#define GNOMON_PROBED(name, x) (x)
#define GNOMON_PROBE(name, x)

#endif

#endif
