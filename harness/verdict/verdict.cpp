#include "harness/verdict/verdict.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <ostream>
#include <random>

#include <fmt/format.h>

#include "harness/hygiene/levels.h"
#include "harness/verdict/parallel.h"

namespace gnomon {
namespace {

/// One 32-bit scalar of an output element.
struct Scalar {
  std::string name;  // "F.y"
  std::size_t field;
  unsigned offset;
  ScalarType type;
  bool signOfZero;
  bool given = true;  // false: a foreign kernel does not give it, and reads as 0
};

std::vector<Scalar> scalarsOf(const Struct& layout) {
  std::vector<Scalar> all;
  for (std::size_t f = 0; f < layout.fields.size(); ++f) {
    const Field& field = layout.fields[f];
    for (unsigned c = 0; c < field.scalars; ++c) {
      all.push_back({field.scalarName(c), f, field.offset + 4 * c, field.scalar, field.signOfZero});
    }
  }
  return all;
}

/// Reads scalars of any type as double, which holds float and 32-bit integers exactly.
class Results {
 public:
  Results(std::span<const std::byte> data, unsigned elementBytes)
      : bytes(data), stride(elementBytes) {}

  double operator()(std::size_t element, const Scalar& s) const {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + element * stride + s.offset, sizeof word);
    if (s.type == ScalarType::kUint) return word;
    if (s.type == ScalarType::kInt) return static_cast<std::int32_t>(word);
    return static_cast<double>(std::bit_cast<float>(word));
  }

 private:
  std::span<const std::byte> bytes;
  unsigned stride;
};

/// Ties go to the earlier element, so that the message does not depend on threads.
void keepWorse(std::optional<Offender>& worst, Offender candidate) {
  if (!worst || candidate.budget > worst->budget ||
      (candidate.budget == worst->budget && candidate.element < worst->element))
    worst = std::move(candidate);
}

/// The model's value where the interval holds it, else the end next to it.
double centre(const Bounded& b) { return std::clamp(b.value, b.lo, b.hi); }

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

/// Everything the judging of one output shares.
class Judge {
 public:
  Judge(const Struct& structure, const Observation& seen, const Expectation& e, const Bounds& b,
        const Policy& p, std::uint64_t s)
      : expected(e),
        bounds(b),
        policy(p),
        seed(s),
        scalars(scalarsOf(structure)),
        twin(seen.twin.at(e.output), structure.size),
        plain(seen.plain.at(e.output), structure.size) {
    result.output = e.output;
    result.storage = e.storage;
    result.elements = e.elements;
    result.problems = seen.findings;
    result.fields.resize(structure.fields.size());
    for (std::size_t f = 0; f < structure.fields.size(); ++f)
      result.fields[f].name = structure.fields[f].name;
    for (Scalar& one : scalars)
      one.given = !seen.unmapped.contains(e.output + "." + structure.fields[one.field].name);
    widths.resize(scalars.size());
  }

  Verdict run() {
    const std::vector<std::size_t> sample = sampled();
    judgeAll(sample, /*measureWidths=*/true);
    takeMedians();
    if (sample.size() < expected.elements) {
      std::vector<std::size_t> rest = notCleared(sample);
      result.truncated = offenders.size() * 100 > sample.size() && smallestWidening() == 0 &&
                         rest.size() > sample.size();
      if (result.truncated) rest.resize(sample.size());
      judgeAll(rest, false);
    }
    decide();
    return std::move(result);
  }

 private:
  /// What one element's scalars may be, by each of the rules.
  struct Intervals {
    explicit Intervals(std::size_t n) : spec(n), plain(n), device(n) {}
    std::vector<Bounded> spec, plain, device;
  };

  struct Widths {
    std::vector<double> spec, device, halfDevice;
  };

  const Rules& deciding() const { return bounds.device ? *bounds.device : bounds.spec; }

  /// Corners, both ends and one element of each of equal strides; all of a small case.
  std::vector<std::size_t> sampled() const {
    const std::size_t n = expected.elements;
    const auto wanted = static_cast<std::size_t>(policy["boundedElements"]);
    std::vector<std::size_t> chosen;
    if (n <= wanted + expected.corners) {
      for (std::size_t i = 0; i < n; ++i) chosen.push_back(i);
      return chosen;
    }
    for (std::size_t i = 0; i < expected.corners; ++i) chosen.push_back(i);
    std::mt19937_64 random(seed);
    const std::size_t rest = n - expected.corners;
    for (std::size_t k = 0; k < wanted; ++k) {
      const std::size_t begin = k * rest / wanted, end = (k + 1) * rest / wanted;
      chosen.push_back(expected.corners + begin + random() % (end - begin));
    }
    chosen.back() = n - 1;
    return chosen;
  }

