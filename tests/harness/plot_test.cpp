// Plots as SVG. Covered: well-formed XML that refers to nothing outside; text escaped; points where
// the axes say; the same line the same colour in every panel; what cannot be shown is refused.
// Not covered: what it looks like (docs/objects.svg).
#include <cmath>
#include <limits>
#include <regex>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/report/plot.h"
#include "tests/xml.h"

namespace gnomon {
namespace {

Plot plotOf(std::vector<PlotPanel> panels) {
  const auto tick = [](double value) { return fmt::format("{:g}", value); };
  return {.title = "Title",
          .subtitle = "Subtitle",
          .xLabel = "objects",
          .yLabel = "time",
          .xTick = tick,
          .yTick = tick,
          .panels = std::move(panels)};
}

std::vector<std::string> allOf(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i)
    found.push_back(i->str(1));
  return found;
}

TEST(Plot, IsOneXmlDocumentWithNothingFromOutside) {
  const std::string svg = svgOf(plotOf(
      {{"a", {{"one", false, {{100, 1}, {1000, 20}}}}}, {"b", {{"two", true, {{100, 3}}}}}}));
  EXPECT_EQ(xmlFault(svg), "") << svg;
  EXPECT_EQ(svg.find("href"), svg.npos);
  EXPECT_EQ(svg.find("url("), svg.npos);
  EXPECT_EQ(svg.find("<script"), svg.npos);
}

TEST(Plot, EscapesWhatItIsTold) {
  Plot plot = plotOf({{"<panel> & \"co\"", {{"a<b", false, {{1, 1}}}}}});
  plot.title = "R&D <x>";
  plot.xTick = [](double) { return "<"; };
  const std::string svg = svgOf(plot);
  EXPECT_EQ(xmlFault(svg), "") << svg;
  EXPECT_NE(svg.find("R&amp;D &lt;x&gt;"), svg.npos);
}

TEST(Plot, PutsPointsWhereTheAxesSay) {
  // Three decades of x and two of y: (10^1.5, 10^1) is in the middle.
  const std::string svg =
      svgOf(plotOf({{"", {{"line", false, {{1, 1}, {std::pow(10, 1.5), 10}, {1000, 100}}}}}}));
  const auto xs = allOf(svg, "<circle cx=\"([0-9.]+)\""), ys = allOf(svg, "cy=\"([0-9.]+)\"");
  ASSERT_GE(xs.size(), 3u);
  // Printed to a tenth of a pixel, so that halves are off by that.
  EXPECT_NEAR(std::stod(xs[1]), (std::stod(xs[0]) + std::stod(xs[2])) / 2, 0.11);
  EXPECT_NEAR(std::stod(ys[1]), (std::stod(ys[0]) + std::stod(ys[2])) / 2, 0.11);
  EXPECT_LT(std::stod(xs[0]), std::stod(xs[2]));
  EXPECT_GT(std::stod(ys[0]), std::stod(ys[2])) << "y grows upward";
  for (const char* tick : {">1<", ">10<", ">100<", ">1000<"})
    EXPECT_NE(svg.find(tick), svg.npos) << tick;
}

TEST(Plot, HasOneColourALineInEveryPanelAndInTheLegend) {
  const PlotLine one{"one", false, {{1, 1}}}, two{"two", false, {{1, 2}}};
  const std::string svg = svgOf(plotOf({{"a", {one, two}}, {"b", {two, one}}}));
  const auto colours = allOf(svg, "<g stroke=\"(#[0-9a-f]+)\"");
  ASSERT_EQ(colours.size(), 6u);  // two panels, and the legend
  EXPECT_NE(colours[0], colours[1]);
  EXPECT_EQ(colours[0], colours[3]);
  EXPECT_EQ(colours[1], colours[2]);
  EXPECT_EQ(colours[0], colours[4]);
}

TEST(Plot, RefusesWhatHasNoPlace) {
  const auto one = [](double x, double y) { return plotOf({{"", {{"line", false, {{x, y}}}}}}); };
  EXPECT_THROW(svgOf(one(0, 1)), std::logic_error);
  EXPECT_THROW(svgOf(one(1, -1)), std::logic_error);
  EXPECT_THROW(svgOf(one(std::numeric_limits<double>::quiet_NaN(), 1)), std::logic_error);
  EXPECT_THROW(svgOf(one(1, std::numeric_limits<double>::infinity())), std::logic_error);
  EXPECT_THROW(svgOf(plotOf({})), std::logic_error);
  EXPECT_EQ(xmlFault(svgOf(one(5, 5))), "") << "one point is enough";
}

TEST(XmlFault, FindsWhatIsBroken) {
  EXPECT_EQ(xmlFault("<a b=\"1\"><c/>x &amp; y</a>"), "");
  for (const char* broken : {"<a>", "<a></b>", "<a/><b/>", "<a b=1/>", "<a b=\"1\" b=\"2\"/>",
                             "<a>&</a>", "<a b=\"&\"/>", "", "<a <b/>"})
    EXPECT_NE(xmlFault(broken), "") << broken;
}

}  // namespace
}  // namespace gnomon
