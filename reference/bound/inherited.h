// Sums of products bounded over every order of evaluation: the core of dot, length, mix, matrix
// products and sum(range). Internal to reference/bound.
//
// However the sum of n terms is arranged, each term is rounded a limited number of times on its
// way to the result, so the result is the exact one +- gamma_k sum|term|, k that number (Higham,
// Accuracy and Stability of Numerical Algorithms, 2002, section 3.1 and 4.2). Every product and
// every partial sum may besides be denormal and flushed. The sum stays exact where that is
// certain for every order: at most one term that is not zero, or terms on a common grid so coarse
// that no partial sum needs more than 24 bits.
#ifndef GNOMON_REFERENCE_BOUND_INHERITED_H
#define GNOMON_REFERENCE_BOUND_INHERITED_H

#include "reference/bound/bounded.h"

namespace gnomon::detail {

// A term's exact range, from products of floats, which double holds exactly.
struct Term {
  double lo, hi;
  Flags flags;
};
Term product(const Bounded& a) noexcept;
Term product(const Bounded& a, const Bounded& b) noexcept;
Term productOfSame(const Bounded& a) noexcept;  // a a, never negative

class InheritedSum {
 public:
  void add(const Term& term) noexcept;

  // What is otherwise known of the exact sum, for terms that depend on each other.
  void narrow(double lo, double hi) noexcept;

  double exactLo() const noexcept { return std::max(lo_, narrowLo_); }
  double exactHi() const noexcept { return std::min(hi_, narrowHi_); }
  double magnitude() const noexcept { return magnitude_; }  // sum of the largest |term|
  double count() const noexcept { return count_; }          // of terms that may differ from zero
  Flags flags() const noexcept { return flags_; }

  // `roundings`: the most that any order applies to one term.
  Bounded result(double value, double roundings) const noexcept;

 private:
  bool staysExact() const noexcept;
  Bounded ofOneTerm(double value) const noexcept;

  double lo_ = 0, hi_ = 0, magnitude_ = 0;
  double narrowLo_ = -kInfinity, narrowHi_ = kInfinity;
  double grid_ = kInfinity;  // the largest power of two of which all terms are multiples
  double count_ = 0;
  Term last_{0, 0, 0};  // that may differ from zero
  bool points_ = true;
  bool neverNegative_ = true, neverPositive_ = true;
  Flags flags_ = 0;
};

}  // namespace gnomon::detail

#endif
