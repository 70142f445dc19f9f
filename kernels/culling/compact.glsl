// Ordered compaction in one dispatch. A group counts the visible candidates of one block, says how
// many there are, asks every block before it for its count, and so knows where its own part of the
// list begins. Nobody waits for a chain of others: a block is counted before it asks.
//
// Blocks are handed out by a ticket, in the order in which groups start, so whoever is asked runs
// already. Should it not answer (a device may stop a group that has started) the asker counts that
// block itself: slow, but right on every device. Counts travel in the atomics themselves; no other
// memory has to be in order.
//
// Whoever includes this has `scratch` and `tally` and defines isVisible and list. isVisible has to
// come to the same answer wherever a compiler inlines it, so its arithmetic is `precise`.

#include "../lib/thread.glsl"

const uint kWords = kBlock / 32;
const uint kPerThread = kBlock / kGroupSize;
shared uint visible[kWords];  // a bit a candidate
shared uint blockOfGroup;
shared uint visibleUpTo[kWords + 1];  // candidates before the first of each word, and all
#ifdef GNOMON_SUBGROUPS
shared uint heard[kGroupSize];  // by each thread: candidates before the block
#else
shared uint visibleBefore;  // the block
#endif
shared bool isLastGroup;

bool isVisible(uint candidate);
void list(uint candidate, uint position);

uint blocksOf(uint candidates) { return (candidates + kBlock - 1) / kBlock; }

/// A block before the group's own, so a whole one.
uint countAgain(uint block) {
  atomicAdd(scratch[kRecounted], 1u);
  uint count = 0;
  for (uint c = block * kBlock; c < (block + 1) * kBlock; ++c) count += uint(isVisible(c));
  return count;
}

uint countOf(uint block, inout uint patience) {
  for (; patience > 0; --patience) {
    const uint answer = atomicLoad(scratch[kBlocks + block], gl_ScopeDevice, 0, 0);
    if (answer != 0) return answer - 1;
  }
  return countAgain(block);
}

void takeBlock(uint lane) {
  if (lane < kWords) visible[lane] = 0;
  if (isFirstThread()) blockOfGroup = atomicAdd(scratch[kTicket], 1u);
  barrier();
}

void markVisible(uint lane, uint candidates) {
  for (uint k = 0; k < kPerThread; ++k) {
    const uint i = k * kGroupSize + lane, candidate = blockOfGroup * kBlock + i;
    if (candidate < candidates && isVisible(candidate)) atomicOr(visible[i / 32], 1u << i % 32);
  }
  barrier();
}

/// Says how many there are before anybody asks, for threads of a subgroup that wait may keep others
/// from speaking.
void publish(uint lane) {
  if (lane <= kWords) {
    uint before = 0;
    for (uint w = 0; w < lane; ++w) before += bitCount(visible[w]);
    visibleUpTo[lane] = before;
    if (lane == kWords) {
#ifndef GNOMON_SUBGROUPS
      visibleBefore = 0;
#endif
      atomicStore(scratch[kBlocks + blockOfGroup], before + 1, gl_ScopeDevice, 0, 0);
    }
  }
  barrier();
}

/// Behind it, what the group has used of the scratch is used before the thread that counts the
/// group goes on.
void askedAll() {
  controlBarrier(gl_ScopeWorkgroup, gl_ScopeWorkgroup,
                 gl_StorageSemanticsBuffer | gl_StorageSemanticsShared, gl_SemanticsAcquireRelease);
}

/// Visible candidates before the group's block; every thread gets them.
uint askOthers(uint lane, uint patience) {
  uint before = 0;
  for (uint b = lane; b < blockOfGroup; b += kGroupSize) before += countOf(b, patience);
#ifdef GNOMON_SUBGROUPS
  // Every subgroup adds up what all threads have heard: as many lanes as it has, full or not.
  heard[lane] = before;
  askedAll();
  before = 0;
  const uint lanes = subgroupAdd(1u);
  for (uint i = subgroupExclusiveAdd(1u); i < kGroupSize; i += lanes) before += heard[i];
  return subgroupAdd(before);
#else
  atomicAdd(visibleBefore, before);
  askedAll();
  return visibleBefore;
#endif
}

void listBlock(uint lane, uint before, uint capacity) {
  for (uint k = 0; k < kPerThread; ++k) {
    const uint i = k * kGroupSize + lane, word = visible[i / 32], bit = 1u << i % 32;
    if ((word & bit) == 0) continue;
    const uint position = before + visibleUpTo[i / 32] + bitCount(word & bit - 1);
    if (position < capacity) list(blockOfGroup * kBlock + i, position);
  }
}

void sumUp(uint candidates, uint capacity) {
  const uint total = scratch[kTotal];
  tally[0].tested = candidates;
  tally[0].total = total;
  tally[0].listed = min(total, capacity);
  tally[0].overflowed = uint(total > capacity);
  tally[0].recounted = scratch[kRecounted];
}

/// Visible candidates up to the end of the group's block; 0 of a group without one.
uint visibleSoFar(uint lane, uint candidates, uint capacity, uint patience) {
  if (blockOfGroup >= blocksOf(candidates)) return 0;  // the host may not know how many there are
  markVisible(lane, candidates);
  publish(lane);
  const uint before = askOthers(lane, patience);
  listBlock(lane, before, capacity);
  return before + visibleUpTo[kWords];
}

/// The last group of all sums up and leaves the scratch as it was: zero. What is visible up to a
/// block only grows with it, so the largest number said is all.
void finish(uint lane, uint soFar, uint candidates, uint capacity) {
  if (isFirstThread()) {
    atomicMax(scratch[kTotal], soFar);
    isLastGroup = atomicAdd(scratch[kFinished], 1u, gl_ScopeDevice, gl_StorageSemanticsBuffer,
                            gl_SemanticsAcquireRelease) == gl_NumWorkGroups.x - 1;
    if (isLastGroup) sumUp(candidates, capacity);
  }
  barrier();
  if (!isLastGroup) return;
  for (uint i = lane; i < kBlocks + blocksOf(candidates); i += kGroupSize) scratch[i] = 0u;
}

void compact(uint candidates, uint capacity, uint patience) {
  const uint lane = gl_LocalInvocationIndex;
  takeBlock(lane);
  finish(lane, visibleSoFar(lane, candidates, capacity, patience), candidates, capacity);
}
