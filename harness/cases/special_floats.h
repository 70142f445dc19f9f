// The floats that code treats wrongly first: for every stage's bad input.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <vector>

namespace gnomon {

/// Both zeros, ones and neighbours, the ends of the normal and denormal numbers, both infinities,
/// and NaN of either sign, of the least and of the largest payload; then what a stage adds: its own
/// limits and thresholds.
inline std::vector<float> specialFloats(std::initializer_list<float> ofTheStage = {}) {
  using Limits = std::numeric_limits<float>;
  std::vector<float> all = {0.0f,
                            -0.0f,
                            0.5f,
                            1.0f,
                            -1.0f,
                            2.0f,
                            -2.0f,
                            Limits::min(),
                            -Limits::min(),
                            Limits::denorm_min(),
                            std::bit_cast<float>(0x007fffffu),
                            Limits::max(),
                            Limits::lowest(),
                            Limits::infinity(),
                            -Limits::infinity(),
                            Limits::quiet_NaN(),
                            -Limits::quiet_NaN(),
                            std::bit_cast<float>(0x7f800001u),
                            std::bit_cast<float>(0xffffffffu)};
  all.insert(all.end(), ofTheStage);
  return all;
}

}  // namespace gnomon
