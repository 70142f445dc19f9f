// Lists as sets: every rule of a list is broken once and the message read, first on observations
// made by hand, then by a kernel on the device that makes a list of what it finds.
//
// Covered: numbered lists and lists of records that name themselves, overflow and who is decided
// then, padding, what a foreign kernel does not give, a verdict on the set, scratch left behind.
// Not covered: several lists of one kernel.
#include "harness/verdict/list.h"

#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cases/kernel_case.h"
#include "harness/error.h"
#include "tests/harness/glsl.h"

namespace gnomon {
namespace {

struct Draw {
  uint indexCount, instanceCount;
  float size;
  uint object;
};
struct Stats {
  uint found, listed, overflowed;
};
struct Push {
  uint count, capacity;
};
struct Word {
  uint value;
};

Struct draw() {
  return describe<Draw>("Draw", field("indexCount", &Draw::indexCount),
                        field("instanceCount", &Draw::instanceCount), field("size", &Draw::size),
                        field("object", &Draw::object));
}

KernelRecord record(bool numbered = false) {
  return {.stage = "test",
          .entry = "list",
          .buffers = {{"candidates", 0, Access::kRead, draw()},
                      {"draws", 1, Access::kWrite, draw()},
                      {"stats", 2, Access::kWrite,
                       describe<Stats>("Stats", field("found", &Stats::found),
                                       field("listed", &Stats::listed),
                                       field("overflowed", &Stats::overflowed))},
                      {"scratch", 3, Access::kScratch,
                       describe<Word>("Word", field("value", &Word::value))}},
          .lists = {{.name = "visible",
                     .records = "draws",
                     .id = "object",
                     .source = "candidates",
                     .numbered = numbered,
                     .tally = "stats",
                     .total = "found",
                     .length = "listed",
                     .overflowed = "overflowed",
                     .padding = "instanceCount"}},
          .push = describe<Push>("Push", field("count", &Push::count),
                                 field("capacity", &Push::capacity)),
          .features = {"scalarBlockLayout"}};
}

constexpr uint kCandidates = 24;
constexpr std::size_t kCapacity = 8;

/// Objects 100, 102, 104 ...
std::vector<Draw> candidates(uint n = kCandidates) {
  std::vector<Draw> all;
  for (uint i = 0; i < n; ++i)
    all.push_back({3 * i + 3, 1, 0.5f * static_cast<float>(i), 100 + 2 * i});
  return all;
}

template <class T>
Bytes bytesOf(const std::vector<T>& elements) {
  const auto bytes = std::as_bytes(std::span(elements));
  return {bytes.begin(), bytes.end()};
}

constexpr Draw kUntouched{0xffffdeadu, 0xffffdeadu, 0, 0xffffdeadu};

/// What was observed of one module.
struct Made {
  std::vector<Draw> draws;
  Stats stats;
};

/// A right list of the candidates 2, 3, 5, 7 and 11, of which eight fit.
Made rightList() {
  Made made;
  for (const std::size_t c : {2u, 3u, 5u, 7u, 11u}) made.draws.push_back(candidates()[c]);
  made.stats = {5, 5, 0};
  return made;
}

/// A full one that overflowed: every second candidate but the first.
Made fullList() {
  Made made;
  for (std::size_t c = 2; made.draws.size() < kCapacity; c += 2)
    made.draws.push_back(candidates()[c]);
  made.stats = {11, kCapacity, 1};
  return made;
}

Observation observationOf(Made made) {
  Draw untouched = kUntouched;
  const std::uint32_t poison = poisonOf(0);
  std::memcpy(&untouched.size, &poison, sizeof poison);
  made.draws.resize(std::max(made.draws.size(), kCapacity), untouched);
  Observation seen;
  for (auto* outputs : {&seen.plain, &seen.twin}) {
    (*outputs)["draws"] = bytesOf(made.draws);
    (*outputs)["stats"] = bytesOf(std::vector{made.stats});
  }
  return seen;
}

using Lines = std::vector<std::string>;

std::size_t decoded(Observation& seen, bool numbered = false, bool padded = false,
                    std::size_t capacity = kCapacity) {
  const KernelRecord r = record(numbered);
  std::vector<Draw> all = candidates();
  if (numbered)
    for (Draw& d : all) d.object = 7;  // says nothing
  return decodeList(r, r.list("visible"), std::as_bytes(std::span(all)), capacity, seen, padded);
}

std::vector<uint> listed(const Observation& seen) {
  const std::vector<uint> flags = elementsOf<uint>(seen.twin.at("visible"));
  EXPECT_EQ(elementsOf<uint>(seen.plain.at("visible")), flags);
  std::vector<uint> found;
  for (uint c = 0; c < flags.size(); ++c) {
    EXPECT_LE(flags[c], 1u);
    if (flags[c] == 1) found.push_back(c);
  }
  return found;
}

/// The findings of the kernel; those of its strict twin have to be the same.
Lines findings(const Observation& seen) {
  Lines lines;
  for (std::size_t i = 0; i < seen.findings.size(); ++i) {
    const bool plain = i < seen.findings.size() / 2;
    const std::string intro =
        fmt::format("the {}'s list 'visible': ", plain ? "kernel" : "strict twin");
    EXPECT_TRUE(seen.findings[i].starts_with(intro)) << seen.findings[i];
    const std::string rest =
        seen.findings[i].substr(std::min(intro.size(), seen.findings[i].size()));
    if (plain)
      lines.push_back(rest);
    else
      EXPECT_EQ(rest, lines.at(i - seen.findings.size() / 2));
  }
  return lines;
}

Lines complaints(const Made& made, bool numbered = false, bool padded = false,
                 std::size_t capacity = kCapacity) {
  Observation seen = observationOf(made);
  decoded(seen, numbered, padded, capacity);
  return findings(seen);
}

// ---- right lists ----------------------------------------------------------------------------

TEST(List, ARightListIsTheSetOfItsCandidates) {
  Observation seen = observationOf(rightList());
  EXPECT_EQ(decoded(seen), kCandidates);
  EXPECT_EQ(seen.findings, Lines{});
  EXPECT_EQ(listed(seen), (std::vector<uint>{2, 3, 5, 7, 11}));
}

TEST(List, AnEmptyListIsTheEmptySet) {
  Observation seen = observationOf({});
  EXPECT_EQ(decoded(seen), kCandidates);
  EXPECT_EQ(seen.findings, Lines{});
  EXPECT_EQ(listed(seen), std::vector<uint>{});
}

TEST(List, ANumberedListNamesItsCandidatesByIndex) {
  Made made = rightList();
  for (std::size_t i = 0; i < made.draws.size(); ++i)
    made.draws[i].object = uint{i < 4 ? uint(i) : 23};
  for (Draw& d : made.draws) {
    const uint c = d.object;
    d = candidates()[c];
    d.object = c;
  }
  Observation seen = observationOf(made);
  EXPECT_EQ(decoded(seen, true), kCandidates);
  EXPECT_EQ(seen.findings, Lines{});
  EXPECT_EQ(listed(seen), (std::vector<uint>{0, 1, 2, 3, 23}));
}

TEST(List, AFullListThatOverflowedSaysNothingBehindItsLastRecord) {
  Observation seen = observationOf(fullList());
  EXPECT_EQ(decoded(seen), 17u);  // 2, 4 ... 16
  EXPECT_EQ(seen.findings, Lines{});
  Made exact = fullList();
  exact.stats = {kCapacity, kCapacity, 0};
  seen = observationOf(exact);
  EXPECT_EQ(decoded(seen), kCandidates);
  EXPECT_EQ(seen.findings, Lines{});
}

TEST(List, WithoutCapacityNothingIsDecided) {
  Observation seen = observationOf({.draws = {}, .stats = {11, 0, 1}});
  EXPECT_EQ(decoded(seen, false, false, 0), 0u);
  EXPECT_EQ(seen.findings, Lines{});
}

TEST(List, APaddedListIsFilledUpWithWhatDrawsNothing) {
  Made made = rightList();
  while (made.draws.size() < kCapacity) made.draws.push_back({9, 0, 9, 9});
  EXPECT_EQ(complaints(made, false, true), Lines{});
  made.draws.push_back(candidates()[0]);  // behind the capacity nothing is to be written
  EXPECT_EQ(complaints(made, false, true),
            Lines{"the tail was written, first at draws[8] behind 5 records"});
}

// ---- every rule broken ----------------------------------------------------------------------

TEST(List, AnIdThatIsNoCandidatesIsNamed) {
  Made made = rightList();
  made.draws[3].object = 115;
  made.draws[4].object = 300;
  EXPECT_EQ(complaints(made),
            Lines{"draws[3].object is 115, which names none of the 24 candidates"});
  made.draws[3].object = 0xffffdeadu;
  EXPECT_EQ(complaints(made),
            Lines{"draws[3].object is unwritten, which names none of the 24 candidates"});
}

TEST(List, ANumberPastTheLastCandidateIsNamed) {
  Made made{.draws = {candidates()[23]}, .stats = {1, 1, 0}};
  made.draws[0].object = 24;
  EXPECT_EQ(complaints(made, true),
            Lines{"draws[0].object is 24, which names none of the 24 candidates"});
}

TEST(List, ACandidateThatIsListedTwiceIsNamed) {
  Made made = rightList();
  made.draws[4] = made.draws[3] = made.draws[1];
  EXPECT_EQ(complaints(made), (Lines{"draws[3] names candidate 3, as draws[1] does"}));
}

TEST(List, RecordsOutOfOrderAreNamed) {
  Made made = rightList();
  std::swap(made.draws[1], made.draws[3]);
  EXPECT_EQ(complaints(made),
            Lines{"draws[2] names candidate 5 after candidate 7: not in input order"});
}

TEST(List, ARecordThatIsNotItsCandidatesIsNamedWithBothValues) {
  Made made = rightList();
  made.draws[2].indexCount = 36;
  made.draws[3].indexCount = 1;
  EXPECT_EQ(complaints(made), Lines{"draws[2].indexCount is 36, that of candidate 5 is 18"});
  made = rightList();
  made.draws[4].size = 0.25f;
  EXPECT_EQ(complaints(made), Lines{"draws[4].size is 0.25, that of candidate 11 is 5.5"});
  made = rightList();
  made.draws[0].instanceCount = 0xffffdeadu;
  EXPECT_EQ(complaints(made),
            Lines{"draws[0].instanceCount is unwritten, that of candidate 2 is 1"});
}

TEST(List, AWrittenTailIsNamed) {
  Made made = rightList();
  made.draws.resize(7, candidates()[0]);
  EXPECT_EQ(complaints(made), Lines{"the tail was written, first at draws[5] behind 5 records"});
}

TEST(List, PaddingThatDrawsIsNamed) {
  Made made = rightList();
  while (made.draws.size() < kCapacity) made.draws.push_back({9, 0, 9, 9});
  made.draws[6].instanceCount = 1;
  EXPECT_EQ(complaints(made, false, true),
            Lines{"draws[6].instanceCount is 1, not 0, behind 5 records"});
  EXPECT_EQ(complaints(rightList(), false, true),
            Lines{"draws[5].instanceCount is unwritten, not 0, behind 5 records"});
}

TEST(List, ATallyThatContradictsTheListIsNamed) {
  const auto told = [](Stats stats, Made made) {
    made.stats = stats;
    return complaints(made);
  };
  EXPECT_EQ(told({12, 5, 1}, rightList()), Lines{"stats.found says 12, the list has 5 and 8 fit"});
  EXPECT_EQ(told({4, 5, 0}, rightList()), Lines{"stats.found says 4, the list has 5 and 8 fit"});
  EXPECT_EQ(told({11, 11, 1}, fullList()), Lines{"stats.listed is 11, but 8 fit"});
  EXPECT_EQ(told({11, 8, 0}, fullList()),
            Lines{"stats.overflowed is 0 though 11 were found and 8 fit"});
  EXPECT_EQ(told({8, 8, 1}, fullList()),
            Lines{"stats.overflowed is 1 though 8 were found and 8 fit"});
  EXPECT_EQ(told({5, 5, 2}, rightList()), Lines{"stats.overflowed is 2, neither 0 nor 1"});
}

TEST(List, OneModuleAloneIsBlamedAlone) {
  Observation seen = observationOf(rightList());
  seen.twin["stats"] = bytesOf(std::vector{Stats{5, 5, 1}});
  decoded(seen);
  EXPECT_EQ(seen.findings, Lines{"the strict twin's list 'visible': stats.overflowed is 1 though 5 "
                                 "were found and 8 fit"});
}

// ---- what a foreign kernel does not give, and what a test may not ask -----------------------

TEST(List, WhatAForeignKernelDoesNotGiveIsNotAsked) {
  Made made = rightList();
  made.stats = {0, 0, 0};  // what is not given reads as 0
  for (Draw& d : made.draws) d.size = 0;
  Observation seen = observationOf(made);
  seen.unmapped = {"stats.found", "stats.listed", "stats.overflowed", "draws.size"};
  EXPECT_EQ(decoded(seen), kCandidates);
  EXPECT_EQ(findings(seen), Lines{});
  EXPECT_EQ(listed(seen), (std::vector<uint>{2, 3, 5, 7, 11}));

  made.stats.overflowed = 1;
  seen = observationOf(made);
  seen.unmapped = {"stats.found", "stats.listed", "draws.size"};
  decoded(seen);
  EXPECT_EQ(findings(seen), Lines{"stats.overflowed is 1 though the list has 5 and 8 fit"});

  Made full = fullList();  // and may have overflowed
  seen = observationOf(full);
  seen.unmapped = {"stats.found", "stats.listed", "stats.overflowed"};
  EXPECT_EQ(decoded(seen), 17u);
  EXPECT_EQ(findings(seen), Lines{});
}

TEST(List, APaddedListWithoutALengthEndsAtItsPadding) {
  Made made = rightList();
  while (made.draws.size() < kCapacity) made.draws.push_back({9, 0, 9, 9});
  Observation seen = observationOf(made);
  seen.unmapped = {"stats.listed"};
  decoded(seen, false, true);
  EXPECT_EQ(findings(seen), Lines{});
  EXPECT_EQ(listed(seen), (std::vector<uint>{2, 3, 5, 7, 11}));
}

TEST(List, WithoutTheIdNothingCanBeToldAndTheRemedyIsNamed) {
  Observation seen = observationOf(rightList());
  seen.unmapped = {"draws.object"};
  try {
    decoded(seen);
    ADD_FAILURE() << "decoded";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "the kernel does not give draws.object, without which nothing tells which of "
                 "'candidates' are listed: name it in 'fields'");
  }
}

TEST(List, WhereAKernelDoesNotApplyThereIsNoList) {
  Observation seen{.applies = false};
  EXPECT_EQ(decoded(seen), kCandidates);
  EXPECT_FALSE(seen.twin.contains("visible"));
}

TEST(List, ATestThatAsksForTheImpossibleIsToldSo) {
  const KernelRecord r = record();
  Observation seen = observationOf(rightList());
  std::vector<Draw> all = candidates();
  std::swap(all[3], all[4]);
  EXPECT_THROW(decodeList(r, r.list("visible"), std::as_bytes(std::span(all)), kCapacity, seen),
               std::logic_error);
  EXPECT_THROW(decoded(seen, false, false, kCapacity + 1), std::logic_error);
  EXPECT_THROW(r.list("hidden"), std::logic_error);
}

// ---- a kernel -------------------------------------------------------------------------------

// Groups take numbers as they start; each waits for the sum of the one before it and publishes its
// own plus one, so that 0 says "not yet". Whoever has the last number cleans up: all others have
// published, and read what they needed before that.
const std::string kListing = R"(#version 450
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 32) in;
struct Draw { uint indexCount, instanceCount; float size; uint object; };
struct Stats { uint found, listed, overflowed; };
struct Word { uint value; };
layout(push_constant, scalar) uniform P { uint count, capacity; };
layout(set = 0, binding = 0, scalar) readonly buffer Candidates { Draw candidates[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Draws { Draw draws[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer StatsBlock { Stats stats[]; };
layout(set = 0, binding = 3, scalar) coherent buffer Scratch { Word scratch[]; };
shared uint number, before, places[32];
void main() {
  uint t = gl_LocalInvocationIndex, groups = gl_NumWorkGroups.x;
  if (t == 0) number = atomicAdd(scratch[0].value, 1);
  barrier();
  uint i = number * 32 + t;
  bool visible = i < count && candidates[i].indexCount % 2 == 1;
  places[t] = uint(visible);
  barrier();
  if (t == 0) {
    uint sum = 0;
    for (uint k = 0; k < 32; ++k) {
      uint one = places[k];
      places[k] = sum;
      sum += one;
    }
    uint told = 1;
    if (number > 0)
      do told = atomicAdd(scratch[number].value, 0); while (told == 0);
    before = told - 1;
    atomicExchange(scratch[number + 1].value, before + sum + 1);
    if (number == groups - 1) {
      stats[0] = Stats(before + sum, min(before + sum, capacity), uint(before + sum > capacity));
      for (uint g = 0; g <= groups; ++g) CLEAN(g);
    }
  }
  barrier();
  if (visible && before + places[t] < capacity) draws[before + places[t]] = candidates[i];
}
)";

SpirvWords listing(const std::string& clean = "scratch[g].value = 0") {
  std::string text = kListing;
  const std::string call = "CLEAN(g)";
  return compileText(text.replace(text.find(call), call.size(), clean));
}

class ListOnDevice : public testing::Test {
 protected:
  static void SetUpTestSuite() { gpu = std::make_unique<Gpu>(Gpu::Options{}); }
  static void TearDownTestSuite() { gpu.reset(); }

  static constexpr uint kMany = 100, kGroups = 4;

  static Observation observed(const SpirvWords& words, uint capacity) {
    const KernelRecord r = record();
    const std::vector<Draw> all = candidates(kMany);
    const Push push{kMany, capacity};
    return observe({*gpu, r, {.words = words, .origin = "list.comp"}},
                   {.inputs = {{"candidates", std::as_bytes(std::span(all))}},
                    .outputs = {{"draws", capacity, true}, {"stats", 1}},
                    .scratch = {{"scratch", kGroups + 1}},
                    .push = std::as_bytes(std::span(&push, 1)),
                    .extent = {kMany}});
  }

  static inline std::unique_ptr<Gpu> gpu;
};

template <class T>
struct MembershipOf {
  T visible;
  auto scalars() { return std::tie(visible); }
};

/// Every second candidate from the first on, or from the second on.
Verdict judged(const Gpu& gpu, const Observation& seen, std::size_t decided, bool inverted) {
  static const Policy policy =
      Policy::load(std::filesystem::path(GNOMON_SOURCE_DIR) / "tests/policy.json");
  const KernelRecord r = record();
  const Expectation e = expectationOf(
      "visible", decided,
      [inverted]<class T>(std::size_t i) {
        return MembershipOf<T>{T((i % 2 == 0) != inverted ? 1.0f : 0.0f)};
      },
      [](std::size_t i) { return fmt::format("    i  {}\n", i); });
  return judge(r.layoutOf("visible"), seen, e, Bounds::specification(gpu.info().roundingRteFloat32),
               policy, 1);
}

TEST_F(ListOnDevice, ARightKernelConformsAsASet) {
  for (const uint capacity : {64u, 50u, 20u}) {
    Observation seen = observed(listing(), capacity);
    const KernelRecord r = record();
    const std::vector<Draw> all = candidates(kMany);
    const std::size_t decided =
        decodeList(r, r.list("visible"), std::as_bytes(std::span(all)), capacity, seen);
    EXPECT_EQ(seen.findings, Lines{});
    EXPECT_EQ(decided, capacity < 50 ? 39u : kMany);  // the 20th of every second from 0 is 38
    EXPECT_EQ(judged(*gpu, seen, decided, false).verdict, Class::kConforms);
    const Verdict wrong = judged(*gpu, seen, decided, true);
    EXPECT_EQ(wrong.verdict, Class::kWrong);
    EXPECT_EQ(wrong.outside, decided);
  }
}

TEST_F(ListOnDevice, AListWithoutRoomIsCleanAndDecidesNothing) {
  Observation seen = observed(listing(), 0);
  const KernelRecord r = record();
  const std::vector<Draw> all = candidates(kMany);
  EXPECT_EQ(decodeList(r, r.list("visible"), std::as_bytes(std::span(all)), 0, seen), 0u);
  EXPECT_EQ(seen.findings, Lines{});
  EXPECT_EQ(elementsOf<uint>(seen.twin.at("stats")), (std::vector<uint>{50, 0, 1}));
  EXPECT_EQ(judged(*gpu, seen, 0, false).verdict, Class::kConforms);
}

TEST_F(ListOnDevice, ScratchThatIsLeftBehindIsFound) {
  const Observation seen = observed(listing("if (g != 2) scratch[g].value = 0"), 64);
  const std::string rest =
      "left 'scratch' other than zero, first at scratch[2].value: 33; the next dispatch starts "
      "from "
      "it";
  EXPECT_EQ(seen.findings, (Lines{"the kernel " + rest, "the strict twin " + rest}));
}

}  // namespace
}  // namespace gnomon
