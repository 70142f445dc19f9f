#include "harness/isolate/messages.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

using Json = nlohmann::json;

// JSON has no infinity: a budget without end travels as null.
Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

double number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

template <class T>
Json optional(const std::optional<T>& x) {
  return x ? Json(*x) : Json(nullptr);
}

template <class T>
std::optional<T> optional(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional<T>(json.get<T>());
}

Json fieldJson(const FieldVerdict& f) {
  return {{"name", f.name},
          {"outside", f.outside},
          {"budget", number(f.budget)},
          {"specBudget", number(f.specBudget)},
          {"specWidth", number(f.specWidth)},
          {"deviceWidth", number(f.deviceWidth)}};
}

FieldVerdict fieldVerdict(const Json& j) {
  return {.name = j["name"],
          .outside = j["outside"],
          .budget = number(j["budget"]),
          .specBudget = number(j["specBudget"]),
          .specWidth = number(j["specWidth"]),
          .deviceWidth = number(j["deviceWidth"]),
          .worst = {}};
}

Json errorsJson(const DeviceErrors& errors) {
  Json j = Json::object();
  for (const auto& [operation, e] : errors)
    j[std::string(nameOf(operation))] = {{"ulp", number(e.worst.ulp)},
                                         {"absolute", number(e.worst.absolute)},
                                         {"worstAt", number(e.worstAt)},
                                         {"arguments", e.arguments},
                                         {"exhaustive", e.exhaustive}};
  return j;
}

DeviceErrors deviceErrors(const Json& j) {
  DeviceErrors errors;
  for (const auto& [name, e] : j.items())
    if (const auto operation = operationNamed(name))
      errors[*operation] = {.worst = {number(e["ulp"]), number(e["absolute"])},
                            .worstAt = number(e["worstAt"]),
                            .arguments = e["arguments"],
                            .exhaustive = e["exhaustive"]};
  return errors;
}

Json verdictJson(const Verdict& v) {
  Json j = {{"class", static_cast<int>(v.verdict)},
            {"widening", v.widening},
            {"output", v.output},
            {"storage", static_cast<int>(v.storage)},
            {"elements", v.elements},
            {"bounded", v.bounded},
            {"truncated", v.truncated},
            {"outside", v.outside},
            {"outsideDevice", v.outsideDevice},
            {"ambiguous", v.ambiguous},
            {"reassociated", v.reassociated},
            {"plainBudget", number(v.plainBudget)},
            {"fields", Json::array()},
            {"problems", v.problems}};
  for (const FieldVerdict& f : v.fields) j["fields"].push_back(fieldJson(f));
  return j;
}

Verdict verdict(const Json& j) {
  Verdict v{.verdict = static_cast<Class>(j["class"].get<int>()),
            .widening = j["widening"],
            .output = j["output"],
            .storage = static_cast<Storage>(j["storage"].get<int>()),
            .elements = j["elements"],
            .bounded = j["bounded"],
            .truncated = j["truncated"],
            .outside = j["outside"],
            .outsideDevice = j["outsideDevice"],
            .ambiguous = j["ambiguous"],
            .reassociated = j["reassociated"],
            .plainBudget = number(j["plainBudget"]),
            .fields = {},
            .worst = {},
            .problems = j["problems"]};
  for (const Json& f : j["fields"]) v.fields.push_back(fieldVerdict(f));
  return v;
}

// A foreign kernel's message may quote any bytes.
std::string text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json parse(std::string_view json, const char* what) {
  Json parsed = Json::parse(json, nullptr, false);
  if (!parsed.is_object()) throw UsageError(fmt::format("this is no {} of a worker", what));
  return parsed;
}

}  // namespace

std::string toJson(const WorkerTask& task) {
  const SessionOptions& s = task.session;
  Json kernels = Json::object();
  for (const auto& [kernel, file] : s.kernels) kernels[kernel] = file.string();
  return text({{"root", s.root.string()},
               {"device", s.device},
               {"seed", s.seed},
               {"generated", optional(s.cases)},
               {"timeout", s.timeout ? Json(s.timeout->count()) : Json(nullptr)},
               {"kernels", kernels},
               {"validation", s.validation},
               {"cases", task.cases},
               {"errors", task.errors ? errorsJson(*task.errors) : Json(nullptr)}});
}

WorkerTask workerTask(std::string_view json) try {
  const Json j = parse(json, "task");
  WorkerTask task{.session = {.root = j["root"].get<std::string>(),
                              .device = j["device"],
                              .seed = j["seed"],
                              .cases = optional<std::size_t>(j["generated"]),
                              .validation = j["validation"]},
                  .cases = j["cases"]};
  if (const auto seconds = optional<long>(j["timeout"]))
    task.session.timeout = std::chrono::seconds(*seconds);
  if (!j["errors"].is_null()) task.errors = deviceErrors(j["errors"]);
  for (const auto& [kernel, file] : j["kernels"].items())
    task.session.kernels[kernel] = file.get<std::string>();
  return task;
} catch (const Json::exception& e) {
  throw UsageError(fmt::format("this is no task of a worker: {}", e.what()));
}

std::string toJson(const CaseRecord& r) {
  Json j = {{"name", r.name},
            {"kernel", r.kernel},
            {"failed", r.failed},
            {"skipped", optional(r.skipped)},
            {"unsupported", optional(r.unsupported)},
            {"threadsCommunicate", r.threadsCommunicate},
            {"usesSubgroups", r.usesSubgroups},
            {"elements", r.elements},
            {"seconds", r.seconds},
            {"verdicts", Json::array()},
            {"measured", errorsJson(r.measured)},
            {"messages", r.messages}};
  for (const Verdict& v : r.verdicts) j["verdicts"].push_back(verdictJson(v));
  return text(j);
}

CaseRecord caseRecord(std::string_view json) try {
  const Json j = parse(json, "record");
  CaseRecord r{.name = j["name"],
               .kernel = j["kernel"],
               .failed = j["failed"],
               .skipped = optional<std::string>(j["skipped"]),
               .unsupported = optional<std::string>(j["unsupported"]),
               .threadsCommunicate = j["threadsCommunicate"],
               .usesSubgroups = j["usesSubgroups"],
               .elements = j["elements"],
               .seconds = j["seconds"],
               .measured = deviceErrors(j["measured"]),
               .messages = j["messages"]};
  for (const Json& v : j["verdicts"]) r.verdicts.push_back(verdict(v));
  return r;
} catch (const Json::exception& e) {
  throw UsageError(fmt::format("this is no record of a worker: {}", e.what()));
}

std::string toJson(const Preparation& p) {
  return text({{"name", p.gpu.name},
               {"driver", p.gpu.driver},
               {"api", p.gpu.api},
               {"subgroupSize", p.gpu.subgroupSize},
               {"errors", errorsJson(p.errors)},
               {"foreign", p.foreign}});
}

Preparation preparation(std::string_view json) try {
  const Json j = parse(json, "preparation");
  Preparation p{.errors = deviceErrors(j["errors"]), .foreign = j["foreign"]};
  p.gpu.name = j["name"];
  p.gpu.driver = j["driver"];
  p.gpu.api = j["api"];
  p.gpu.subgroupSize = j["subgroupSize"];
  return p;
} catch (const Json::exception& e) {
  throw UsageError(fmt::format("this is no preparation of a worker: {}", e.what()));
}

}  // namespace gnomon