  /// Elements that the plain model does not clear under the narrowest intervals of the sample.
  std::vector<std::size_t> notCleared(const std::vector<std::size_t>& sample) {
    std::vector<double> slack;
    for (Widths& w : widths) slack.push_back(quantile(w.halfDevice, policy["screeningQuantile"]));
    std::vector<char> judged(expected.elements, 0);
    for (std::size_t i : sample) judged[i] = 1;
    std::vector<std::size_t> rest;
    parallelFor(expected.elements, [&](std::size_t begin, std::size_t end) {
      std::vector<double> values(scalars.size());
      std::vector<std::size_t> mine;
      for (std::size_t i = begin; i < end; ++i) {
        if (judged[i]) continue;
        expected.plain(i, values);
        for (std::size_t s = 0; s < scalars.size(); ++s)
          if (!scalars[s].given) values[s] = 0;
        if (!clears(i, values, slack)) mine.push_back(i);
      }
      const std::lock_guard lock(mutex);
      rest.insert(rest.end(), mine.begin(), mine.end());
    });
    std::ranges::sort(rest);
    return rest;
  }

  bool clears(std::size_t i, const std::vector<double>& values,
              const std::vector<double>& slack) const {
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      const bool exact =
          scalars[s].type != ScalarType::kFloat || (scalars[s].signOfZero && values[s] == 0);
      if (exact && slack[s] > 0) return false;
      const double x = values[s], room = slack[s] * std::abs(x);
      if (!isNear(twin(i, scalars[s]), x, room) || !isNear(plain(i, scalars[s]), x, room))
        return false;
    }
    return true;
  }

  /// Within `room` of x; in a narrow format, what every number within `room` may be stored as.
  /// Written so that a NaN on either side is not near.
  bool isNear(double got, double x, double room) const {
    if (expected.storage == Storage::float32) return std::abs(got - x) <= room;
    const Bounded low = stored(Bounded::between(x - room, x - room), expected.storage);
    const Bounded high = stored(Bounded::between(x + room, x + room), expected.storage);
    return high.lo <= got && got <= low.hi;
  }

  void judgeAll(const std::vector<std::size_t>& elements, bool measureWidths) {
    result.bounded += elements.size();
    parallelFor(elements.size(), [&](std::size_t begin, std::size_t end) {
      Intervals allowed(scalars.size());
      for (std::size_t k = begin; k < end; ++k) {
        evaluate(deciding(), elements[k], allowed.device);
        if (!measureWidths) store(allowed.device);
        if (!measureWidths && admitsBoth(elements[k], allowed.device)) {
          const std::lock_guard lock(mutex);
          noteBudgets(elements[k], allowed.device);
          continue;
        }
        evaluate(bounds.spec, elements[k], allowed.spec);
        evaluate(bounds.plain, elements[k], allowed.plain);
        const std::lock_guard lock(mutex);
        if (measureWidths) measure(allowed);  // of the arithmetic, before a format rounds it
        store(allowed.spec);
        store(allowed.plain);
        if (measureWidths) store(allowed.device);
        account(elements[k], allowed);
      }
    });
  }

  /// Inside the narrowest of the bounds, nothing is left to say about an element.
  bool admitsBoth(std::size_t i, const std::vector<Bounded>& allowed) const {
    for (std::size_t s = 0; s < scalars.size(); ++s)
      if ((allowed[s].flags & (kAmbiguous | kUnspecified | kNotJudged)) != 0 ||
          budgetUsed(twin(i, scalars[s]), allowed[s], scalars[s].signOfZero) > 1 ||
          budgetUsed(plain(i, scalars[s]), allowed[s], false) > 1)
        return false;
    return true;
  }

