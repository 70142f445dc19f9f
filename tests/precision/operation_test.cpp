// precision/*: every built-in that a stage may use, over its domain: inside its rule, and how far
// from the exact result at worst. That worst makes the device bound of every other stage.
//
// Covered: divide, inversesqrt, sqrt, exp, exp2, log, log2, pow, sin, cos, tan, asin, acos, atan,
// atan2, add, multiply, fma; the assumed exceptions of rules.h; ends of domains, powers of two and
// their neighbours, denormals, exact results. One-argument operations run over every float of
// their domain on a GPU, over a stratified sample (every binade alike) on a software device.
// Not covered: sinh, cosh and the inverse hyperbolics (no stage uses them).
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>

#include <fmt/format.h>

#include "harness/cases/kernel_case.h"
#include "harness/cases/random.h"
#include "harness/verdict/parallel.h"
#include "kernels/precision/precision.h"

namespace gnomon::precision {
namespace {

/// How the worst error of an operation is counted, after how its rule is written.
enum class Kind {
  kUlp,        ///< in ULP
  kAbsolute,   ///< absolute: the rule is, or the result passes through 0
  kLog,        ///< absolute for arguments in [0.5, 2], else in ULP
  kInherited,  ///< bounded by a formula; nothing to put in its place
};

struct Interval {
  double lo, hi;
};

/// One operation: what the shader computes, what it should, and over what.
struct Subject {
  const char* entry;
  std::optional<Operation> operation;  ///< none: correctly rounded, no error of its own
  Kind kind;
  int arguments;
  Interval x, y;
  double (*exact)(double, double);
  Bounded (*bounded)(const Bounded&, const Bounded&);
};

using B = const Bounded&;
constexpr float kMin = std::numeric_limits<float>::min(), kMax = std::numeric_limits<float>::max();
// The last float below pi: the domains of sin and cos end there.
constexpr double kPi = 3.1415925f;
constexpr Interval kAny{-kMax, kMax}, kNone{0, 0};

// clang-format off
const Subject kSubjects[] = {
  {"divide", Operation::divide, Kind::kUlp, 2, {-0x1p60, 0x1p60}, {-0x1p60, 0x1p60},
   [](double x, double y) { return x / y; }, [](B x, B y) { return x / y; }},
  {"inversesqrt", Operation::inverseSqrt, Kind::kUlp, 1, {kMin, kMax}, kNone,
   [](double x, double) { return 1 / std::sqrt(x); }, [](B x, B) { return inversesqrt(x); }},
  {"sqrt", Operation::sqrt, Kind::kUlp, 1, {0, kMax}, kNone,
   [](double x, double) { return std::sqrt(x); }, [](B x, B) { return sqrt(x); }},
  {"exp", Operation::exp, Kind::kUlp, 1, {-87, 88}, kNone,
   [](double x, double) { return std::exp(x); }, [](B x, B) { return exp(x); }},
  {"exp2", Operation::exp2, Kind::kUlp, 1, {-126, 127}, kNone,
   [](double x, double) { return std::exp2(x); }, [](B x, B) { return exp2(x); }},
  {"log", Operation::log, Kind::kLog, 1, {kMin, kMax}, kNone,
   [](double x, double) { return std::log(x); }, [](B x, B) { return log(x); }},
  {"log2", Operation::log2, Kind::kLog, 1, {kMin, kMax}, kNone,
   [](double x, double) { return std::log2(x); }, [](B x, B) { return log2(x); }},
  {"pow", Operation::pow, Kind::kInherited, 2, {0x1p-24, 0x1p10}, {-8, 8},
   [](double x, double y) { return std::pow(x, y); }, [](B x, B y) { return pow(x, y); }},
  {"sin", Operation::sin, Kind::kAbsolute, 1, {-kPi, kPi}, kNone,
   [](double x, double) { return std::sin(x); }, [](B x, B) { return sin(x); }},
  {"cos", Operation::cos, Kind::kAbsolute, 1, {-kPi, kPi}, kNone,
   [](double x, double) { return std::cos(x); }, [](B x, B) { return cos(x); }},
  {"tan", Operation::tan, Kind::kInherited, 1, {-1.5, 1.5}, kNone,
   [](double x, double) { return std::tan(x); }, [](B x, B) { return tan(x); }},
  {"asin", Operation::asin, Kind::kAbsolute, 1, {-1, 1}, kNone,
   [](double x, double) { return std::asin(x); }, [](B x, B) { return asin(x); }},
  {"acos", Operation::acos, Kind::kAbsolute, 1, {-1, 1}, kNone,
   [](double x, double) { return std::acos(x); }, [](B x, B) { return acos(x); }},
  {"atan", Operation::atan, Kind::kUlp, 1, kAny, kNone,
   [](double x, double) { return std::atan(x); }, [](B x, B) { return atan(x); }},
  {"atan2", Operation::atan2, Kind::kUlp, 2, {0x1p-60, 0x1p60}, {-0x1p60, 0x1p60},
   [](double y, double x) { return std::atan2(y, x); }, [](B y, B x) { return atan2(y, x); }},
  {"add", std::nullopt, Kind::kInherited, 2, kAny, kAny,
   [](double x, double y) { return x + y; }, [](B x, B y) { return x + y; }},
  {"multiply", std::nullopt, Kind::kInherited, 2, {-0x1p60, 0x1p60}, {-0x1p60, 0x1p60},
   [](double x, double y) { return x * y; }, [](B x, B y) { return x * y; }},
  {"fma", std::nullopt, Kind::kInherited, 2, {-0x1p60, 0x1p60}, {-0x1p60, 0x1p60},
   [](double x, double y) { return x * y + x; }, [](B x, B y) { return fma(x, y, x); }},
};
// clang-format on

/// Floats in order: the n-th float counted from -infinity upwards, and back.
std::int64_t rank(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  return bits >= 0 ? bits : std::int64_t{std::numeric_limits<std::int32_t>::min()} - bits;
}
float ranked(std::int64_t n) {
  return n >= 0 ? std::bit_cast<float>(static_cast<std::int32_t>(n))
                : std::bit_cast<float>(static_cast<std::int32_t>(
                      std::int64_t{std::numeric_limits<std::int32_t>::min()} - n));
}

/// A float of the interval: uniform among floats, so that every binade comes as often, half of the
/// time; next to a power of two, or uniform among reals, the other times.
float draw(Random& random, const Interval& in) {
  const auto clampToFloat = [&](double x) {
    return static_cast<float>(std::clamp(x, in.lo, in.hi));
  };
  if (random.chance(0.25)) return clampToFloat(random.uniform(in.lo, in.hi));
  const std::int64_t lo = rank(static_cast<float>(in.lo)), hi = rank(static_cast<float>(in.hi));
  const float any =
      ranked(lo + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(hi - lo + 1))));
  if (random.chance(0.75) || any == 0) return any;
  const double power = std::copysign(std::exp2(std::floor(std::log2(std::abs(any)))), any);
  return clampToFloat(power * (1 + (static_cast<double>(random.below(5)) - 2) * 0x1p-23));
}

