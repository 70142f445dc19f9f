#include "harness/report/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "harness/report/xml.h"

namespace gnomon {
namespace {

// Pixels.
constexpr double kPanelWidth = 400, kPanelHeight = 340;
constexpr double kLeft = 72, kLabel = 12, kTop = 76, kGap = 28, kBelow = 52, kMargin = 16;
constexpr double kLegendRow = 20, kLegendColumn = 200, kSwatch = 30;
constexpr double kMarker = 3.2;

// Okabe and Ito 2008, "Color Universal Design": told apart by everybody, and all dark enough for
// lines on white (its yellow and sky blue are not here).
constexpr std::array kColours = {"#0072b2", "#d55e00", "#009e73", "#000000",
                                 "#cc79a7", "#8a6d00", "#7a4fb5"};

/// Whole decades that hold all values.
struct Axis {
  double least = std::numeric_limits<double>::infinity(), most = 0;

  void hold(double value) {
    if (!(value > 0) || !std::isfinite(value))
      throw std::logic_error(fmt::format("{} has no place on a logarithmic axis", value));
    least = std::min(least, value);
    most = std::max(most, value);
  }
  int first() const { return static_cast<int>(std::floor(std::log10(least) + 1e-9)); }
  int last() const {
    return std::max(static_cast<int>(std::ceil(std::log10(most) - 1e-9)), first() + 1);
  }
  /// 0 at the first decade, 1 at the last.
  double at(double value) const { return (std::log10(value) - first()) / (last() - first()); }
};

class Drawing {
 public:
  explicit Drawing(const Plot& p) : plot(p) {
    for (const PlotPanel& panel : plot.panels)
      for (const PlotLine& line : panel.lines) {
        if (std::ranges::find(names, line.name, &PlotLine::name) == names.end())
          names.push_back({line.name, line.dashed, {}});
        for (const PlotPoint& point : line.points) {
          x.hold(point.x);
          y.hold(point.y);
        }
      }
    if (x.most == 0) throw std::logic_error("a plot of nothing");
  }

  std::string draw() {
    const auto panels = static_cast<double>(plot.panels.size());
    const double width = kLeft + panels * kPanelWidth + (panels - 1) * kGap + kMargin;
    const auto columns = static_cast<std::size_t>((width - kLeft) / kLegendColumn);
    const std::size_t rows = (names.size() + columns - 1) / columns;
    const double legendTop = kTop + kPanelHeight + kBelow;
    const double height = legendTop + static_cast<double>(rows) * kLegendRow + kMargin;
    text = fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {0} {1}" width="{0}" height="{1}" font-family="sans-serif" font-size="12" fill="#24292f">
<title>{2}</title>
<rect width="{0}" height="{1}" fill="#ffffff"/>
)",
        width, height, escapedXml(plot.title));
    write(kLeft, 24, plot.title, R"(font-size="16" font-weight="bold")");
    write(kLeft, 44, plot.subtitle, R"(fill="#57606a")");
    double left = kLeft;
    for (const PlotPanel& panel : plot.panels) {
      drawPanel(panel, left, left == kLeft);
      left += kPanelWidth + kGap;
    }
    const double middle = kTop + kPanelHeight / 2;
    write(kLabel, middle, plot.yLabel,
          fmt::format("text-anchor=\"middle\" transform=\"rotate(-90 {} {})\"", kLabel, middle));
    for (std::size_t i = 0; i < names.size(); ++i)
      drawKey(names[i], kLeft + kLegendColumn * static_cast<double>(i % columns),
              legendTop + kLegendRow * static_cast<double>(i / columns));
    return text + "</svg>\n";
  }

 private:
  void write(double atX, double atY, const std::string& what, const std::string& how) {
    text += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", atX, atY, how,
                        escapedXml(what));
  }

  void rule(double x1, double y1, double x2, double y2, const char* colour) {
    text += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1,
        x2, y2, colour);
  }

  void drawPanel(const PlotPanel& panel, double left, bool labelled) {
    const double bottom = kTop + kPanelHeight;
    write(left + kPanelWidth / 2, kTop - 8, panel.title,
          R"(text-anchor="middle" font-weight="bold")");
    for (int decade = x.first(); decade <= x.last(); ++decade) {
      const double value = std::pow(10, decade), at = left + kPanelWidth * x.at(value);
      rule(at, kTop, at, bottom, "#d8dee4");
      write(at, bottom + 16, plot.xTick(value), R"(text-anchor="middle")");
    }
    for (int decade = y.first(); decade <= y.last(); ++decade) {
      const double value = std::pow(10, decade), at = bottom - kPanelHeight * y.at(value);
      rule(left, at, left + kPanelWidth, at, "#d8dee4");
      if (labelled) write(left - 6, at + 4, plot.yTick(value), R"(text-anchor="end")");
    }
    rule(left, kTop, left, bottom, "#57606a");
    rule(left, bottom, left + kPanelWidth, bottom, "#57606a");
    write(left + kPanelWidth / 2, bottom + 36, plot.xLabel, R"(text-anchor="middle")");
    for (const PlotLine& line : panel.lines) drawLine(line, left);
  }

  std::string stroke(const PlotLine& line) const {
    const auto found = std::ranges::find(names, line.name, &PlotLine::name);
    const auto index = static_cast<std::size_t>(found - names.begin());
    return fmt::format(R"(stroke="{}" stroke-width="2" fill="none"{})",
                       kColours[index % kColours.size()],
                       line.dashed ? R"( stroke-dasharray="6 4")" : "");
  }

  void drawLine(const PlotLine& line, double left) {
    std::string corners, dots;
    for (const PlotPoint& p : line.points) {
      const double atX = left + kPanelWidth * x.at(p.x);
      const double atY = kTop + kPanelHeight * (1 - y.at(p.y));
      corners += fmt::format("{:.1f},{:.1f} ", atX, atY);
      dots += dot(atX, atY);
    }
    text += fmt::format("<g {}>\n<title>{}</title>\n<polyline points=\"{}\"/>\n{}</g>\n",
                        stroke(line), escapedXml(line.name), corners, dots);
  }

  void drawKey(const PlotLine& line, double left, double top) {
    text += fmt::format(
        "<g {}>\n<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n{}</g>\n",
        stroke(line), left, top, left + kSwatch, top, dot(left + kSwatch / 2, top));
    write(left + kSwatch + 8, top + 4, line.name, "");
  }

  static std::string dot(double atX, double atY) {
    return fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"#ffffff\" "
        "stroke-dasharray=\"none\"/>\n",
        atX, atY, kMarker);
  }

  const Plot& plot;
  std::vector<PlotLine> names{};  // without points
  Axis x{}, y{};
  std::string text{};
};

}  // namespace

std::string svgOf(const Plot& plot) { return Drawing(plot).draw(); }

}  // namespace gnomon
