// Comparators and metrics against tables of broken twins: what must hold of one is a battery, which
// the real one passes and every twin fails in the statement that its row names.
//
// Covered: the share of an interval that a result uses; errors of images; the chi-square test.
// Not covered: FLIP, formats that outputs are stored in (tests of their own).
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "harness/image/metrics.h"
#include "harness/verdict/verdict.h"
#include "reference/truth/statistics.h"

namespace gnomon {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kInfF = std::numeric_limits<float>::infinity();
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

/// The statements that did not hold.
class Battery {
 public:
  void holds(const char* statement, bool does) {
    if (!does) broken.emplace_back(statement);
  }
  std::vector<std::string> broken{};
};

template <class F>
struct Twin {
  const char* name;
  F twin;
  const char* caughtBy;  ///< a statement of the battery
};

template <class F>
void expectEveryTwinCaught(const std::function<Battery(const F&)>& battery, const F& real,
                           const std::vector<Twin<F>>& twins) {
  EXPECT_EQ(battery(real).broken, std::vector<std::string>{});
  for (const Twin<F>& t : twins) {
    const auto broken = battery(t.twin).broken;
    EXPECT_TRUE(std::ranges::find(broken, t.caughtBy) != broken.end())
        << "'" << t.name << "' is not caught by '" << t.caughtBy << "' but by " << broken.size()
        << " others: " << testing::PrintToString(broken);
  }
}

Bounded allowing(double value, double lo, double hi, Flags flags = 0) {
  return detail::make(value, lo, hi, flags);
}

using Comparator = std::function<double(double, const Bounded&, bool)>;

Battery comparatorBattery(const Comparator& used) {
  Battery b;
  const Bounded skew = allowing(1, 0.5, 3), exact = allowing(2, 2, 2), across = allowing(0, -1, 1);
  const Bounded zero = allowing(0.0, 0, 0), beside = allowing(4, 1, 3);
  b.holds("the value uses nothing", used(1, skew, false) == 0 && used(2, exact, false) == 0);
  b.holds("an end is used up, not passed",
          used(3, skew, false) == 1 && used(0.5, skew, false) == 1);
  b.holds("a share is of the result's own side",
          used(2, skew, false) == 0.5 && used(0.75, skew, false) == 0.5);
  b.holds("below is as wrong as above", used(0.25, skew, false) > 1 && used(4, skew, false) > 1);
  b.holds("beyond an end is more than one, by how far it is", used(5, skew, false) == 2);
  b.holds("an exact result tolerates nothing",
          used(std::nextafter(2.0f, 3.0f), exact, false) == kInf &&
              used(std::nextafter(2.0f, 0.0f), exact, false) == kInf);
  b.holds("zero lies between numbers of either sign",
          used(-0x1p-149, across, false) <= 1 && used(0x1p-149, across, false) <= 1);
  b.holds("NaN passes nothing that cannot be NaN",
          used(kNan, skew, false) == kInf && used(kNan, exact, false) == kInf);
  b.holds("NaN passes what may be NaN", used(kNan, allowing(1, 0, 2, kMayBeNan), false) == 0);
  b.holds("a number passes what may be NaN only inside",
          used(3, allowing(1, 0, 2, kMayBeNan), false) > 1);
  b.holds("infinity passes no finite interval",
          used(kInf, skew, false) == kInf && used(-kInf, skew, false) == kInf);
  b.holds("infinity passes where it is an end", used(kInf, allowing(1, 0, kInf), false) == 0);
  b.holds("an end at infinity excuses nothing at the other",
          used(-1, allowing(1, 0, kInf), false) == 2);
  b.holds("any zero passes where signs do not count", used(-0.0, zero, false) == 0);
  b.holds("the other zero is wrong where they do",
          used(-0.0, zero, true) == kInf && used(0.0, zero, true) == 0);
  b.holds("signs count for an exact zero alone", used(-0.0, allowing(0, -1, 1), true) == 0);
  // The plain value may lie a rounding outside its interval: then the nearer end is the centre.
  b.holds("a value outside is no reason to pass it",
          used(4, beside, false) > 1 && used(2, beside, false) <= 1);
  return b;
}

const Comparator kBudget = budgetUsed;

TEST(BrokenTwins, OfTheShareOfAnIntervalAreCaught) {
  const auto share = [](double got, const Bounded& a) {
    return std::abs(got - a.value) / (a.hi - a.value);
  };
  // Everything that a row does not break is the real one.
  const std::vector<Twin<Comparator>> twins = {
      {"NaN passes",
       [](double got, const Bounded& a, bool s) {
         return std::isnan(got) ? 0 : budgetUsed(got, a, s);
       },
       "NaN passes nothing that cannot be NaN"},
      {"NaN by comparing with the ends",
       [](double got, const Bounded& a, bool s) {
         return std::isnan(got) ? (got < a.lo || got > a.hi ? kInf : 0) : budgetUsed(got, a, s);
       },
       "NaN passes nothing that cannot be NaN"},
      {"NaN never passes",
       [](double got, const Bounded& a, bool s) {
         return std::isnan(got) ? kInf : budgetUsed(got, a, s);
       },
       "NaN passes what may be NaN"},
      {"what may be NaN may be anything",
       [](double got, const Bounded& a, bool s) {
         return a.mayBeNan() ? 0 : budgetUsed(got, a, s);
       },
       "a number passes what may be NaN only inside"},
      {"infinity passes",
       [](double got, const Bounded& a, bool s) {
         return std::isinf(got) ? 0 : budgetUsed(got, a, s);
       },
       "infinity passes no finite interval"},
      {"infinity never passes",
       [](double got, const Bounded& a, bool s) {
         return std::isinf(got) ? kInf : budgetUsed(got, a, s);
       },
       "infinity passes where it is an end"},
      {"an end at infinity admits everything",
       [](double got, const Bounded& a, bool s) {
         return !std::isnan(got) && std::isinf(a.hi) ? 0 : budgetUsed(got, a, s);
       },
       "an end at infinity excuses nothing at the other"},
      {"the sign of zero never counts",
       [](double got, const Bounded& a, bool) { return budgetUsed(got, a, false); },
       "the other zero is wrong where they do"},
      {"the sign of zero always counts",
       [](double got, const Bounded& a, bool) { return budgetUsed(got, a, true); },
       "any zero passes where signs do not count"},
      {"the sign of every zero counts",
       [](double got, const Bounded& a, bool s) {
         return s && got == 0 && std::signbit(got) != std::signbit(a.value) ? kInf
                                                                            : budgetUsed(got, a, s);
       },
       "signs count for an exact zero alone"},
      {"the upper side's room for both sides",
       [&](double got, const Bounded& a, bool s) {
         const double real = budgetUsed(got, a, s);
         return std::isfinite(real) && std::isfinite(a.hi) && real > 0 ? share(got, a) : real;
       },
       "a share is of the result's own side"},
      {"the wrong side's room",
       [](double got, const Bounded& a, bool s) {
         const double real = budgetUsed(got, a, s);
         if (!(real > 0 && std::isfinite(real))) return real;
         return std::abs(got - a.value) / (got > a.value ? a.value - a.lo : a.hi - a.value);
       },
       "an end is used up, not passed"},
      {"too little is never wrong",
       [](double got, const Bounded& a, bool s) {
         return got < a.value ? 0 : budgetUsed(got, a, s);
       },
       "below is as wrong as above"},
      {"too much is never wrong",
       [](double got, const Bounded& a, bool s) {
         return got > a.value ? 0 : budgetUsed(got, a, s);
       },
       "below is as wrong as above"},
      {">= for >: an end is outside",
       [](double got, const Bounded& a, bool s) {
         return got == a.hi && a.lo != a.hi ? kInf : budgetUsed(got, a, s);
       },
       "an end is used up, not passed"},
      {"one at most",
       [](double got, const Bounded& a, bool s) { return std::min(1.0, budgetUsed(got, a, s)); },
       "below is as wrong as above"},
      {"inside or outside, no share",
       [](double got, const Bounded& a, bool s) { return budgetUsed(got, a, s) > 1 ? kInf : 0; },
       "a share is of the result's own side"},
      {"infinite as soon as outside",
       [](double got, const Bounded& a, bool s) {
         const double real = budgetUsed(got, a, s);
         return real > 1 ? kInf : real;
       },
       "beyond an end is more than one, by how far it is"},
      {"an exact result tolerates an ULP",
       [](double got, const Bounded& a, bool s) {
         const double ulp = 0x1p-22 * std::abs(a.value);
         return a.lo == a.hi && a.lo != 0 && std::abs(got - a.value) <= ulp ? 0
                                                                            : budgetUsed(got, a, s);
       },
       "an exact result tolerates nothing"},
      {"an exact result divides 0 by 0, and NaN is not above 1",
       [](double got, const Bounded& a, bool s) {
         return a.lo == a.hi && a.lo != 0 && std::isfinite(got)
                    ? 0 * (got - a.value) / (a.hi - a.lo)
                    : budgetUsed(got, a, s);
       },
       "the value uses nothing"},
      {"ULPs by raw bits, across zero",
       [](double got, const Bounded& a, bool s) {
         const double real = budgetUsed(got, a, s);
         if (!(a.lo < 0 && a.hi > 0) || !std::isfinite(real)) return real;
         const auto bits = [](double x) {
           return static_cast<double>(std::bit_cast<std::uint32_t>(static_cast<float>(x)));
         };
         return std::abs(bits(got) - bits(a.value)) / (bits(a.hi) - bits(a.value));
       },
       "zero lies between numbers of either sign"},
      {"whatever equals the plain value passes",
       [](double got, const Bounded& a, bool s) {
         return got == a.value && std::signbit(got) == std::signbit(a.value)
                    ? 0
                    : budgetUsed(got, a, s);
       },
       "a value outside is no reason to pass it"},
  };
  EXPECT_EQ(twins.size(), 22u);
  expectEveryTwinCaught<Comparator>(comparatorBattery, kBudget, twins);
}

using Metric = std::function<Difference(const Image&, const Image&)>;

Image grey(int width, int height, float all = 0) {
  Image image = makeImage(width, height, {"Y"});
  std::ranges::fill(image.data, all);
  return image;
}

Image with(Image image, int x, int y, float value) {
  image.at(x, y, 0) = value;
  return image;
}

Difference real(const Image& a, const Image& b) { return difference(a, b, a.channels); }

Battery metricBattery(const Metric& metric) {
  Battery b;
  const Image black = grey(33, 17);
  const Difference none = metric(black, black);
  b.holds("equal images do not differ", none.max == 0 && none.rmse == 0 && none.worstBlock == 0);
  b.holds("equal images have an infinite PSNR", none.psnr == kInf);

  // One wrong pixel of 33 x 17: in the corner block of 1 x 1 its RMSE is the error itself.
  const Difference corner = metric(black, with(black, 32, 16, 0.5f));
  b.holds("the largest error is the largest, and where",
          corner.max == 0.5 && corner.maxAt == Pixel{32, 16} && corner.test == 0.5);
  b.holds("a wrong corner is no average", corner.worstBlock == 0.5);
  b.holds("RMSE is over all pixels", std::abs(corner.rmse - 0.5 / std::sqrt(33.0 * 17)) < 1e-15);
  // 20 log10(1 / RMSE), by hand.
  b.holds("PSNR is of the peak over the RMSE",
          std::abs(corner.psnr - 10 * std::log10(33.0 * 17 / 0.25)) < 1e-12);
  // (15, 0) and (16, 0) are in two blocks: 0.5 over 256 pixels and over 256.
  const Difference border = metric(black, with(with(black, 15, 0, 0.5f), 16, 0, 0.75f));
  b.holds("blocks begin at multiples of 16",
          border.worstBlock == 0.75 / 16 && border.worstBlockAt == Pixel{16, 0});
  b.holds("an error below is one", metric(black, with(black, 0, 0, -2)).max == 2);
  // The reference's peak, whatever the other image holds.
  b.holds("the peak is the reference's", metric(with(black, 0, 0, 4), black).peak == 4 &&
                                             metric(black, with(black, 0, 0, 4)).peak == 1);
  const Image nan = with(black, 3, 3, kNanF), inf = with(black, 3, 3, kInfF);
  b.holds("NaN against a number is infinite",
          metric(black, nan).max == kInf && metric(nan, black).max == kInf);
  b.holds("infinity against a number is infinite", metric(black, inf).rmse == kInf);
  b.holds("infinities of either sign differ", metric(inf, with(black, 3, 3, -kInfF)).max == kInf);
  b.holds("the same infinity or NaN is equal",
          metric(inf, inf).max == 0 && metric(nan, nan).max == 0);
  const float huge = std::numeric_limits<float>::max();
  const Difference large = metric(black, grey(33, 17, huge));
  b.holds("squares of the largest floats do not overflow",
          std::abs(large.rmse / static_cast<double>(huge) - 1) < 1e-12);
  return b;
}

/// The real metric, and then something done to what it says.
template <class F>
Metric altered(F f) {
  return [f](const Image& a, const Image& b) {
    Difference d = real(a, b);
    f(d, a, b);
    return d;
  };
}

TEST(BrokenTwins, OfImageMetricsAreCaught) {
  const auto each = [](const Image& image, const auto& f) {
    Image copy = image;
    std::ranges::for_each(copy.data, f);
    return copy;
  };
  const auto withoutNan = [=](const Image& image) {
    return each(image, [](float& x) { x = std::isnan(x) ? 0 : x; });
  };
  const auto withoutInf = [=](const Image& image) {
    return each(image, [](float& x) { x = std::isinf(x) ? 0 : x; });
  };
  const std::vector<Twin<Metric>> twins = {
      {"mean instead of max",
       altered([](Difference& d, const Image&, const Image&) { d.max = d.rmse; }),
       "the largest error is the largest, and where"},
      {"NaN counts as 0",
       [=](const Image& a, const Image& b) { return real(withoutNan(a), withoutNan(b)); },
       "NaN against a number is infinite"},
      {"infinity counts as 0",
       [=](const Image& a, const Image& b) { return real(withoutInf(a), withoutInf(b)); },
       "infinity against a number is infinite"},
      {"infinity by magnitude",
       [=](const Image& a, const Image& b) {
         const auto positive = [](float& x) { x = std::isinf(x) ? kInfF : x; };
         return real(each(a, positive), each(b, positive));
       },
       "infinities of either sign differ"},
      {"what is not finite is never equal", altered([](Difference& d, const Image&, const Image&) {
         if (d.nonFinite > 0) d.max = kInf;
       }),
       "the same infinity or NaN is equal"},
      {"too dark is no error",
       [](const Image& a, const Image& b) {
         Image raised = b;
         for (std::size_t i = 0; i < raised.data.size(); ++i)
           if (raised.data[i] < a.data[i]) raised.data[i] = a.data[i];
         return real(a, raised);
       },
       "an error below is one"},
      {"the worst block is the whole image",
       altered([](Difference& d, const Image&, const Image&) { d.worstBlock = d.rmse; }),
       "a wrong corner is no average"},
      {"a partial block is divided by a whole one's pixels",
       altered([](Difference& d, const Image&, const Image&) {
         if (d.worstBlockAt == Pixel{32, 16}) d.worstBlock /= kBlockSize;
       }),
       "a wrong corner is no average"},
      {"blocks begin one pixel early",
       [](const Image& a, const Image& b) {
         const auto shifted = [](const Image& from) {
           Image to = makeImage(from.width + 1, from.height, from.channels);
           for (int y = 0; y < from.height; ++y)
             for (int x = 0; x < from.width; ++x) to.at(x + 1, y, 0) = from.at(x, y, 0);
           return to;
         };
         Difference d = real(a, b);
         const Difference moved = real(shifted(a), shifted(b));
         d.worstBlock = moved.worstBlock;
         d.worstBlockAt = moved.worstBlockAt;
         return d;
       },
       "blocks begin at multiples of 16"},
      {"partial blocks are left out", altered([](Difference& d, const Image& a, const Image&) {
         if (d.worstBlockAt.x + kBlockSize > a.width) d.worstBlock = 0;
       }),
       "a wrong corner is no average"},
      {"reference and test swapped", [](const Image& a, const Image& b) { return real(b, a); },
       "the peak is the reference's"},
      {"PSNR by 10 log10", altered([](Difference& d, const Image&, const Image&) { d.psnr /= 2; }),
       "PSNR is of the peak over the RMSE"},
      {"PSNR of a peak of 255",
       altered([](Difference& d, const Image&, const Image&) { d.psnr += 20 * std::log10(255.0); }),
       "PSNR is of the peak over the RMSE"},
      {"PSNR of equal images is a large number",
       altered([](Difference& d, const Image&, const Image&) { d.psnr = std::min(d.psnr, 99.0); }),
       "equal images have an infinite PSNR"},
      {"mean squared error for its root",
       altered([](Difference& d, const Image&, const Image&) { d.rmse *= d.rmse; }),
       "RMSE is over all pixels"},
      {"squares in float", altered([](Difference& d, const Image&, const Image&) {
         const auto r = static_cast<float>(d.rmse);
         d.rmse = std::isinf(r * r) ? kInf : d.rmse;
       }),
       "squares of the largest floats do not overflow"},
  };
  EXPECT_EQ(twins.size(), 16u);
  expectEveryTwinCaught<Metric>(metricBattery, real, twins);
}

using Counts = std::vector<double>;
using ChiSquare = std::function<double(const Counts&, const Counts&)>;

Battery chiSquareBattery(const ChiSquare& p) {
  Battery b;
  b.holds("what is expected is certain", p({10, 20, 30}, {10, 20, 30}) == 1);
  // Two degrees of freedom: the tail is exp(-x / 2); here x is twice 4 / 10, below twice 16 / 10.
  b.holds("the p-value is the tail's",
          std::abs(p({12, 8, 10}, {10, 10, 10}) - std::exp(-0.4)) < 1e-12);
  b.holds("too few is as unlikely as too many", p({0, 100}, {50, 50}) < 1e-6);
  b.holds("expected counts divide, not observed ones",
          std::abs(p({14, 10, 6}, {10, 10, 10}) - std::exp(-1.6)) < 1e-12);
  b.holds("a bin that nothing is expected in is not left out", p({50, 50, 40}, {50, 50, 0}) < 1e-6);
  // Pools of 3 + 3 and 3 + 3, and 3 left, which join the second: else 100 would count for nothing.
  b.holds("what is left of pooling is not dropped", p({3, 3, 3, 3, 100}, {3, 3, 3, 3, 3}) < 1e-6);
  return b;
}

double statistic(const Counts& o, const Counts& e, const Counts& by) {
  double sum = 0;
  for (std::size_t i = 0; i < o.size(); ++i) sum += (o[i] - e[i]) * (o[i] - e[i]) / by[i];
  return sum;
}

TEST(BrokenTwins, OfTheChiSquareTestAreCaught) {
  const auto tail = [](double x, std::size_t degrees) {
    return truth::chiSquareTail(x, static_cast<double>(degrees));
  };
  const std::vector<Twin<ChiSquare>> twins = {
      {"as many degrees of freedom as bins",
       [=](const Counts& o, const Counts& e) { return tail(statistic(o, e, e), o.size()); },
       "the p-value is the tail's"},
      {"divided by what was observed",
       [=](const Counts& o, const Counts& e) { return tail(statistic(o, e, o), o.size() - 1); },
       "expected counts divide, not observed ones"},
      {"the head for the tail",
       [=](const Counts& o, const Counts& e) { return 1 - truth::chiSquareTest(o, e); },
       "what is expected is certain"},
      {"too few does not count",
       [=](const Counts& o, const Counts& e) {
         Counts raised = o;
         for (std::size_t i = 0; i < o.size(); ++i) raised[i] = std::max(o[i], e[i]);
         return truth::chiSquareTest(raised, e);
       },
       "the p-value is the tail's"},
      {"bins that nothing is expected in are left out",
       [=](const Counts& o, const Counts& e) {
         Counts kept, wanted;
         for (std::size_t i = 0; i < o.size(); ++i)
           if (e[i] > 0) kept.push_back(o[i]), wanted.push_back(e[i]);
         return truth::chiSquareTest(kept, wanted);
       },
       "a bin that nothing is expected in is not left out"},
  };
  expectEveryTwinCaught<ChiSquare>(chiSquareBattery, truth::chiSquareTest, twins);
}

}  // namespace
}  // namespace gnomon
