#include "reference/bound/altered.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace gnomon {
namespace {

constexpr std::array<std::pair<Alteration, std::string_view>, 12> kNames = {{
    {Alteration::none, "none"},
    {Alteration::add, "add"},
    {Alteration::subtract, "subtract"},
    {Alteration::multiply, "multiply"},
    {Alteration::divide, "divide"},
    {Alteration::negate, "negate"},
    {Alteration::first, "first"},
    {Alteration::second, "second"},
    {Alteration::literal, "literal"},
    {Alteration::function, "function"},
    {Alteration::compare, "compare"},
    {Alteration::threshold, "threshold"},
}};

Altered function(const Altered& x, double (*of)(double) noexcept) {
  const bool altered = AlteredEvaluation::next(Alteration::function, {x.value, x.value});
  return altered ? x : Altered::input(of(x.value));
}

Altered function(const Altered& x, const Altered& y, double (*of)(double, double) noexcept) {
  const bool altered = AlteredEvaluation::next(Alteration::function, {x.value, y.value});
  return altered ? x : Altered::input(of(x.value, y.value));
}

Altered either(const Altered& a, const Altered& b, double (*of)(double, double) noexcept) {
  const Alteration altered =
      AlteredEvaluation::next(Alteration::first, Alteration::second, {a.value, b.value});
  if (altered == Alteration::first) return a;
  if (altered == Alteration::second) return b;
  return Altered::input(of(a.value, b.value));
}

}  // namespace

std::string_view nameOf(Alteration kind) {
  return std::ranges::find(kNames, kind, &decltype(kNames)::value_type::first)->second;
}

Alteration alterationNamed(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &decltype(kNames)::value_type::second);
  return found == kNames.end() ? Alteration::none : found->first;
}

void AlteredEvaluation::record(std::uint32_t number, Alteration one, Alteration other,
                               Operands operands) {
  running.steps->push_back({{number, running.path, one}, operands});
  if (other != one) running.steps->push_back({{number, running.path, other}, operands});
}

Altered min(const Altered& a, const Altered& b) noexcept { return either(a, b, min); }
Altered max(const Altered& a, const Altered& b) noexcept { return either(a, b, max); }
Altered clamp(const Altered& x, const Altered& lo, const Altered& hi) noexcept {
  return min(max(x, lo), hi);
}
// Each in the shape that real.h has it, so that what is not altered is the plain model's double.
Altered mix(const Altered& x, const Altered& y, const Altered& a) noexcept {
  return x * (Altered(1) - a) + y * a;
}
Altered step(const Altered& edge, const Altered& x) noexcept {
  return select(x < edge, Altered(0), Altered(1));
}
Altered smoothstep(const Altered& edge0, const Altered& edge1, const Altered& x) noexcept {
  const Altered t = clamp((x - edge0) / (edge1 - edge0), Altered(0), Altered(1));
  return t * t * (Altered(3) - Altered(2) * t);
}
// Rounded once where it is not altered: as a product and a sum it would be rounded twice.
Altered fma(const Altered& a, const Altered& b, const Altered& c) noexcept {
  const Alteration altered =
      AlteredEvaluation::next(Alteration::multiply, Alteration::add, {a.value, b.value});
  if (altered == Alteration::multiply) return Altered::input(a.value / b.value + c.value);
  return Altered::input(fma(a.value, b.value, altered == Alteration::add ? -c.value : c.value));
}
Altered square(const Altered& x) noexcept { return x * x; }
Altered fract(const Altered& x) noexcept { return x - floor(x); }
Altered mod(const Altered& x, const Altered& y) noexcept { return x - y * floor(x / y); }

Altered abs(const Altered& x) noexcept { return function(x, abs); }
Altered sign(const Altered& x) noexcept { return function(x, sign); }
Altered floor(const Altered& x) noexcept { return function(x, floor); }
Altered ceil(const Altered& x) noexcept { return function(x, ceil); }
Altered trunc(const Altered& x) noexcept { return function(x, trunc); }
Altered round(const Altered& x) noexcept { return function(x, round); }
Altered roundEven(const Altered& x) noexcept { return function(x, roundEven); }
Altered sqrt(const Altered& x) noexcept { return function(x, sqrt); }
Altered inversesqrt(const Altered& x) noexcept { return function(x, inversesqrt); }
Altered exp(const Altered& x) noexcept { return function(x, exp); }
Altered exp2(const Altered& x) noexcept { return function(x, exp2); }
Altered log(const Altered& x) noexcept { return function(x, log); }
Altered log2(const Altered& x) noexcept { return function(x, log2); }
Altered pow(const Altered& x, const Altered& y) noexcept { return function(x, y, pow); }
Altered sin(const Altered& x) noexcept { return function(x, sin); }
Altered cos(const Altered& x) noexcept { return function(x, cos); }
Altered tan(const Altered& x) noexcept { return function(x, tan); }
Altered asin(const Altered& x) noexcept { return function(x, asin); }
Altered acos(const Altered& x) noexcept { return function(x, acos); }
Altered atan(const Altered& x) noexcept { return function(x, atan); }
Altered atan2(const Altered& y, const Altered& x) noexcept { return function(y, x, atan2); }

Altered sum(std::span<const Altered> x) noexcept {
  Altered total;
  for (std::size_t i = 0; i < x.size(); ++i) total = i == 0 ? x[0] : total + x[i];
  return total;
}
Altered dot(std::span<const Altered> a, std::span<const Altered> b) noexcept {
  assert(a.size() == b.size());
  Altered total;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Altered product = a[i] * b[i];
    total = i == 0 ? product : total + product;
  }
  return total;
}
Altered lengthSquared(std::span<const Altered> a) noexcept { return dot(a, a); }
Altered length(std::span<const Altered> a) noexcept { return sqrt(dot(a, a)); }
Altered normalizedComponent(std::span<const Altered> a, std::size_t k) noexcept {
  return a[k] * inversesqrt(dot(a, a));
}
Altered reflectedComponent(std::span<const Altered> i, std::span<const Altered> n,
                           std::size_t k) noexcept {
  return i[k] - Altered(2) * dot(n, i) * n[k];
}

}  // namespace gnomon
