#include "harness/verdict/waivers.h"

#include <fnmatch.h>

#include <cstdio>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Json = nlohmann::json;
using Date = std::chrono::year_month_day;

bool matches(const std::string& pattern, std::string_view text) {
  return fnmatch(pattern.c_str(), std::string(text).c_str(), 0) == 0;
}

std::string inWords(const Date& date) {
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

Date parseDate(const std::string& text, const std::string& where) {
  int year = 0;
  unsigned month = 0, day = 0;
  std::sscanf(text.c_str(), "%4d-%2u-%2u", &year, &month, &day);
  const Date date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || inWords(date) != text)
    throw UsageError(
        fmt::format("{}: \"expiry\" is '{}', which is no date as YYYY-MM-DD", where, text));
  return date;
}

Waiver parse(const Json& entry, const std::string& where) {
  const auto text = [&](const char* key) {
    if (!entry.is_object() || !entry.contains(key) || !entry[key].is_string() ||
        entry[key].get<std::string>().empty())
      throw UsageError(fmt::format("{}: needs a text \"{}\"", where, key));
    return entry[key].get<std::string>();
  };
  Waiver waiver{.device = text("device"),
                .driver = text("driver"),
                .cases = text("case"),
                .reason = text("reason"),
                .link = text("link"),
                .expiry = parseDate(text("expiry"), where)};
  if (entry.size() != 6)
    throw UsageError(where + ": has a key besides device, driver, case, reason, link and expiry");
  return waiver;
}

}  // namespace

std::vector<Waiver> loadWaivers(const std::filesystem::path& file) try {
  std::ifstream in(file);
  const Json json = Json::parse(in);
  if (!json.is_array()) throw UsageError(file.string() + ": not a list of waivers");
  std::vector<Waiver> all;
  for (const Json& entry : json)
    all.push_back(parse(entry, fmt::format("{}: waiver {}", file.string(), all.size() + 1)));
  return all;
} catch (const Json::exception& e) {
  throw UsageError(fmt::format("{}: {}", file.string(), e.what()));
}

const Waiver* waiverFor(const std::vector<Waiver>& waivers, std::string_view device,
                        std::string_view driver, std::string_view caseName) {
  for (const Waiver& w : waivers)
    if (matches(w.device, device) && matches(w.driver, driver) && matches(w.cases, caseName))
      return &w;
  return nullptr;
}

Ruling rule(const Waiver& waiver, bool failed, Date today) {
  const bool expired = std::chrono::sys_days(today) > std::chrono::sys_days(waiver.expiry);
  if (failed && expired)
    return {.failed = true,
            .message = fmt::format("its waiver ({}) expired on {}", waiver.reason,
                                   inWords(waiver.expiry))};
  if (failed) return {.waived = fmt::format("{} ({})", waiver.reason, waiver.link)};
  if (expired) return {};
  return {.failed = true,
          .message = fmt::format("unexpected pass: remove the waiver from tests/waivers.json ({})",
                                 waiver.reason)};
}

Date today() {
  return Date(std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now()));
}

}  // namespace gnomon
