#include "reference/bound/ranges.h"

namespace gnomon::detail {
namespace {

// The smallest x - n ulp(x) for x in [from, to]. Away from zero x + n ulp(x) grows with x, but
// towards zero it is a saw: just above a power of two p the ulp doubles and p - 2 n ulp(p) may lie
// below what smaller x reach. Of several powers the smallest is the worst.
double lowestWithin(double from, double to, double n) noexcept {
  const double least = from - n * ulp(from);
  if (from <= 0) return least;
  constexpr std::uint64_t kMantissa = (std::uint64_t{1} << 52) - 1;
  const auto bits = std::bit_cast<std::uint64_t>(from);
  const double power = std::bit_cast<double>((bits + kMantissa) & ~kMantissa);
  return power < to ? std::min(least, power - n * spacing(power)) : least;
}

double highestWithin(double from, double to, double n) noexcept {
  return -lowestWithin(-to, -from, n);
}

// An inner end that is infinite becomes merely huge, so that no difference of infinities arises.
Range withDoubleError(Range range) noexcept {
  constexpr double kHuge = 0x1p1000;
  const double lo = std::min(range.lo, kHuge), hi = std::max(range.hi, -kHuge);
  if (range.exact) return {lo, hi};
  return {lo - std::abs(lo) * kDoubleError, hi + std::abs(hi) * kDoubleError};
}

// A sum of two doubles rounds by no more than this share of the larger.
double lowered(double x, double by) noexcept { return x - by - (std::abs(x) + by) * 0x1p-52; }

}  // namespace

Bounded floatsIn(double value, double lo, double hi, Flags flags) noexcept {
  double low = std::min(ceilToFloat(lo), kMaxFloat);
  double high = std::max(floorToFloat(hi), -kMaxFloat);
  if (hi > kMaxFloat) high = kInfinity;
  if (lo < -kMaxFloat) low = -kInfinity;
  // A measured error below half a ULP may leave no float at all: keep the two around it.
  if (low > high) low = floorToFloat(lo), high = ceilToFloat(hi);
  if (lo > 0 && lo < kMinNormal) low = 0;
  if (hi < 0 && hi > -kMinNormal) high = 0;
  return make(value, low, high, flags);
}

Bounded within(double value, Range range, Error error, Flags flags) noexcept {
  const Range x = withDoubleError(range);
  const double byUlp[] = {lowestWithin(x.lo, x.hi, error.ulp),
                          highestWithin(x.lo, x.hi, error.ulp)};
  const double lo = std::min(lowered(byUlp[0], 0), lowered(x.lo, error.absolute));
  const double hi = std::max(-lowered(-byUlp[1], 0), -lowered(-x.hi, error.absolute));
  const Bounded result = floatsIn(value, lo, hi, flags);
  // From 2^22 ULP on a normal number may change its sign too.
  if (error.absolute > 0 || error.ulp >= 0x1p22) return result;
  return clipped(result, range.lo >= 0 ? 0 : -kInfinity, range.hi <= 0 ? 0 : kInfinity);
}

Bounded around(double value, Range range, double relative, double absolute, Flags flags) noexcept {
  const Range x = withDoubleError(range);
  return floatsIn(value, lowered(x.lo, std::abs(x.lo) * relative + absolute),
                  -lowered(-x.hi, std::abs(x.hi) * relative + absolute), flags);
}

Bounded clipped(Bounded x, double lo, double hi) noexcept {
  x.lo = std::clamp(x.lo, lo, hi);
  x.hi = std::clamp(x.hi, lo, hi);
  return x;
}

double relativeError(Operation operation) noexcept {
  return rules().error(operation, 0, 0).ulp * 0x1p-23;
}

double sqrtError() noexcept {
  if (rules().measuredError(Operation::sqrt)) return relativeError(Operation::sqrt);
  return (1 + relativeError(Operation::divide)) / (1 - relativeError(Operation::inverseSqrt)) - 1;
}

}  // namespace gnomon::detail
