// A contract's structs as a module keeps them, and back: offsets, strides, matrix layouts, and the
// conventions in which a foreign kernel expresses the same thing.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "harness/program/interface.h"

namespace gnomon {

using Bytes = std::vector<std::byte>;
using Conventions = std::map<std::string, std::string>;

/// Which way a value goes: what the kernel is told, or what it says.
enum class Way { kIn, kOut };

/// One value in the other convention. A "roughness" given as "alpha" is its square, a "depth" that
/// is "standard" is 1 minus ours; anything else stays.
float converted(float x, const std::string& meaning, const Conventions& conventions, Way way);

/// Writes one field of one element, from the contract's bytes to the module's place.
void pack(const Place& place, std::span<const std::byte> element, std::span<std::byte> target,
          const Conventions& conventions);

/// Reads it back.
void unpack(const Place& place, std::span<const std::byte> source, std::span<std::byte> element,
            const Conventions& conventions);

/// Puts a picture's rows into the other convention: from below where "y" is "up", depths converted.
void convertRows(std::span<std::byte> rows, PixelFormat format, unsigned height,
                 const std::string& meaning, const Conventions& conventions, Way way);

}  // namespace gnomon