/// Where rules change or results are exact: ends of the domain, zeros, ones, the smallest normal.
std::vector<float> corners(const Interval& in) {
  std::vector<float> inside;
  for (const double x : {in.lo, in.hi, 0.0, -0.0, 1.0, -1.0, 0.5, 2.0, double{kMin}, -double{kMin}})
    if (x >= in.lo && x <= in.hi) inside.push_back(static_cast<float>(x));
  return inside;
}

std::vector<Arguments> cornersOf(const Subject& subject) {
  std::vector<Arguments> all;
  for (const float x : corners(subject.x))
    for (const float y : subject.arguments == 2 ? corners(subject.y) : std::vector<float>{0})
      if (subject.operation != Operation::divide || std::abs(y) >= kMin) all.push_back({x, y});
  return all;
}

std::vector<Arguments> stratified(const Subject& subject, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<Arguments> all = cornersOf(subject);
  const std::size_t first = all.size();
  all.resize(std::max(n, first));
  for (Arguments& a : std::span(all).subspan(first)) {
    a.x = draw(random, subject.x);
    a.y = subject.arguments == 2 ? draw(random, subject.y) : 0;
    // Divisors are specified down to 2^-126, the smallest normal.
    if (subject.operation == Operation::divide && std::abs(a.y) < kMin)
      a.y = std::copysign(float{kMin}, a.y);
  }
  return all;
}

