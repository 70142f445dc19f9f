// Built-ins that inherit their precision from a formula, against the formula with each part as bad
// as its rule permits.
//
// Covered: sqrt pow tan asin acos mix smoothstep mod on points and intervals, under both roundings.
// Not covered here: sums, length, normalize, reflect (bound_sum_test); fma (bound_soundness_test).
#include "tests/reference/bound_random.h"

namespace gnomon::test {
namespace {

class BoundInherited : public EachRounding {};
INSTANTIATE_TEST_SUITE_P(Bound, BoundInherited, kBothRoundings, roundingName);

// Parts are evaluated in double, whose own error (2^-53) is far below a float's; a part's result is
// one of the floats its rule permits.
class Formula {
 public:
  explicit Formula(Arguments& arguments) : arguments_(arguments) {}

  double rounded(double x) { return pick(x, 0, 0); }
  double ulps(double x, double n) { return pick(x, n, 0); }
  double absolute(double x, double e) { return pick(x, 0, e); }
  double either(double a, double b) { return arguments_.below(2) == 0 ? a : b; }

 private:
  // The lowest, the highest or the nearest float that is permitted.
  double pick(double x, double n, double e) {
    if (n == 0 && e == 0 && rules().rounding == Rounding::nearestEven) return static_cast<float>(x);
    const double error = std::max(n * ulp(x), e);
    switch (arguments_.below(3)) {
      case 0:
        return error == 0 ? floorToFloat(x) : ceilToFloat(x - error);
      case 1:
        return error == 0 ? ceilToFloat(x) : floorToFloat(x + error);
      default:
        return static_cast<float>(x);
    }
  }
  static double ulp(double x) {
    static thread_local Real z(53);
    mpfr_set_d(z, x, MPFR_RNDN);
    return specifiedUlp(z);
  }
  Arguments& arguments_;
};

struct Inherited {
  const char* name;
  Bounded (*bound)(const Bounded&, const Bounded&);
  double (*exact)(double, double);
  double (*formula)(Formula&, double, double);
  float loX, hiX, loY, hiY;
  double terms;      // how much of |x| + |y| the formula adds up, where that exceeds its result
  double looseness;  // the widest bound allowed, in units of the worst that was seen
};

double formulaSqrt(Formula& f, double x) {
  return x == 0 ? 0 : f.ulps(1 / f.ulps(1 / std::sqrt(x), 2), 2.5);
}
double formulaComplement(Formula& f, double x) {
  return formulaSqrt(f, f.rounded(1 - f.rounded(x * x)));
}

// Samples do not find the worst of all parts together, and a bound relative to the result is up to
// twice the ULP it stands for; hence a looseness of 2.5, 4 where three or more parts meet, and 10
// for smoothstep, where nine meet.
const Inherited kInherited[] = {
    {"sqrt", [](auto& x, auto&) { return sqrt(x); }, [](double x, double) { return std::sqrt(x); },
     [](Formula& f, double x, double) { return formulaSqrt(f, x); }, 1e-30f, 1e30f, 0, 1, 0, 2.5},
    {"pow", [](auto& x, auto& y) { return pow(x, y); },
     [](double x, double y) { return std::pow(x, y); },
     [](Formula& f, double x, double y) {
       const double log =
           x < 0.5 || x > 2 ? f.ulps(std::log2(x), 3) : f.absolute(std::log2(x), 0x1p-21);
       const double p = f.rounded(y * log);
       return f.ulps(std::exp2(p), 3 + 2 * std::abs(p));
     },
     0.01f, 100, -5, 5, 0, 4},
    {"tan", [](auto& x, auto&) { return tan(x); }, [](double x, double) { return std::tan(x); },
     [](Formula& f, double x, double) {
       return f.ulps(f.absolute(std::sin(x), 0x1p-11) / f.absolute(std::cos(x), 0x1p-11), 2.5);
     },
     -1.5f, 1.5f, 0, 1, 0, 2.5},
    {"asin", [](auto& x, auto&) { return asin(x); }, [](double x, double) { return std::asin(x); },
     [](Formula& f, double x, double) {
       return f.ulps(std::atan2(x, formulaComplement(f, x)), 4096);
     },
     -1, 1, 0, 1, 0, 4},
    {"acos", [](auto& x, auto&) { return acos(x); }, [](double x, double) { return std::acos(x); },
     [](Formula& f, double x, double) {
       return f.ulps(std::atan2(formulaComplement(f, x), x), 4096);
     },
     -1, 1, 0, 1, 0, 4},
    {"mix", [](auto& x, auto& y) { return mix(x, y, 0.3f); },
     [](double x, double y) { return x + (y - x) * 0.3f; },
     [](Formula& f, double x, double y) {
       const double a = 0.3f;
       return f.rounded(f.rounded(x * f.rounded(1 - a)) + f.rounded(y * a));
     },
     -2, 2, -2, 2, 1, 4},
    {"mix, distributed", [](auto& x, auto& y) { return mix(x, y, 0.3f); },
     [](double x, double y) { return x + (y - x) * 0.3f; },
     [](Formula& f, double x, double y) {
       return f.rounded(x + f.rounded(f.rounded(y - x) * 0.3f));
     },
     -2, 2, -2, 2, 1, 4},
    {"smoothstep", [](auto& x, auto& y) { return smoothstep(0.25f, y, x); },
     [](double x, double y) { return smoothstep(0.25f, y, x); },
     [](Formula& f, double x, double y) {
       const double d = f.rounded(y - 0.25);
       const double together = f.ulps(f.rounded(x - 0.25) / d, 2.5);
       const double apart = f.rounded(f.ulps(x / d, 2.5) - f.ulps(0.25 / d, 2.5));
       const double t = std::clamp(f.either(together, apart), 0.0, 1.0);
       const double square = f.rounded(t * t);
       const double cube = f.rounded(square * t);
       return f.either(f.rounded(square * f.rounded(3 - 2 * t)),
                       f.rounded(f.rounded(3 * square) - 2 * cube));
     },
     0, 1.5f, 0.5f, 1.5f, 0, 10},
};

// The specification lets a result lie on either side of x as far as the worst form does on one.
TEST_P(BoundInherited, InheritedOperationsHoldTheirFormulasAtTheirWorstAndLittleElse) {
  for (const Inherited& tested : kInherited) {
    Arguments arguments(10);
    Formula formula(arguments);
    double loosest = 0;
    for (int i = 0; i < 4000; ++i) {
      const float x = arguments.within(tested.loX, tested.hiX);
      const float y = arguments.within(tested.loY, tested.hiY);
      const Bounded got = tested.bound(x, y);
      const double exact = tested.exact(x, y);
      double worst = 0;
      for (int sample = 0; sample < 40; ++sample)
        worst = std::max(worst, std::abs(tested.formula(formula, x, y) - exact));
      ASSERT_LE(got.lo, ceilToFloat(exact - worst * (1 - 0x1p-25)))
          << tested.name << ' ' << x << ' ' << y << got;
      ASSERT_GE(got.hi, floorToFloat(exact + worst * (1 - 0x1p-25)))
          << tested.name << ' ' << x << ' ' << y << got;
      // Where rounding happens to be kind to all samples their ratio would say nothing.
      const double kind = rules().unitRoundoff() * tested.terms * (std::abs(x) + std::abs(y));
      const double half = std::max({worst, kind, 4 * spacing(exact)});
      loosest = std::max(loosest, (got.hi - got.lo) / (2 * half));
    }
    EXPECT_LE(loosest, tested.looseness) << tested.name;
  }
}

TEST_P(BoundInherited, InheritedOperationsOfIntervalsHoldThoseOfEveryPointInside) {
  for (const Inherited& tested : kInherited) {
    Arguments arguments(11);
    for (int i = 0; i < 10000; ++i) {
      const auto [x0, x1] = std::minmax(
          {arguments.within(tested.loX, tested.hiX), arguments.within(tested.loX, tested.hiX)});
      const auto [y0, y1] = std::minmax(
          {arguments.within(tested.loY, tested.hiY), arguments.within(tested.loY, tested.hiY)});
      const Bounded got = tested.bound(Bounded::between(x0, x1), Bounded::between(y0, y1));
      for (int sample = 0; sample < 4; ++sample) {
        const float x = arguments.within(x0, x1), y = arguments.within(y0, y1);
        const Bounded point = tested.bound(x, y);
        ASSERT_TRUE(got.lo <= point.lo && point.hi <= got.hi)
            << tested.name << ' ' << x << ' ' << y << ": " << point << " in " << got;
      }
    }
  }
}

TEST(BoundModulo, HoldsTheFormulaWithItsQuotientRoundedEitherWay) {
  Arguments arguments(12);
  Formula formula(arguments);
  for (int i = 0; i < 100000; ++i) {
    const float y = arguments.within(0.1f, 4);
    const float x =
        i % 2 == 0 ? y * static_cast<float>(arguments.below(50)) : arguments.within(-50, 50);
    const Bounded got = mod(Bounded(x), y);
    // 0 / y = 0 is an assumed exception.
    const double whole = x == 0 ? 0 : std::floor(formula.ulps(static_cast<double>(x) / y, 2.5));
    const double result = formula.rounded(x - formula.rounded(y * whole));
    ASSERT_TRUE(got.lo <= result && result <= got.hi) << x << " mod " << y << ": " << got;
  }
}

}  // namespace
}  // namespace gnomon::test
