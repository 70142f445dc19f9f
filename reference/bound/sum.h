// Sums and products of whole ranges, for Bounded over every order of evaluation: serial, tree,
// subgroup, fused. The one primitive for long or parallel sums.
//
// Precision: sum, exact +- gamma_(n-1) sum|x_i|; dot, exact +- gamma_n sum|x_i y_i|, for n values
// (specification: OpDot is inherited from the sum of products; the constants are explained in
// inherited.h). A certain zero adds nothing, also not to n.
#ifndef GNOMON_REFERENCE_BOUND_SUM_H
#define GNOMON_REFERENCE_BOUND_SUM_H

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "reference/bound/bounded.h"

namespace gnomon {

Bounded sum(std::span<const Bounded> x) noexcept;
Bounded dot(std::span<const Bounded> a, std::span<const Bounded> b) noexcept;  // of equal size
Bounded lengthSquared(std::span<const Bounded> a) noexcept;
// sqrt(dot(a, a)), 0 for a certain 0.
Bounded length(std::span<const Bounded> a) noexcept;
// a[k] inversesqrt(dot(a, a)); unspecified where dot(a, a) may be, or round to, 0 or overflow.
Bounded normalizedComponent(std::span<const Bounded> a, std::size_t k) noexcept;
// i[k] - 2 dot(n, i) n[k].
Bounded reflectedComponent(std::span<const Bounded> i, std::span<const Bounded> n,
                           std::size_t k) noexcept;

double sum(std::span<const double> x) noexcept;
double dot(std::span<const double> a, std::span<const double> b) noexcept;
double lengthSquared(std::span<const double> a) noexcept;
double length(std::span<const double> a) noexcept;
double normalizedComponent(std::span<const double> a, std::size_t k) noexcept;
double reflectedComponent(std::span<const double> i, std::span<const double> n,
                          std::size_t k) noexcept;

// For containers, which a template argument does not convert to a span.
template <class T>
T sum(const std::vector<T>& x) noexcept {
  return sum(std::span<const T>(x));
}
template <class T, std::size_t n>
T sum(const std::array<T, n>& x) noexcept {
  return sum(std::span<const T>(x));
}

}  // namespace gnomon

#endif
