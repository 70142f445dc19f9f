// Whether two modules are the same computation, as far as an optimiser can tell.
#pragma once

#include <cstdint>
#include <span>

namespace gnomon {

/// A hash of the module's normal form: without debug information, optimised by spirv-opt's
/// performance passes, ids renumbered by what defines them, operands of commutative operations in
/// one order. Modules with one normal form are equivalent (trivial compiler equivalence:
/// Papadakis et al. 2015); the converse does not hold. Throws UsageError where spirv-opt refuses;
/// the module must be valid.
std::uint64_t normalForm(std::span<const std::uint32_t> module);

/// A hash of everything in the module that is not debug information.
std::uint64_t hashWithoutDebug(std::span<const std::uint32_t> module);

}  // namespace gnomon
