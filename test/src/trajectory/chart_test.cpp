#include "camvox/trajectory/chart.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <regex>

namespace camvox::trajectory {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The coordinates in the path of the first series.
std::vector<double> first_line(const std::string& svg) {
  std::smatch match;
  const std::regex pattern("<path d=\"([^\"]*)\" fill=\"none\" stroke=\"#f00\"");
  EXPECT_TRUE(std::regex_search(svg, match, pattern));
  std::vector<double> values;
  const std::string path = match[1];
  const std::regex number("-?[0-9.]+");
  for (std::sregex_iterator i(path.begin(), path.end(), number), end; i != end; ++i) {
    values.push_back(std::stod(i->str()));
  }
  return values;
}

TEST(Chart, EqualScalesKeepAngles) {
  Chart chart;
  chart.equal_scales = true;
  chart.series = {{"square", "#f00", {{0, 0}, {10, 0}, {10, 10}}}};
  const auto line = first_line(to_svg(chart));
  ASSERT_EQ(line.size(), 6U);
  EXPECT_NEAR(line[2] - line[0], line[3] - line[5], 0.11) << "as far right as up, to a tenth px";
  EXPECT_GT(line[3], line[5]) << "y grows upwards";
}

TEST(Chart, FillsItsAreaOtherwise) {
  Chart chart;
  chart.series = {{"", "#f00", {{0, 0}, {1000, 1}}}};
  const auto line = first_line(to_svg(chart));
  EXPECT_GT(line[2] - line[0], 0.8 * chart.width_px);
  EXPECT_GT(line[1] - line[3], 0.6 * chart.height_px);
}

TEST(Chart, EscapesTextAndLeavesGaps) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Chart chart;
  chart.title = "a < b & c";
  chart.series = {{"", "#f00", {{0, 0}, {1, 1}, {2, nan}, {3, 0}, {4, 1}}}};
  const auto svg = to_svg(chart);
  EXPECT_THAT(svg, HasSubstr("a &lt; b &amp; c"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_EQ(first_line(svg).size(), 8U);
}

TEST(Chart, NothingAndOnePointDrawAnEmptyFrame) {
  EXPECT_THAT(to_svg({}), Not(HasSubstr("inf")));
  Chart chart;
  chart.series = {{"", "#f00", {{5, 5}}}};
  EXPECT_THAT(to_svg(chart), Not(HasSubstr("nan")));
}

TEST(Chart, LongLinesAreThinned) {
  Chart chart;
  chart.series = {{"", "#f00", {}}};
  for (int i = 0; i < 100000; ++i) chart.series[0].points.push_back({1e-3 * i, 0.0});
  EXPECT_LT(to_svg(chart).size(), 60000U);
}

}  // namespace
}  // namespace camvox::trajectory
