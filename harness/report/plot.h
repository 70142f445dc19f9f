// Curves over logarithmic axes, as one SVG file that needs nothing else.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace gnomon {

struct PlotPoint {
  double x = 0, y = 0;  ///< > 0
};

struct PlotLine {
  std::string name{};  ///< the same name is the same colour in every panel
  bool dashed = false;
  std::vector<PlotPoint> points{};
};

struct PlotPanel {
  std::string title{};
  std::vector<PlotLine> lines{};
};

/// Panels side by side with the same axes, and one legend, in the order in which names first occur.
struct Plot {
  std::string title{}, subtitle{};
  std::string xLabel{}, yLabel{};
  std::function<std::string(double)> xTick{}, yTick{};  ///< label of a power of ten
  std::vector<PlotPanel> panels{};
};

/// Programmer error where a value is not positive and finite, or there is nothing to show.
std::string svgOf(const Plot& plot);

}  // namespace gnomon
