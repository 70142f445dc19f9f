// FNV-1a: for seeds, so that a case's inputs do not depend on the standard library's hash, and for
// telling whether files are still the same.
#pragma once

#include <cstdint>
#include <string_view>

namespace gnomon {

inline constexpr std::uint64_t kHashBasis = 14695981039346656037ull;

inline std::uint64_t hashOf(std::string_view bytes, std::uint64_t basis = kHashBasis) {
  for (const char c : bytes) basis = (basis ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return basis;
}

}  // namespace gnomon