  void noteBudgets(std::size_t i, const std::vector<Bounded>& allowed) {
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      double& worst = result.fields[scalars[s].field].budget;
      worst = std::max(worst, budgetUsed(twin(i, scalars[s]), allowed[s], scalars[s].signOfZero));
    }
  }

  void evaluate(const Rules& rules, std::size_t i, std::vector<Bounded>& out) const {
    const UseRules scope(rules);
    expected.bounded(i, out);
    for (std::size_t s = 0; s < scalars.size(); ++s)
      if (!scalars[s].given) out[s] = Bounded(0.0f);
  }

  void store(std::vector<Bounded>& all) const {
    if (expected.storage == Storage::float32) return;
    for (Bounded& x : all) x = stored(x, expected.storage);
  }

  void account(std::size_t i, const Intervals& allowed) {
    const auto& [spec, forPlain, device] = allowed;
    bool outSpec = false, outDevice = false, moved = false, ambiguous = false;
    std::vector<char> fieldOut(result.fields.size(), 0);
    std::optional<Offender> plainHere;
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      const double got = twin(i, scalars[s]), gotPlain = plain(i, scalars[s]);
      const double bySpec = budgetUsed(got, spec[s], scalars[s].signOfZero);
      const double byDevice = budgetUsed(got, device[s], scalars[s].signOfZero);
      const double byPlain = budgetUsed(gotPlain, forPlain[s], false);
      outSpec |= !(bySpec <= 1);
      outDevice |= !(byDevice <= 1);
      moved |= !(byPlain <= 1);
      ambiguous |= spec[s].ambiguous() || spec[s].notJudged();
      noteUnspecified(i, s, spec[s]);
      FieldVerdict& field = result.fields[scalars[s].field];
      fieldOut[scalars[s].field] |= !(byDevice <= 1);
      field.specBudget = std::max(field.specBudget, bySpec);
      field.budget = std::max(field.budget, byDevice);
      keepWorse(field.worst, {i, scalars[s].name, got, gotPlain, device[s].value, device[s].lo,
                              device[s].hi, byDevice});
      keepWorse(plainHere, {i, scalars[s].name, got, gotPlain, forPlain[s].value, forPlain[s].lo,
                            forPlain[s].hi, byPlain});
      result.plainBudget = std::max(result.plainBudget, byPlain);
    }
    if (plainHere) keepWorse(worstPlain, *plainHere);
    const bool plainFar = plainHere && plainHere->budget > policy["plainBudget"];
    for (std::size_t f = 0; f < fieldOut.size(); ++f)
      result.fields[f].outside += fieldOut[f] ? 1 : 0;
    result.outside += outSpec;
    result.outsideDevice += outDevice;
    result.reassociated += moved;
    result.ambiguous += ambiguous;
    // Of another arrangement the widened bound is asked for both, wherever either is not inside.
    if (outSpec || plainFar) offenders.push_back(i);
  }

  void noteUnspecified(std::size_t i, std::size_t s, const Bounded& b) {
    if (!b.unspecified() || unspecifiedSeen) return;
    unspecifiedSeen = true;
    result.problems.push_back(fmt::format(
        "the model of {}.{} reaches '{}' outside the domain in which Vulkan "
        "specifies it, so nothing can be judged there: the test asks too much, or the "
        "kernel's contract must avoid it",
        expected.place(i), scalars[s].name, nameOf(unspecifiedOperations(b.flags).front())));
  }

  void measure(const Intervals& allowed) {
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      const Bounded& spec = allowed.spec[s];
      const Bounded& device = allowed.device[s];
      const double x = std::abs(centre(device));
      if (!(x > 0) || !std::isfinite(spec.hi - spec.lo)) continue;
      widths[s].spec.push_back((spec.hi - spec.lo) / x);
      if (bounds.device) widths[s].device.push_back((device.hi - device.lo) / x);
      const double half = std::min(device.hi - device.value, device.value - device.lo) / x;
      // A single admissible float rarely equals the double, so it has no room on one side.
      if (half > 0) widths[s].halfDevice.push_back(half);
    }
  }

  /// A field's width is that of its widest scalar.
  void takeMedians() {
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      FieldVerdict& field = result.fields[scalars[s].field];
      field.specWidth = std::max(field.specWidth, quantile(widths[s].spec, 0.5));
      field.deviceWidth = std::max(field.deviceWidth, quantile(widths[s].device, 0.5));
    }
  }

  void decide() {
    const double ambiguousShare = static_cast<double>(result.ambiguous) /
                                  static_cast<double>(std::max<std::size_t>(1, result.bounded));
    if (ambiguousShare > policy["ambiguousCap"])
      result.problems.push_back(
          fmt::format("{:.1f} % of the elements judged by intervals are ambiguous, more than the "
                      "{:.0f} % at which a verdict still means something",
                      100 * ambiguousShare, 100 * policy["ambiguousCap"]));
    std::ranges::sort(offenders);
    for (const FieldVerdict& f : result.fields)
      if (f.worst) keepWorse(result.worst, *f.worst);
    if (result.outside > 0) {
      // What was left alone cannot be excused.
      result.widening = result.truncated ? 0 : smallestWidening();
      result.verdict = result.widening > 0 ? Class::kEquivalent : Class::kWrong;
    }
    if (result.outside == 0) requirePlainNearby();
    requireNarrowBounds();
    if (!result.problems.empty()) result.verdict = Class::kWrong;
  }

  void requirePlainNearby() {
    if (result.plainBudget > policy["plainBudget"]) {
      result.worst = worstPlain;
      result.rearranged = true;
      result.problems.push_back(fmt::format(
          "the strict twin is inside, but the module as it is uses {:.3g} budgets where "
          "at most {:.0f} can be rearrangement",
          result.plainBudget, policy["plainBudget"]));
    }
  }

  /// A bound into which a visible error fits is a defect of the kernel or of the test.
  void requireNarrowBounds() {
    if (expected.judgesRules) return;
    for (const FieldVerdict& f : result.fields) {
      const double width = bounds.device ? f.deviceWidth : f.specWidth;
      if (width > policy["widestBound"])
        result.problems.push_back(fmt::format(
            "half of the intervals of '{}' are wider than {:.2g} of their value, so the case "
            "proves nothing: is the kernel ill-conditioned there, or the stimulus?",
            f.name, width));
    }
  }

  /// The smallest k for which all offenders lie inside when every input and named intermediate is
  /// widened by k ULP; 0 if none does.
  int smallestWidening() const {
    for (int k = 1; k <= static_cast<int>(policy["maxWidening"]); ++k) {
      Rules rules = bounds.spec;
      rules.widenUlp = k;
      const UseRules scope(rules);
      std::size_t ambiguous = 0;
      const bool all =
          std::ranges::all_of(offenders, [&](std::size_t i) { return inside(i, ambiguous); });
      // Widening must not excuse at large what it only made undecided.
      const auto cap = policy["ambiguousCap"] * static_cast<double>(result.bounded);
      if (all && static_cast<double>(ambiguous) <= cap) return k;
    }
    return 0;
  }

  // Offenders are checked in the order of their index, so the first that fails ends it.
  bool inside(std::size_t i, std::size_t& ambiguous) const {
    std::vector<Bounded> allowed(scalars.size());
    evaluate(rules(), i, allowed);
    ambiguous += std::ranges::any_of(allowed, &Bounded::ambiguous);
    store(allowed);
    for (std::size_t s = 0; s < scalars.size(); ++s) {
      const double got = twin(i, scalars[s]);
      // Widening turns an exact zero into an interval; its sign stays the contract's.
      const bool wrongZero = scalars[s].signOfZero && got == 0 && allowed[s].value == 0 &&
                             std::signbit(got) != std::signbit(allowed[s].value);
      if (wrongZero || !(budgetUsed(got, allowed[s], false) <= 1) ||
          !(budgetUsed(plain(i, scalars[s]), allowed[s], false) <= policy["plainBudget"]))
        return false;
    }
    return true;
  }

  const Expectation& expected;
  const Bounds& bounds;
  const Policy& policy;
  std::uint64_t seed;
  std::vector<Scalar> scalars;
  Results twin, plain;
  std::vector<Widths> widths;
  std::vector<std::size_t> offenders;
  std::optional<Offender> worstPlain;
  bool unspecifiedSeen = false;
  std::mutex mutex;
  Verdict result;
};