/// Distance from the exact result in the units of the operation's kind.
Error errorOf(const Subject& subject, const Arguments& a, float got) {
  const double exact = subject.exact(a.x, a.y), off = std::abs(got - exact);
  // Beyond the largest float a result may be infinite.
  if (!(std::abs(exact) <= kMax)) return {};
  if (!std::isfinite(got)) return {kInfinity, kInfinity};
  // A flushed denormal says nothing about the operation; its rule allows it apart.
  const bool denormal = std::abs(exact) < kMin || std::abs(a.x) < kMin;
  const bool absolute =
      subject.kind == Kind::kAbsolute || (subject.kind == Kind::kLog && a.x >= 0.5f && a.x <= 2);
  if (absolute) return {0, off};
  return {denormal ? 0 : off / ulp(exact), 0};
}

/// Whether the specification's own rule for the operation, if it has one, is kept.
bool keepsRule(const Subject& subject, const Arguments& a, float got) {
  const auto allowed = Rules::specifiedError(*subject.operation, a.x, a.x);
  const double exact = subject.exact(a.x, a.y);
  if (!allowed || !(std::abs(exact) <= kMax) || std::abs(exact) < kMin || std::abs(a.x) < kMin)
    return true;
  // The exact result is a double: 2^-49 of it is more than its own error.
  const double room =
      std::max(allowed->ulp * ulp(exact), allowed->absolute) + std::abs(exact) * 0x1p-49;
  return std::abs(got - exact) <= room;
}

/// The worst of many, merged over the cores.
struct Worst {
  Error error;
  double ulpAt = 0, absoluteAt = 0;
  std::size_t outside = 0;  ///< arguments whose result breaks the specification's rule
  double outsideAt = 0;     ///< one of them

  void add(const Error& e, double at) {
    if (e.ulp > error.ulp) error.ulp = e.ulp, ulpAt = at;
    if (e.absolute > error.absolute) error.absolute = e.absolute, absoluteAt = at;
  }
  void add(const Worst& other) {
    add({other.error.ulp, 0}, other.ulpAt);
    add({0, other.error.absolute}, other.absoluteAt);
    if (other.outside > 0) outsideAt = other.outsideAt;
    outside += other.outside;
  }
};

Worst worstOf(const Subject& subject, const std::vector<Arguments>& arguments,
              const std::vector<Result>& results) {
  Worst worst;
  std::mutex mutex;
  parallelFor(arguments.size(), [&](std::size_t begin, std::size_t end) {
    Worst mine;
    for (std::size_t i = begin; i < end; ++i) {
      mine.add(errorOf(subject, arguments[i], results[i].value), arguments[i].x);
      if (keepsRule(subject, arguments[i], results[i].value)) continue;
      ++mine.outside;
      mine.outsideAt = arguments[i].x;
    }
    const std::lock_guard lock(mutex);
    worst.add(mine);
  });
  return worst;
}

class OperationCase : public KernelCase {
 protected:
  explicit OperationCase(const Subject& s)
      : KernelCase(std::string("precision/") + s.entry), subject(s) {}

  Observation dispatch(const std::vector<Arguments>& arguments) {
    const Measure push{.count = static_cast<uint>(arguments.size())};
    return run({.inputs = {{"arguments", std::as_bytes(std::span(arguments))}},
                .outputs = {{"results", arguments.size()}},
                .push = std::as_bytes(std::span(&push, 1)),
                .extent = {arguments.size()}});
  }

