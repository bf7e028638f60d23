#include <cmath>

#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A folder as `camvox run --out` leaves it.
class CommandReport : public CommandFixture {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::string poses;
    std::string frames = "head\n";
    for (int i = 0; i < 100; ++i) {
      const double t = 0.1 * i;
      poses += std::to_string(100.0 + t) + " " + std::to_string(t) + " " +
               std::to_string(std::sin(t)) + " " + std::to_string(0.1 * t) + " 0 0 0 1\n";
      frames += std::to_string(i + 1) + "," +
                std::to_string(100'000'000'000 + i * std::int64_t{100'000'000}) + "," +
                (i < 90 ? "ok" : "lost") + ",1,0,1500,1200,800,700,20.5\n";
    }
    put("trajectory.tum", poses);
    put("frames.csv", frames);
    put("timing.csv", "head\ndeskew,100,0.5,0.5,0.6,0.7,0.8\n");
    put("config.yaml", "container: <none>\n");
    put("depth_overlay.png", std::string("\x89PNG\0x", 6));
  }

  void put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  [[nodiscard]] std::string page() const {
    std::ifstream stream(folder_ / "report.html");
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder_ = write("report", "") + ".d";
};

TEST_F(CommandReport, PageShowsEverythingAndNeedsNothingElse) {
  const auto result = command({"report", folder_, "--reference", folder_ / "trajectory.tum"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("report.html"));
  const auto html = page();
  EXPECT_THAT(html, HasSubstr("90 of 100"));
  EXPECT_THAT(html, HasSubstr("APE rmse<b>0.000 m</b>"));
  EXPECT_THAT(html, HasSubstr("Trajectory from above"));
  EXPECT_THAT(html, HasSubstr("<td>deskew</td><td>100</td>"));
  EXPECT_THAT(html, HasSubstr("<td>0.89</td>")) << "the paper's figure beside ours";
  EXPECT_THAT(html, HasSubstr("data:image/png;base64,iVBORwB4\"")) << "\\x89PNG\\0x";
  EXPECT_THAT(html, HasSubstr("container: &lt;none&gt;"));
  EXPECT_THAT(html, Not(HasSubstr("src=\"http")));
}

TEST_F(CommandReport, ShowsWhatWasBeforeFirst) {
  for (const auto* name : {"calibration_after", "top_view", "calibration_before"}) {
    put(std::string(name) + ".png", "\x89PNG");
  }
  EXPECT_EQ(command({"report", folder_}).exit_code, 0);
  const auto html = page();
  const auto at = [&html](const char* caption) { return html.find(caption); };
  EXPECT_LT(at("calibration before"), at("calibration after"));
  EXPECT_LT(at("calibration after"), at("depth overlay"));
  EXPECT_LT(at("depth overlay"), at("top view"));
  EXPECT_NE(at("top view"), std::string::npos);
}

TEST_F(CommandReport, WithoutAReferenceThereAreNoErrors) {
  EXPECT_EQ(command({"report", folder_}).exit_code, 0);
  EXPECT_THAT(page(), HasSubstr("No reference was given"));
  EXPECT_THAT(page(), Not(HasSubstr("APE rmse")));
}

TEST_F(CommandReport, NamesTheFileThatIsWrong) {
  put("frames.csv", "head\n1,2,3\n");
  const auto broken = command({"report", folder_});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_THAT(broken.output, HasSubstr("frames.csv:2: not a line of such a file"));
  std::filesystem::remove(folder_ / "timing.csv");
  put("frames.csv", "head\n");
  EXPECT_THAT(command({"report", folder_}).output, HasSubstr("timing.csv: cannot be read"));
  put("timing.csv", "head\n");
  EXPECT_THAT(command({"report", folder_}).output, HasSubstr("the run saw no frame"));
}

}  // namespace
}  // namespace camvox::bringup
