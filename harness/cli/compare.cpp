#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/image/exr.h"
#include "harness/image/flip.h"
#include "harness/image/heatmap.h"
#include "harness/image/metrics.h"
#include "harness/report/summary.h"
#include "harness/report/terminal.h"

namespace gnomon {
namespace {

struct LayerFlip {
  std::string layer;  ///< "" for the channels without a layer
  Flip flip;
};

struct Comparison {
  Difference all;
  std::vector<Difference> channels;  ///< R, G, B, A first, then as the file sorts them
  std::vector<LayerFlip> flips;
};

/// The data window is part of the shape: the same pixels elsewhere are another picture.
void requireSameWindow(const CompareOptions& options, const ExrPart& a, const ExrPart& b) {
  const auto shape = [](const ExrPart& p) {
    return fmt::format("{} at ({}, {})", shapeOf(p.image), p.origin.x, p.origin.y);
  };
  if (a.image.width != b.image.width || a.image.height != b.image.height ||
      a.image.channels != b.image.channels || a.origin != b.origin)
    throw UsageError(fmt::format("the images cannot be compared:\n  {}: {}\n  {}: {}",
                                 options.reference.string(), shape(a), options.test.string(),
                                 shape(b)));
}

std::vector<std::string> inReadingOrder(std::vector<std::string> channels) {
  const auto rank = [](const std::string& name) {
    const std::size_t at = name.size() == 1 ? std::string("RGBA").find(name) : std::string::npos;
    return std::min<std::size_t>(at, 4);
  };
  std::ranges::stable_sort(channels, {}, rank);
  return channels;
}

Comparison compared(const Image& reference, const Image& test) {
  Comparison c{.all = difference(reference, test, reference.channels), .channels = {}, .flips = {}};
  for (const std::string& name : inReadingOrder(reference.channels))
    c.channels.push_back(difference(reference, test, {name}));
  for (const std::string& layer : colourLayers(reference))
    c.flips.push_back({layer, flip(rgbOf(reference, layer), rgbOf(test, layer))});
  return c;
}

std::string place(Pixel p) { return fmt::format("({}, {})", p.x, p.y); }

std::string differenceTable(const Comparison& c) {
  std::vector<std::vector<std::string>> rows = {
      {"channel", "max", "at", "reference", "test", "RMSE", "worst block", "at", "PSNR dB"}};
  const auto add = [&rows](const Difference& d) {
    const bool differs = d.max > 0;
    rows.push_back({d.channels, fmt::format("{:.6g}", d.max), differs ? place(d.maxAt) : "",
                    differs ? fmt::format("{:.6g}", d.reference) : "",
                    differs ? fmt::format("{:.6g}", d.test) : "", fmt::format("{:.6g}", d.rmse),
                    fmt::format("{:.6g}", d.worstBlock), differs ? place(d.worstBlockAt) : "",
                    fmt::format("{:.2f}", d.psnr)});
  };
  std::ranges::for_each(c.channels, add);
  if (c.channels.size() > 1) add(c.all);
  return table(rows, "lrlrrrrlr");
}

std::string flipKind(const Flip& f) {
  if (!f.hdr) return "LDR-FLIP (no value above 1, taken as linear light)";
  return fmt::format("HDR-FLIP (exposures {:+.2f} to {:+.2f} stops in {} steps)", f.exposures.start,
                     f.exposures.stop, f.exposures.count);
}

std::string flipTable(const Comparison& c) {
  if (c.flips.empty()) return "FLIP: none, for there are no channels R, G and B";
  std::vector<std::vector<std::string>> rows = {{"layer", "FLIP mean", "max", "at", "kind"}};
  for (const auto& [layer, f] : c.flips)
    rows.push_back({layer.empty() ? "RGB" : layer, fmt::format("{:.6f}", f.mean),
                    fmt::format("{:.6f}", f.max), f.max > 0 ? place(f.maxAt) : "", flipKind(f)});
  return table(rows, "lrrll");
}

std::string nonFiniteLine(const Difference& d) {
  if (d.nonFinite + d.mismatched == 0) return "";
  return fmt::format(
      "NaN or infinite: {} the same in both, {} in one and not the same in the other",
      grouped(d.nonFinite), grouped(d.mismatched));
}

/// The limits that are exceeded, in words; NaN exceeds every limit.
std::vector<std::string> exceeded(const Comparison& c, const CompareOptions& options) {
  std::vector<std::string> lines;
  if (options.max && !(c.all.max <= *options.max))
    lines.push_back(fmt::format("max: {:.6g} in {} at {} is above {:.6g}", c.all.max,
                                c.all.maxChannel, place(c.all.maxAt), *options.max));
  for (const auto& [layer, f] : c.flips)
    if (options.flip && !(f.mean <= *options.flip))
      lines.push_back(fmt::format("FLIP: mean {:.6g}{} is above {:.6g}", f.mean,
                                  layer.empty() ? "" : " of layer " + layer, *options.flip));
  return lines;
}

/// JSON has no infinity: +-1e300 stays a number for scripts.
double finite(double x) { return std::isfinite(x) ? x : std::copysign(1e300, x); }

nlohmann::json jsonOf(const Difference& d) {
  return {{"channel", d.channels},
          {"max", finite(d.max)},
          {"maxChannel", d.maxChannel},
          {"maxAt", {d.maxAt.x, d.maxAt.y}},
          {"rmse", finite(d.rmse)},
          {"worstBlock", finite(d.worstBlock)},
          {"worstBlockAt", {d.worstBlockAt.x, d.worstBlockAt.y}},
          {"psnr", finite(d.psnr)},
          {"nonFinite", d.nonFinite},
          {"mismatched", d.mismatched}};
}

nlohmann::json jsonOf(const LayerFlip& l) {
  const Flip& f = l.flip;
  nlohmann::json json = {
      {"layer", l.layer},     {"kind", f.hdr ? "HDR" : "LDR"},   {"mean", finite(f.mean)},
      {"max", finite(f.max)}, {"maxAt", {f.maxAt.x, f.maxAt.y}}, {"exposures", nullptr}};
  if (f.hdr)
    json["exposures"] = {
        {"start", f.exposures.start}, {"stop", f.exposures.stop}, {"count", f.exposures.count}};
  return json;
}

void writeJson(const Comparison& c, const CompareOptions& options, const Image& image,
               const std::vector<std::string>& failures) {
  auto channels = nlohmann::json::array(), flips = nlohmann::json::array();
  for (const Difference& d : c.channels) channels.push_back(jsonOf(d));
  for (const LayerFlip& l : c.flips) flips.push_back(jsonOf(l));
  const nlohmann::json json = {{"schema", 1},
                               {"reference", options.reference.string()},
                               {"test", options.test.string()},
                               {"width", image.width},
                               {"height", image.height},
                               {"all", jsonOf(c.all)},
                               {"channels", channels},
                               {"flip", flips},
                               {"failures", failures}};
  writeText(options.json,
            json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

/// Each pixel's largest error over the channels.
std::vector<float> largestErrors(const Image& reference, const Image& test) {
  std::vector<float> map(reference.pixels());
  for (std::size_t c = 0; c < reference.channels.size(); ++c)
    for (std::size_t i = 0; i < map.size(); ++i)
      map[i] = std::max(map[i],
                        static_cast<float>(sampleError(reference.plane(c)[i], test.plane(c)[i])));
  return map;
}

/// The FLIP errors; of images without colours the largest errors, against the largest finite one.
void writeHeatmapOf(const Comparison& c, const CompareOptions& options, const Image& reference,
                    const Image& test) {
  const int w = reference.width, h = reference.height;
  if (!c.flips.empty()) return writeHeatmap(options.heatmap, w, h, c.flips.front().flip.map);
  const std::vector<float> map = largestErrors(reference, test);
  float top = 0;
  for (const float error : map)
    if (std::isfinite(error)) top = std::max(top, error);
  writeHeatmap(options.heatmap, w, h, map, top > 0 ? static_cast<double>(top) : 1);
}

void print(Terminal& terminal, const Comparison& c, const std::vector<std::string>& failures) {
  terminal.print(differenceTable(c));
  if (const std::string line = nonFiniteLine(c.all); !line.empty()) terminal.print(line);
  terminal.print(flipTable(c));
  for (const std::string& line : failures)
    terminal.print(terminal.paint(Colour::kRed, "FAILED") + " " + line);
}

}  // namespace

int compare(const CompareOptions& options) {
  const ExrPart a = readExr(options.reference), b = readExr(options.test);
  requireSameWindow(options, a, b);
  if (options.flip && colourLayers(a.image).empty())
    throw UsageError(fmt::format("--flip: {} has no channels R, G and B, but {}; use --max",
                                 options.reference.string(), fmt::join(a.image.channels, " ")));
  const Comparison c = compared(a.image, b.image);
  const std::vector<std::string> failures = exceeded(c, options);
  Terminal terminal(options.json == "-" ? stderr : stdout);
  print(terminal, c, failures);
  if (!options.heatmap.empty()) writeHeatmapOf(c, options, a.image, b.image);
  if (!options.json.empty()) writeJson(c, options, a.image, failures);
  return failures.empty() ? kGood : kWrong;
}

}  // namespace gnomon