  const Subject& subject;
};

/// One scalar as a model's result.
template <class T>
struct Value {
  T value;
  auto scalars() { return std::tie(value); }
};

/// Inside the rule at every argument of a stratified sample.
class InsideItsRule : public OperationCase {
 public:
  explicit InsideItsRule(const Subject& s) : OperationCase(s) {}
  void TestBody() override {
    const std::vector<Arguments> arguments =
        stratified(subject, generated("precisionArguments"), caseSeed());
    const auto model = [&]<class T>(std::size_t i) {
      const Arguments& a = arguments[i];
      if constexpr (std::is_same_v<T, double>)
        return Value<T>{subject.exact(a.x, a.y)};
      else
        return Value<T>{subject.bounded(Bounded::input(a.x), Bounded::input(a.y))};
    };
    Expectation expected = expectationOf("results", arguments.size(), model, [&](std::size_t i) {
      return fmt::format("    x  {:.9g}\n    y  {:.9g}\n", arguments[i].x, arguments[i].y);
    });
    expected.corners = cornersOf(subject).size();
    expected.judgesRules = true;
    expectWithinSpecification(dispatch(arguments), expected);
  }
};

/// The worst error, over every float on a GPU; handed to the session for the device bounds.
class WorstErrorIsMeasured : public OperationCase {
 public:
  explicit WorstErrorIsMeasured(const Subject& s) : OperationCase(s) {}
  void TestBody() override {
    const bool exhaustive = subject.arguments == 1 && !Session::current().gpu().info().software;
    MeasuredError measured = exhaustive ? everyFloat() : sample();
    RecordProperty("ulp", fmt::format("{}", measured.worst.ulp));
    RecordProperty("absolute", fmt::format("{}", measured.worst.absolute));
    if (!HasFailure()) Session::current().measured(*subject.operation, measured);
  }

 private:
  MeasuredError sample() {
    const std::vector<Arguments> arguments =
        stratified(subject, generated("precisionArguments"), caseSeed());
    const Observation seen = dispatch(arguments);
    expectClean(seen);
    checked(arguments.size());
    const auto results = elementsOf<Result>(seen.twin.at("results"));
    return measuredError(worstOf(subject, arguments, results), arguments.size(), false);
  }

  MeasuredError everyFloat() {
    const std::int64_t chunk = std::min<std::int64_t>(
        1 << 26, std::int64_t{Session::current().gpu().info().maxGroupCount[0]} * kGroupSize);
    const std::int64_t first = rank(static_cast<float>(subject.x.lo));
    const std::int64_t last = rank(static_cast<float>(subject.x.hi));
    Worst worst;
    for (std::int64_t begin = first; begin <= last; begin += chunk) {
      std::vector<Arguments> arguments(static_cast<std::size_t>(std::min(chunk, last - begin + 1)));
      parallelFor(arguments.size(), [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i)
          arguments[i] = {ranked(begin + static_cast<std::int64_t>(i)), 0};
      });
      worst.add(worstOf(subject, arguments, twinResults(arguments)));
      checked(arguments.size());
      Session::current().cameFurther();
    }
    return measuredError(worst, static_cast<std::size_t>(last - first + 1), true);
  }

  /// One run of the strict twin without the hygiene that a whole domain would repeat 64 times.
  std::vector<Result> twinResults(const std::vector<Arguments>& arguments) {
    const gnomon::Subject& kernel = Session::current().subject(kernelName);
    const Measure push{.count = static_cast<uint>(arguments.size())};
    const auto bytes =
        runTwinOnce(kernel, {.inputs = {{"arguments", std::as_bytes(std::span(arguments))}},
                             .outputs = {{"results", arguments.size()}},
                             .push = std::as_bytes(std::span(&push, 1)),
                             .extent = {arguments.size()},
                             .limit = Session::current().limit()});
    return elementsOf<Result>(bytes.at("results"));
  }

  MeasuredError measuredError(const Worst& worst, std::size_t arguments, bool exhaustive) const {
    if (worst.outside > 0)
      ADD_FAILURE() << fmt::format("{} breaks its rule for {} of {} arguments, such as {:.9g}",
                                   subject.entry, worst.outside, arguments, worst.outsideAt);
    const double at = worst.error.ulp > 0 ? worst.ulpAt : worst.absoluteAt;
    // A sample may miss the worst: its error is rounded up to the next quarter ULP, or by an
    // eighth.
    const Error error =
        exhaustive ? worst.error
                   : Error{std::ceil(worst.error.ulp * 4) / 4, worst.error.absolute * 1.125};
    return {.worst = error, .worstAt = at, .arguments = arguments, .exhaustive = exhaustive};
  }
};

