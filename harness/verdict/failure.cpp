#include "harness/verdict/failure.h"

#include <algorithm>
#include <cctype>
#include <limits>

namespace gnomon {
namespace {

/// Words with a digit, and whatever stands after the first place, differ between inputs.
std::string withoutNumbers(std::string_view finding) {
  finding = finding.substr(0, finding.find(", first "));
  std::string kept, word;
  for (const char c : finding) {
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (c != ' ') {
      word += digit ? '#' : c;
      continue;
    }
    if (word.find('#') == std::string::npos) kept += word + ' ';
    word.clear();
  }
  return kept + (word.find('#') == std::string::npos ? word : "");
}

bool hasFinding(const Observation& seen, const std::string& finding) {
  return std::ranges::any_of(seen.findings,
                             [&](const std::string& f) { return withoutNumbers(f) == finding; });
}

const FieldVerdict* fieldOf(const Verdict& v, const std::string& name) {
  const auto found = std::ranges::find(v.fields, name, &FieldVerdict::name);
  return found == v.fields.end() ? nullptr : &*found;
}

}  // namespace

std::optional<Failure> failureOf(const Verdict& v, const Observation& seen,
                                 const Standard& standard) {
  if (!standard.fails(v)) return std::nullopt;
  if (!seen.findings.empty())
    return Failure{.kind = Failure::Kind::kHygiene,
                   .output = v.output,
                   .finding = withoutNumbers(seen.findings.front())};
  for (const FieldVerdict& f : v.fields)
    if (f.outside > 0)
      return Failure{.kind = Failure::Kind::kOutside, .output = v.output, .field = f.name};
  if (v.rearranged && v.worst)
    return Failure{.kind = Failure::Kind::kRearranged,
                   .output = v.output,
                   .field = v.worst->field.substr(0, v.worst->field.find_first_of(".["))};
  return std::nullopt;
}

bool failsBy(const Failure& failure, const Verdict& v, const Observation& seen,
             const Standard& standard) {
  if (!standard.fails(v)) return false;
  switch (failure.kind) {
    case Failure::Kind::kHygiene:
      return hasFinding(seen, failure.finding);
    case Failure::Kind::kOutside: {
      const FieldVerdict* field = fieldOf(v, failure.field);
      return v.problems.empty() && field != nullptr && field->outside > 0;
    }
    case Failure::Kind::kRearranged:
      return v.rearranged && v.problems.size() == 1;
  }
  return false;
}

Policy forFewElements(const Policy& policy) {
  return policy.with("ambiguousCap", 1)
      .with("widestBound", std::numeric_limits<double>::infinity());
}

}  // namespace gnomon
