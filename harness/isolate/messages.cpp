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
  return {.name = j.at("name"),
          .outside = j.at("outside"),
          .budget = number(j.at("budget")),
          .specBudget = number(j.at("specBudget")),
          .specWidth = number(j.at("specWidth")),
          .deviceWidth = number(j.at("deviceWidth")),
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
      errors[*operation] = {.worst = {number(e.at("ulp")), number(e.at("absolute"))},
                            .worstAt = number(e.at("worstAt")),
                            .arguments = e.at("arguments"),
                            .exhaustive = e.at("exhaustive")};
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
  Verdict v{.verdict = static_cast<Class>(j.at("class").get<int>()),
            .widening = j.at("widening"),
            .output = j.at("output"),
            .storage = static_cast<Storage>(j.at("storage").get<int>()),
            .elements = j.at("elements"),
            .bounded = j.at("bounded"),
            .truncated = j.at("truncated"),
            .outside = j.at("outside"),
            .outsideDevice = j.at("outsideDevice"),
            .ambiguous = j.at("ambiguous"),
            .reassociated = j.at("reassociated"),
            .plainBudget = number(j.at("plainBudget")),
            .fields = {},
            .worst = {},
            .problems = j.at("problems")};
  for (const Json& f : j.at("fields")) v.fields.push_back(fieldVerdict(f));
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
               {"shrinks", s.shrinks},
               {"failures", s.failures.string()},
               {"replay", s.replay.string()},
               {"validation", s.validation},
               {"probes", s.probes},
               {"watch", static_cast<int>(s.watch)},
               {"firstFailureOnly", s.firstFailureOnly},
               {"cases", task.cases},
               {"mutated", task.mutated},
               {"mutants", task.mutants},
               {"models", task.models},
               {"kills", task.kills},
               {"errors", task.errors ? errorsJson(*task.errors) : Json(nullptr)}});
}

WorkerTask workerTask(std::string_view json) try {
  const Json j = parse(json, "task");
  WorkerTask task{.session = {.root = j.at("root").get<std::string>(),
                              .device = j.at("device"),
                              .seed = j.at("seed"),
                              .cases = optional<std::size_t>(j.at("generated")),
                              .shrinks = j.at("shrinks"),
                              .failures = j.at("failures").get<std::string>(),
                              .replay = j.at("replay").get<std::string>(),
                              .validation = j.at("validation"),
                              .probes = j.at("probes"),
                              .watch = static_cast<Watch>(j.at("watch").get<int>()),
                              .firstFailureOnly = j.at("firstFailureOnly")},
                  .cases = j.at("cases"),
                  .mutated = j.at("mutated"),
                  .mutants = j.at("mutants"),
                  .models = j.at("models"),
                  .kills = j.at("kills")};
  if (const auto seconds = optional<long>(j.at("timeout")))
    task.session.timeout = std::chrono::seconds(*seconds);
  if (!j.at("errors").is_null()) task.errors = deviceErrors(j.at("errors"));
  for (const auto& [kernel, file] : j.at("kernels").items())
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
            {"elements", r.elements},
            {"seconds", r.seconds},
            {"verdicts", Json::array()},
            {"measured", errorsJson(r.measured)},
            {"messages", r.messages},
            {"shrunk", optional(r.shrunk)},
            {"replayed", r.replayed},
            {"unusable", optional(r.unusable)}};
  for (const Verdict& v : r.verdicts) j["verdicts"].push_back(verdictJson(v));
  return text(j);
}

CaseRecord caseRecord(std::string_view json) try {
  const Json j = parse(json, "record");
  CaseRecord r{.name = j.at("name"),
               .kernel = j.at("kernel"),
               .failed = j.at("failed"),
               .skipped = optional<std::string>(j.at("skipped")),
               .unsupported = optional<std::string>(j.at("unsupported")),
               .threadsCommunicate = j.at("threadsCommunicate"),
               .elements = j.at("elements"),
               .seconds = j.at("seconds"),
               .measured = deviceErrors(j.at("measured")),
               .messages = j.at("messages"),
               .shrunk = optional<std::string>(j.at("shrunk")),
               .replayed = j.at("replayed"),
               .unusable = optional<std::string>(j.at("unusable"))};
  for (const Json& v : j.at("verdicts")) r.verdicts.push_back(verdict(v));
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
               {"foreign", p.foreign},
               {"unmapped", p.unmapped}});
}

Preparation preparation(std::string_view json) try {
  const Json j = parse(json, "preparation");
  Preparation p{.errors = deviceErrors(j.at("errors")),
                .foreign = j.at("foreign"),
                .unmapped = j.at("unmapped")};
  p.gpu.name = j.at("name");
  p.gpu.driver = j.at("driver");
  p.gpu.api = j.at("api");
  p.gpu.subgroupSize = j.at("subgroupSize");
  return p;
} catch (const Json::exception& e) {
  throw UsageError(fmt::format("this is no preparation of a worker: {}", e.what()));
}

}  // namespace gnomon
