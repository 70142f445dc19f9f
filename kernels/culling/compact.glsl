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

shared uint blockOfGroup;
const uint kWords = kBlock / 32;
shared uint visible[kWords];          // a bit a candidate
shared uint visibleUpTo[kWords + 1];  // candidates before the first of each word, and all
shared uint visibleBefore;            // the block
shared uint recounted;
shared uint done;  // threads
shared bool isLastGroup;

bool isVisible(uint candidate);
void list(uint candidate, uint position);

uint blocksOf(uint candidates) { return max((candidates + kBlock - 1) / kBlock, 1u); }

uint countAgain(uint block, uint candidates) {
  atomicAdd(recounted, 1u);
  const uint end = min((block + 1) * kBlock, candidates);
  uint count = 0;
  for (uint c = block * kBlock; c < end; ++c) count += uint(isVisible(c));
  return count;
}

uint countOf(uint block, uint candidates, inout uint patience) {
  for (; patience > 0; --patience) {
    const uint answer = atomicOr(scratch[kBlocks + block], 0u);
    if (answer != 0) return answer - 1;
  }
  return countAgain(block, candidates);
}

void takeBlock(uint lane) {
  if (lane == 0) {
    blockOfGroup = atomicAdd(scratch[kTicket], 1u);
    visibleBefore = 0;
    recounted = 0;
    done = 0;
    isLastGroup = false;
  }
  for (uint w = lane; w < kWords; w += kGroupSize) visible[w] = 0;
  barrier();
}

void markVisible(uint lane, uint first, uint candidates) {
  const uint inBlock = min(kBlock, candidates - first);
  for (uint i = lane; i < inBlock; i += kGroupSize)
    if (isVisible(first + i)) atomicOr(visible[i / 32], 1u << i % 32);
  barrier();
}

/// Says how many there are before anybody asks, for threads of a subgroup that wait may keep others
/// from speaking.
void publish(uint lane, uint block) {
  if (lane <= kWords) {
    uint before = 0;
    for (uint w = 0; w < lane; ++w) before += bitCount(visible[w]);
    visibleUpTo[lane] = before;
    if (lane == kWords) atomicExchange(scratch[kBlocks + block], before + 1);
  }
  barrier();
}

void askOthers(uint lane, uint block, uint candidates, uint patience) {
  uint before = 0;
  for (uint b = lane; b < block; b += kGroupSize) before += countOf(b, candidates, patience);
#ifdef GNOMON_SUBGROUPS
  before = subgroupAdd(before);
  if (subgroupElect()) atomicAdd(visibleBefore, before);
#else
  atomicAdd(visibleBefore, before);
#endif
  barrier();
}

void listBlock(uint lane, uint first, uint capacity) {
  for (uint i = lane; i < kBlock; i += kGroupSize) {
    const uint word = visible[i / 32], bit = 1u << i % 32;
    if ((word & bit) == 0) continue;
    const uint position = visibleBefore + visibleUpTo[i / 32] + bitCount(word & bit - 1);
    if (position < capacity) list(first + i, position);
  }
}

void sumUp(uint candidates, uint capacity) {
  const uint total = atomicOr(scratch[kTotal], 0u);
  tally[0].tested = candidates;
  tally[0].total = total;
  tally[0].listed = min(total, capacity);
  tally[0].overflowed = uint(total > capacity);
  tally[0].recounted = atomicOr(scratch[kRecounted], 0u);
}

/// The last group of all sums up and leaves the scratch as it was: zero.
void finish(uint lane, uint candidates, uint capacity) {
  memoryBarrierBuffer();
  if (atomicAdd(done, 1u) == kGroupSize - 1) {
    if (recounted > 0) atomicAdd(scratch[kRecounted], recounted);
    memoryBarrierBuffer();
    isLastGroup = atomicAdd(scratch[kFinished], 1u) == gl_NumWorkGroups.x - 1;
  }
  barrier();
  if (!isLastGroup) return;
  memoryBarrierBuffer();
  if (lane == 0) sumUp(candidates, capacity);
  barrier();
  for (uint i = lane; i < kBlocks + blocksOf(candidates); i += kGroupSize)
    atomicExchange(scratch[i], 0u);
}

void compact(uint candidates, uint capacity, uint patience) {
  const uint lane = gl_LocalInvocationIndex;
  takeBlock(lane);
  const uint block = blockOfGroup, first = block * kBlock;
  if (block < blocksOf(candidates)) {  // the host may not know how many there are
    markVisible(lane, first, candidates);
    publish(lane, block);
    askOthers(lane, block, candidates, patience);
    listBlock(lane, first, capacity);
    if (lane == 0 && block == blocksOf(candidates) - 1)
      atomicExchange(scratch[kTotal], visibleBefore + visibleUpTo[kWords]);
  }
  finish(lane, candidates, capacity);
}
