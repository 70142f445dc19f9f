#include "harness/verdict/list.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "harness/error.h"

namespace gnomon {
namespace {

constexpr std::size_t kNowhere = ~std::size_t{0};

/// Elements of a buffer, field by field.
class Records {
 public:
  Records(const BufferSpec& s, std::span<const std::byte> b) : spec(&s), bytes(b) {}

  std::size_t count() const { return bytes.size() / spec->element.size; }
  const std::string& name() const { return spec->name; }
  const std::vector<Field>& fields() const { return spec->element.fields; }

  const Field& field(const std::string& called) const {
    const auto found = std::ranges::find(fields(), called, &Field::name);
    if (found == fields().end())
      throw std::logic_error(fmt::format("'{}' has no field '{}'", name(), called));
    return *found;
  }

  std::uint32_t word(std::size_t element, const Field& f, unsigned scalar = 0) const {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + element * spec->element.size + f.offset + 4 * scalar,
                sizeof word);
    return word;
  }

 private:
  const BufferSpec* spec;
  std::span<const std::byte> bytes;
};

std::string inWords(const Field& f, std::uint32_t word) {
  if (word == poisonOf(0)) return "unwritten";
  if (f.scalar == ScalarType::kFloat) return fmt::format("{}", std::bit_cast<float>(word));
  return f.scalar == ScalarType::kInt ? fmt::format("{}", static_cast<std::int32_t>(word))
                                      : fmt::format("{}", word);
}

/// The candidates of a list, and which of them an id names.
class Candidates {
 public:
  Candidates(const KernelRecord& record, const ListSpec& list, std::span<const std::byte> bytes)
      : records(record.buffer(list.source), bytes) {
    if (bytes.size() % record.buffer(list.source).element.size != 0 ||
        record.buffer(list.source).element.size != record.buffer(list.records).element.size)
      throw std::logic_error(fmt::format("'{}' are no records of '{}'", list.source, list.records));
    if (list.numbered) return;
    const Field& id = records.field(list.id);
    for (std::size_t i = 0; i < records.count(); ++i) ids.push_back(records.word(i, id));
    if (std::ranges::adjacent_find(ids, std::greater_equal()) != ids.end())
      throw std::logic_error(fmt::format("'{}' does not increase over '{}'", id.name, list.source));
    named = true;
  }

  std::optional<std::size_t> of(std::uint32_t id) const {
    if (!named) return id < records.count() ? std::optional<std::size_t>(id) : std::nullopt;
    const auto found = std::ranges::lower_bound(ids, id);
    if (found == ids.end() || *found != id) return std::nullopt;
    return static_cast<std::size_t>(found - ids.begin());
  }

  std::size_t count() const { return records.count(); }

  const Records records;

 private:
  bool named = false;
  std::vector<std::uint32_t> ids;
};

/// The list that one module made.
class ListReader {
 public:
  struct Options {
    std::size_t capacity;
    bool padded;
    const char* module;
  };

  ListReader(const KernelRecord& record, const ListSpec& spec, const Candidates& all,
             const std::map<std::string, Bytes>& outputs, Observation& o, const Options& how)
      : list(spec),
        candidates(all),
        records(record.buffer(spec.records), outputs.at(spec.records)),
        tally(record.buffer(spec.tally), outputs.at(spec.tally)),
        seen(o),
        options(how),
        places(all.count(), kNowhere) {
    if (records.count() < options.capacity || tally.count() != 1)
      throw std::logic_error(fmt::format("'{}' has {} records and '{}' {}, for a list of {}",
                                         list.records, records.count(), list.tally, tally.count(),
                                         options.capacity));
    if (!given(records, list.id))
      throw UsageError(fmt::format(
          "the kernel does not give {}.{}, without which nothing tells which of '{}' are listed: "
          "name it in 'fields'",
          list.records, list.id, list.source));
  }

  void read() {
    length = lengthOfList();
    checkTally();
    for (std::size_t i = 0; i < length; ++i) checkRecord(i);
    checkTail();
  }

  /// One uint a candidate.
  Bytes set() const {
    std::vector<std::uint32_t> listed(candidates.count());
    for (std::size_t c = 0; c < listed.size(); ++c) listed[c] = places[c] == kNowhere ? 0 : 1;
    const auto bytes = std::as_bytes(std::span(listed));
    return {bytes.begin(), bytes.end()};
  }

  std::size_t decided() const {
    const auto total = told(list.total), flag = told(list.overflowed);
    const bool overflowed = total ? *total > options.capacity : !flag || *flag != 0;
    if (length < options.capacity || !overflowed) return candidates.count();
    const auto last = std::ranges::find_if(places.rbegin(), places.rend(),
                                           [](std::size_t place) { return place != kNowhere; });
    return static_cast<std::size_t>(places.rend() - last);
  }

 private:
  /// Each is said once, of the first place.
  enum class Rule { kLength, kTotal, kFlag, kNoCandidate, kTwice, kOrder, kEqual, kTail };

  template <class... Values>
  void broken(Rule rule, fmt::format_string<Values...> text, Values&&... values) {
    if (!said.insert(rule).second) return;
    seen.findings.push_back(fmt::format("the {}'s list '{}': ", options.module, list.name) +
                            fmt::format(text, std::forward<Values>(values)...));
  }

  bool given(const Records& buffer, const std::string& field) const {
    return !field.empty() && !seen.unmapped.contains(buffer.name() + "." + field);
  }