/// One line of kAssumedExceptions as it is tried: an argument and what must come of it.
struct Exception {
  const char* entry;
  Arguments arguments;
  double lo, hi;
};

constexpr float kNearestPi = 3.14159274f;
constexpr Exception kExceptions[] = {
    {"sqrt", {0.0f, 0}, 0, 0},
    {"sqrt", {-0.0f, 0}, 0, 0},
    {"pow", {0.0f, 2}, 0, 0},
    {"pow", {0.0f, 0.5f}, 0, 0},
    {"divide", {0.0f, 3}, 0, 0},
    {"divide", {kMin, 3}, 0, kMin},
    {"exp", {-100.0f, 0}, 0, kMin},
    {"exp2", {-140.0f, 0}, 0, kMin},
    {"atan", {0.0f, 0}, 0, 0},
    {"acos", {-1.0f, 0}, 3.14, 3.15},
    {"sin", {kNearestPi, 0}, -0x1p-11, 0x1p-11},
    {"cos", {kNearestPi, 0}, -1 - 0x1p-11, -1 + 0x1p-11},
};

/// Where the specification promises nothing, devices are assumed to do the sensible thing.
class AssumedExceptionsHold : public OperationCase {
 public:
  explicit AssumedExceptionsHold(const Subject& s) : OperationCase(s) {}
  void TestBody() override {
    for (const Exception& e : kExceptions) {
      if (std::string_view(e.entry) != subject.entry) continue;
      const Observation seen = dispatch({e.arguments});
      expectClean(seen);
      checked(1);
      for (const auto* bytes : {&seen.plain, &seen.twin}) {
        const float got = elementsOf<Result>(bytes->at("results")).front().value;
        EXPECT_TRUE(got >= e.lo && got <= e.hi)
            << fmt::format("{}({}, {}) is {}, assumed in [{}, {}]", e.entry, e.arguments.x,
                           e.arguments.y, got, e.lo, e.hi);
      }
    }
  }
};

/// "inversesqrt" -> "PrecisionInversesqrt", as the runner derives it from the kernel's name.
std::string suiteName(const Subject& s) {
  std::string name = s.entry;
  name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  return "Precision" + name;
}

template <class Case>
void add(const char* name, const Subject& s) {
  testing::RegisterTest(suiteName(s).c_str(), name, nullptr, nullptr, __FILE__, __LINE__,
                        [&s]() -> KernelCase* { return new Case(s); });
}

const bool registered = [] {
  for (const Subject& s : kSubjects) {
    add<InsideItsRule>("StaysInsideItsRule", s);
    if (std::ranges::any_of(
            kExceptions, [&](const Exception& e) { return std::string_view(e.entry) == s.entry; }))
      add<AssumedExceptionsHold>("AssumedExceptionsHold", s);
    if (s.operation && s.kind != Kind::kInherited)
      add<WorstErrorIsMeasured>("WorstErrorIsMeasured", s);
  }
  return true;
}();

}  // namespace
}  // namespace gnomon::precision