std::string number(double x) { return fmt::format("{:.9g}", x); }

std::string fieldTable(const Verdict& v) {
  std::string table = fmt::format("  {:<12} {:>10}  {:>12}\n", "field", "outside", "worst budget");
  for (const FieldVerdict& f : v.fields)
    table += fmt::format("  {:<12} {:>10}  {:>12.3g}\n", f.name, f.outside, f.budget);
  return table;
}

std::string worstElement(const Offender& o, const Expectation& expected) {
  return fmt::format("worst: {}.{}\n", expected.place(o.element), o.field) + explainNumbers(o) +
         "  for the input\n" + expected.inputs(o.element);
}

/// Fields stand in the contract in the order in which they are computed.
const FieldVerdict* firstOutside(const Verdict& v) {
  const auto found = std::ranges::find_if(v.fields, [](const auto& f) { return f.outside > 0; });
  return found == v.fields.end() ? nullptr : &*found;
}

}  // namespace

std::string Expectation::place(std::size_t element) const {
  if (width == 0) return fmt::format("{}[{}]", output, element);
  if (mips > 1) return placeOn(output, pixelAt({width, height, mips}, element));
  return fmt::format("{}({}, {})", output, element % width, element / width);
}

std::string_view nameOf(Class c) {
  return c == Class::kConforms ? "conforms" : c == Class::kEquivalent ? "equivalent" : "wrong";
}