  std::optional<std::uint32_t> told(const std::string& field) const {
    if (!given(tally, field)) return std::nullopt;
    return tally.word(0, tally.field(field));
  }

  std::size_t lengthOfList() {
    const auto says = told(list.length);
    if (!says) return leadingRecords();
    const std::size_t most = options.capacity;
    if (*says > most)
      broken(Rule::kLength, "{}.{} is {}, but {} fit", list.tally, list.length,
             inWords(tally.field(list.length), *says), most);
    return std::min<std::size_t>(*says, most);
  }

  /// As many as were written, where nothing says how many there are.
  std::size_t leadingRecords() const {
    const Field& id = records.field(list.id);
    const bool filled = options.padded && given(records, list.padding);
    std::size_t n = 0;
    while (n < options.capacity && records.word(n, id) != poisonOf(0) &&
           !(filled && records.word(n, records.field(list.padding)) == 0))
      ++n;
    return n;
  }

  void checkTally() {
    const auto total = told(list.total), flag = told(list.overflowed);
    const std::size_t most = options.capacity;
    if (total && length != std::min<std::size_t>(*total, most))
      broken(Rule::kTotal, "{}.{} says {}, the list has {} and {} fit", list.tally, list.total,
             inWords(tally.field(list.total), *total), length, most);
    if (!flag) return;
    const std::string name = list.tally + "." + list.overflowed;
    if (*flag > 1)
      broken(Rule::kFlag, "{} is {}, neither 0 nor 1", name,
             inWords(tally.field(list.overflowed), *flag));
    else if (total && (*flag == 1) != (*total > most))
      broken(Rule::kFlag, "{} is {} though {} were found and {} fit", name, *flag, *total, most);
    else if (!total && *flag == 1 && length < most)
      broken(Rule::kFlag, "{} is 1 though the list has {} and {} fit", name, length, most);
  }

  void checkRecord(std::size_t i) {
    const std::uint32_t id = records.word(i, records.field(list.id));
    const auto candidate = candidates.of(id);
    if (!candidate)
      return broken(Rule::kNoCandidate, "{}[{}].{} is {}, which names none of the {} candidates",
                    list.records, i, list.id, inWords(records.field(list.id), id),
                    candidates.count());
    std::size_t& place = places[*candidate];
    if (place != kNowhere)
      return broken(Rule::kTwice, "{}[{}] names candidate {}, as {}[{}] does", list.records, i,
                    *candidate, list.records, place);
    place = i;
    if (previous && *candidate < *previous)
      broken(Rule::kOrder, "{}[{}] names candidate {} after candidate {}: not in input order",
             list.records, i, *candidate, *previous);
    previous = candidate;
    compareFields(i, *candidate);
  }

  void compareFields(std::size_t i, std::size_t candidate) {
    for (const Field& f : records.fields()) {
      if (f.name == list.id || !given(records, f.name)) continue;
      for (unsigned s = 0; s < f.scalars; ++s) {
        const std::uint32_t got = records.word(i, f, s);
        const std::uint32_t wanted = candidates.records.word(candidate, f, s);
        if (got != wanted)
          broken(Rule::kEqual, "{}[{}].{} is {}, that of candidate {} is {}", list.records, i,
                 f.scalarName(s), inWords(f, got), candidate, inWords(f, wanted));
      }
    }
  }

  void checkTail() {
    for (std::size_t i = length; i < records.count(); ++i)
      if (options.padded && i < options.capacity)
        checkPadding(i);
      else if (written(i))
        return broken(Rule::kTail, "the tail was written, first at {}[{}] behind {} records",
                      list.records, i, length);
  }

  void checkPadding(std::size_t i) {
    if (!given(records, list.padding)) return;
    const Field& f = records.field(list.padding);
    if (const std::uint32_t word = records.word(i, f); word != 0)
      broken(Rule::kTail, "{}[{}].{} is {}, not 0, behind {} records", list.records, i,
             list.padding, inWords(f, word), length);
  }

  bool written(std::size_t i) const {
    return std::ranges::any_of(records.fields(), [&](const Field& f) {
      if (!given(records, f.name)) return false;
      for (unsigned s = 0; s < f.scalars; ++s)
        if (records.word(i, f, s) != poisonOf(0)) return true;
      return false;
    });
  }

  const ListSpec& list;
  const Candidates& candidates;
  const Records records, tally;
  Observation& seen;
  const Options options;
  std::size_t length = 0;
  std::vector<std::size_t> places;  ///< by candidate, in the list
  std::optional<std::size_t> previous;
  std::set<Rule> said;
};

}  // namespace

std::size_t decodeList(const KernelRecord& record, const ListSpec& list,
                       std::span<const std::byte> bytes, std::size_t capacity, Observation& seen,
                       bool padded) {
  const Candidates candidates(record, list, bytes);
  std::size_t decided = candidates.count();
  if (!seen.applies) return decided;
  for (const auto& [outputs, module] :
       {std::pair{&seen.plain, "kernel"}, std::pair{&seen.twin, "strict twin"}}) {
    ListReader reader(record, list, candidates, *outputs, seen, {capacity, padded, module});
    reader.read();
    (*outputs)[list.name] = reader.set();
    decided = std::min(decided, reader.decided());
  }
  return decided;
}

}  // namespace gnomon
