// Waivers: what is refused when they are read, and what becomes of a case on which day.
#include "harness/verdict/waivers.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/error.h"

namespace gnomon {
namespace {

using namespace std::chrono_literals;

constexpr auto kExpiry = 2027y / std::chrono::November / 23d;
constexpr auto kDayAfter = 2027y / std::chrono::November / 24d;

std::vector<Waiver> loaded(const std::string& text) {
  const auto file =
      std::filesystem::temp_directory_path() / fmt::format("gnomon_waivers_{}.json", getpid());
  std::ofstream(file) << text;
  struct Remove {
    std::filesystem::path path;
    ~Remove() { std::filesystem::remove(path); }
  } const remove{file};
  return loadWaivers(file);
}

std::string entry(const std::string& expiry, const std::string& more = "") {
  return fmt::format(
      R"([{{"device": "*H200*", "driver": "*580.159*", "case": "PrecisionLog.*",
            "reason": "errs", "link": "there", "expiry": "{}"{}}}])",
      expiry, more);
}

std::string complaintOf(const std::string& text) {
  try {
    loaded(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(Waivers, AreReadWhole) {
  const std::vector<Waiver> all = loaded(entry("2027-11-23"));
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].cases, "PrecisionLog.*");
  EXPECT_EQ(all[0].reason, "errs");
  EXPECT_EQ(all[0].link, "there");
  EXPECT_EQ(all[0].expiry, kExpiry);
  EXPECT_TRUE(loaded("[]").empty());
}

TEST(Waivers, OfTheProjectCanBeRead) {
  EXPECT_NO_THROW(loadWaivers(std::filesystem::path(GNOMON_SOURCE_DIR) / "tests/waivers.json"));
}

TEST(Waivers, WhatIsWrongIsNamed) {
  const auto expectNamed = [](const std::string& text, const std::string& what) {
    EXPECT_NE(complaintOf(text).find(what), std::string::npos) << text << complaintOf(text);
  };
  expectNamed("", "parse error");
  expectNamed("{}", "not a list of waivers");
  expectNamed("[1]", "waiver 1: needs a text \"device\"");
  expectNamed(R"([{"device": ""}])", "waiver 1: needs a text \"device\"");
  for (const char* date : {"2027-13-01", "2027-02-29", "2027-2-1", "soon", "2027-11-23 "})
    expectNamed(entry(date), "which is no date");
  expectNamed(entry("2027-11-23", R"(, "untill": "x")"), "has a key besides");
}

TEST(Waivers, HoldForTheirDeviceDriverAndCasesAlone) {
  const std::vector<Waiver> all = loaded(entry("2027-11-23"));
  const auto holds = [&](const char* device, const char* driver, const char* name) {
    return waiverFor(all, device, driver, name) != nullptr;
  };
  EXPECT_TRUE(holds("NVIDIA H200", "NVIDIA 580.159.04", "PrecisionLog.Worst"));
  EXPECT_FALSE(holds("NVIDIA H100", "NVIDIA 580.159.04", "PrecisionLog.Worst"));
  EXPECT_FALSE(holds("NVIDIA H200", "NVIDIA 590.10", "PrecisionLog.Worst"));
  EXPECT_FALSE(holds("NVIDIA H200", "NVIDIA 580.159.04", "PrecisionLog2.Worst"));
}

TEST(Waivers, ExcuseAFailureUpToTheirLastDay) {
  const Waiver waiver = loaded(entry("2027-11-23"))[0];
  const Ruling ruling = rule(waiver, true, kExpiry);
  EXPECT_FALSE(ruling.failed);
  EXPECT_EQ(ruling.waived, "errs (there)");
  EXPECT_FALSE(ruling.message);
}

TEST(Waivers, AreAFailureWhereTheCasePasses) {
  const Ruling ruling = rule(loaded(entry("2027-11-23"))[0], false, kExpiry);
  EXPECT_TRUE(ruling.failed);
  EXPECT_FALSE(ruling.waived);
  EXPECT_TRUE(ruling.message->starts_with("unexpected pass: remove the waiver"));
}

TEST(Waivers, CountAsAbsentOnceTheyHaveExpired) {
  const Waiver waiver = loaded(entry("2027-11-23"))[0];
  const Ruling failed = rule(waiver, true, kDayAfter);
  EXPECT_TRUE(failed.failed);
  EXPECT_FALSE(failed.waived);
  EXPECT_EQ(failed.message, "its waiver (errs) expired on 2027-11-23");
  const Ruling passed = rule(waiver, false, kDayAfter);
  EXPECT_FALSE(passed.failed);
  EXPECT_FALSE(passed.message);
}

TEST(Waivers, TodayIsADay) { EXPECT_TRUE(today().ok()); }

}  // namespace
}  // namespace gnomon