void PrintTo(Class c, std::ostream* out) { *out << nameOf(c); }

Bounds Bounds::specification(bool roundingRte) {
  const Rules either = Rules::specification();
  return {.spec = roundingRte ? Rules::specification(Rounding::nearestEven) : either,
          .plain = either,
          .device = {}};
}

double Verdict::maxBudget() const {
  double worstBudget = 0;
  for (const FieldVerdict& f : fields) worstBudget = std::max(worstBudget, f.budget);
  return worstBudget;
}

double budgetUsed(double got, const Bounded& allowed, bool signOfZero) {
  if (std::isnan(got)) return allowed.mayBeNan() ? 0 : kInfinity;
  if (allowed.unspecified()) return 0;
  const bool exactZero = allowed.lo == 0 && allowed.hi == 0 && allowed.value == 0;
  if (signOfZero && exactZero && std::signbit(got) != std::signbit(allowed.value)) return kInfinity;
  const double x = centre(allowed);
  if (got == x) return 0;
  const bool inside = allowed.lo <= got && got <= allowed.hi;
  const double room = got > x ? allowed.hi - x : x - allowed.lo;
  // Without a finite centre, or with an end at infinity, there is no share to speak of.
  if (!std::isfinite(x) || !std::isfinite(room) || std::isnan(allowed.value))
    return inside ? 0 : kInfinity;
  return room > 0 ? std::abs(got - x) / room : kInfinity;
}

Verdict judge(const Struct& layout, const Observation& seen, const Expectation& expected,
              const Bounds& bounds, const Policy& policy, std::uint64_t seed) {
  return Judge(layout, seen, expected, bounds, policy, seed).run();
}

std::string explain(const Verdict& v, const Expectation& expected, const std::string& divergence) {
  if (v.ok() && v.outsideDevice == 0) return {};
  const Offender* worst = worstOf(v);
  return explainFields(v, divergence) + (worst != nullptr ? worstElement(*worst, expected) : "");
}

std::string explainFields(const Verdict& v, const std::string& divergence) {
  std::string text;
  for (const std::string& p : v.problems) text += "- " + p + "\n";
  const std::size_t out = std::max(v.outside, v.outsideDevice);
  const FieldVerdict* first = firstOutside(v);
  if (first != nullptr) {
    text +=
        fmt::format("{} of {} elements of '{}' are outside what {} may return\n", out,
                    out < v.bounded / 100 ? v.elements : v.bounded, v.output,
                    v.outside > 0 ? "a conforming device" : "this device, by its measured errors,");
    text += fieldTable(v);
    text += fmt::format("The first field that is wrong, in the order of the contract, is {}.\n",
                        first->name);
    text += divergence;
  }
  return text;
}

std::string explainNumbers(const Offender& o) {
  std::string text = fmt::format("  got       {} (strict twin), {} (module as it is)\n",
                                 number(o.got), number(o.gotPlain));
  text += fmt::format("  allowed   [{}, {}]\n", number(o.lo), number(o.hi));
  text += fmt::format("  model     {}", number(o.value));
  if (o.value != 0)
    text += fmt::format(", so it is off by {:.3g} %", 100 * std::abs(o.got / o.value - 1));
  return text + "\n";
}

const Offender* worstOf(const Verdict& v) {
  const FieldVerdict* first = firstOutside(v);
  const std::optional<Offender>& worst = first != nullptr ? first->worst : v.worst;
  return worst && worst->budget > 1 ? &*worst : nullptr;
}

}  // namespace gnomon
