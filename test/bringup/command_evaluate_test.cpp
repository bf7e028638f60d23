#include <cmath>

#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using ::testing::HasSubstr;

using CommandEvaluate = CommandFixture;

/// A spiral in TUM format, 0.1 s apart, `factor` times as large.
std::string spiral(double factor, double start_s = 100.0) {
  std::string text;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 * i;
    text += std::to_string(start_s + t) + " " + std::to_string(factor * t * std::cos(t)) + " " +
            std::to_string(factor * t * std::sin(t)) + " " + std::to_string(factor * 0.2 * t) +
            " 0 0 0 1\n";
  }
  return text;
}

TEST_F(CommandEvaluate, PrintsTheFiguresAndWritesPlotAndJson) {
  const auto plot = write("plot.svg", "");
  const auto json = write("figures.json", "");
  const auto result = command({"evaluate",
                               write("reference.tum", spiral(1.0)),
                               write("estimate.tum", spiral(1.01)),
                               "--align",
                               "sim3",
                               "--delta",
                               "2",
                               "--plot",
                               plot,
                               "--json",
                               json});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("100 of 100 poses paired"));
  EXPECT_THAT(result.output, HasSubstr("scale error +1.000 %"));
  EXPECT_THAT(result.output, HasSubstr("| APE (m)            |    0.0000 |"));
  const auto text_of = [](const std::string& file) {
    std::ifstream stream(file);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  EXPECT_THAT(text_of(plot), HasSubstr("Trajectory from above"));
  EXPECT_THAT(text_of(json), HasSubstr("\"pairs\": 100,"));
}

TEST_F(CommandEvaluate, SaysWhyThereIsNothingToCompare) {
  const auto reference = write("reference.tum", spiral(1.0));
  const auto later = command({"evaluate", reference, write("later.tum", spiral(1.0, 500.0))});
  EXPECT_EQ(later.exit_code, 1);
  EXPECT_THAT(later.output, HasSubstr("see --offset and --max-difference"));
  const auto shifted =
      command({"evaluate", reference, write("later.tum", spiral(1.0, 500.0)), "--offset", "-400"});
  EXPECT_EQ(shifted.exit_code, 0) << shifted.output;
  const auto missing = command({"evaluate", reference, "/no/such/file"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("/no/such/file: cannot be read"));
  const auto line = write("line.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n");
  EXPECT_THAT(command({"evaluate", line, line}).output, HasSubstr("do not determine an alignment"));
  EXPECT_EQ(command({"evaluate", line, line, "--align", "origin"}).exit_code, 0);
}

TEST_F(CommandEvaluate, WritesPlotsAsWhatTheyAre) {
  const auto file = write("reference.tum", spiral(1.0));
  const auto png = command({"evaluate", file, file, "--plot", "/no/such/plot.png"});
  EXPECT_EQ(png.exit_code, 1);
  EXPECT_THAT(png.output, HasSubstr("--plot /no/such/plot.png: must end in .svg"));
}

std::string text_of(const std::string& plot) {
  std::ifstream stream(plot);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Along x, with a bend of `y` and of `z` (m), turning a little.
std::string path_of(double y, double z) {
  std::string text;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.05 * i;
    text += std::to_string(t) + " " + std::to_string(20.0 * t) + " " + std::to_string(y * t * t) +
            " " + std::to_string(z * t * t) + " 0 0 0.1 0.995\n";
  }
  return text;
}

// A straight drive over a bump goes farther in z than in y, and is seen from above all the same.
TEST_F(CommandEvaluate, ThePlanIsSeenFromAbove) {
  const auto plot = write("plan.svg", "");
  const auto bump = write("bump.tum", path_of(0.1, 0.3));
  ASSERT_EQ(command({"evaluate", bump, bump, "--plot", plot}).exit_code, 0);
  const auto above = text_of(plot);
  EXPECT_THAT(above, HasSubstr("Trajectory from above"));
  EXPECT_THAT(above, HasSubstr(">y (m)<"));
  const auto camera = write("camera.tum", path_of(0.1, 30.0));
  ASSERT_EQ(command({"evaluate", camera, camera, "--plot", plot}).exit_code, 0);
  const auto seen = text_of(plot);
  EXPECT_THAT(seen, HasSubstr("Trajectory seen along y"));
  EXPECT_THAT(seen, HasSubstr(">z (m)<"));
}

TEST_F(CommandEvaluate, SaysThatAPathIsALine) {
  const auto line = write("straight.tum", path_of(0.1, 0.0));
  const auto result = command({"evaluate", line, line});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("the path is nearly a line"));
  EXPECT_THAT(result.output, HasSubstr("| APE rotation (deg) |    0.0000 |"));
}

}  // namespace
}  // namespace camvox::bringup
