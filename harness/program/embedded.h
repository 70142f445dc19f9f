// The SPIR-V of the project's own kernels, inside the binary (CMake writes one source a kernel
// from embed.cpp.in).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace gnomon {

/// The module of a kernel by its path under kernels/: "brdf/evaluate.comp". It lives as long as
/// the process. Throws std::logic_error for a name that the build did not embed.
std::span<const std::uint32_t> embeddedSpirv(std::string_view name);

/// Every embedded name, sorted.
std::vector<std::string_view> embeddedNames();

/// Registers one module before main() runs; only the generated sources make these.
struct EmbeddedSpirv {
  EmbeddedSpirv(std::string_view name, const std::uint32_t* begin, const std::uint32_t* end);
};

}  // namespace gnomon
