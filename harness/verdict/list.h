// From a list that a kernel made to the set that it stands for (design: sets and order).
#pragma once

#include <cstddef>
#include <span>

#include "harness/hygiene/observe.h"
#include "harness/program/kernel.h"

namespace gnomon {

/// Adds to the observation, for the module as it is and for its strict twin, the set that the list
/// stands for: under the list's name one uint a candidate, 1 where it is listed. A finding names
/// each rule of a list that is broken, at the first place: records are those of candidates, each
/// once, in their order, and equal to them; what is behind them is untouched, or where the list was
/// to be filled up (`padded`), up to the capacity, records that draw nothing; found, listed and
/// overflowed agree. What a foreign kernel does not give is not asked for.
///
/// `candidates` are the source's records, as many as are candidates. Returns how many of them are
/// decided: a full list that overflowed says nothing of those behind the last one listed.
///
/// Throws std::logic_error where the observation has no such outputs or a source that is not
/// numbered does not increase, and UsageError where a foreign kernel does not give the id.
std::size_t decodeList(const KernelRecord& record, const ListSpec& list,
                       std::span<const std::byte> candidates, std::size_t capacity,
                       Observation& seen, bool padded = false);

}  // namespace gnomon
