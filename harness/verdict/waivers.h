// Failures that are known and not ours: a driver's bug, excused for a while.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gnomon {

/// One entry of tests/waivers.json; device, driver and cases are shell patterns.
struct Waiver {
  std::string device{}, driver{}, cases{};
  std::string reason{};
  std::string link{};                    ///< where the bug is described
  std::chrono::year_month_day expiry{};  ///< the last day on which it counts
};

/// What becomes of a case.
struct Ruling {
  bool failed = false;
  std::optional<std::string> waived{};   ///< why its failure is none
  std::optional<std::string> message{};  ///< to add to its failure
};

/// Reads [{"device", "driver", "case", "reason", "link", "expiry": "YYYY-MM-DD"}]. Throws
/// UsageError that names file, entry and key.
std::vector<Waiver> loadWaivers(const std::filesystem::path& file);

/// The waiver for a case on a device, or null.
const Waiver* waiverFor(const std::vector<Waiver>& waivers, std::string_view device,
                        std::string_view driver, std::string_view caseName);

/// While it lasts a waiver excuses a failure, and a case that passes fails, so that nobody keeps a
/// waiver which is no longer needed. Afterwards a failure is one and says that the waiver expired.
Ruling rule(const Waiver& waiver, bool failed, std::chrono::year_month_day today);

std::chrono::year_month_day today();

}  // namespace gnomon
