#include <unistd.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class CommandInspect : public CommandFixture {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(::testing::TempDir()) / ("inspect_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    simulate("bag", "");
    simulate("blind", " --set scans=false");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  /// A second of the demo with a small camera and few points.
  static void simulate(const std::string& name, const std::string& more) {
    const std::string words =
        std::string(CAMVOX_COMMAND) +
        " simulate demo --set duration_s=1.0 --set intrinsics.width_px=380"
        " --set intrinsics.height_px=142 --set intrinsics.fx_px=239.5"
        " --set intrinsics.fy_px=238.8 --set intrinsics.cx_px=197.6 --set intrinsics.cy_px=62.7"
        " --set lidar.point_interval_ns=40000" +
        more + " -o " + (folder_ / name).string() + " > /dev/null";
    ASSERT_EQ(std::system(words.c_str()), 0);
  }

  [[nodiscard]] Result inspect(const std::string& bag, const std::vector<std::string>& more) const {
    std::vector<std::string> words = {
        "inspect", "depth", "--bag", folder_ / bag, "--parameters", folder_ / "bag" / "rig.yaml"};
    words.insert(words.end(), more.begin(), more.end());
    return command(words);
  }

  inline static fs::path folder_;
};

TEST_F(CommandInspect, DrawsTheDepthOfAFrame) {
  const auto output = folder_ / "overlay.png";
  const auto result = inspect("bag", {"--frame", "5", "-o", output});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("frame 5    stamp 1700000000.400000000 s    depth in "));
  const auto picture = cv::imread(output);
  EXPECT_EQ(picture.cols, 760) << "twice as large, for the text";
  EXPECT_GT(picture.rows, 2 * 142);
}

TEST_F(CommandInspect, FollowsTheTopicNamesOfAConfig) {
  const auto config =
      write("own.yaml",
            "parameters: {use_imu: true}\n"
            "components:\n"
            "  - {plugin: camvox::SyncComponent, name: sync,\n"
            "     remap: {compressed_image: /front/jpeg}}\n"
            "  - {plugin: camvox::DeskewComponent, name: deskew}\n"
            "  - {plugin: camvox::DepthComponent, name: depth}\n"
            "  - {plugin: camvox::TrackingComponent, name: tracking}\n"
            "  - {plugin: camvox::ReplayComponent, name: replay, parameters: {remap:\n"
            "     [\"/camera/image_raw/compressed:=/front/jpeg\"]}}\n");
  const auto result =
      inspect("bag", {"--frame", "5", "-o", folder_ / "own.png", "--config", config});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("frame 5 "));
}

TEST_F(CommandInspect, DrawsTheFrameNearestToAStamp) {
  const auto result = inspect("bag", {"--stamp", "1700000000.62", "-o", folder_ / "stamp.png"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("frame 7 "));
}

TEST_F(CommandInspect, WhatIsNotThereIsSaidAndGivesNoPicture) {
  const auto output = folder_ / "none.png";
  const auto late = inspect("bag", {"--frame", "500", "-o", output});
  EXPECT_EQ(late.exit_code, 1);
  EXPECT_THAT(late.output, HasSubstr("there is no frame 500; frames go from 1 to "));
  const auto blind = inspect("blind", {"--frame", "5", "-o", output});
  EXPECT_EQ(blind.exit_code, 1);
  EXPECT_THAT(blind.output, HasSubstr("neither lidar points nor depth images"));
  const auto missing = inspect("nothing", {"-o", output});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("nothing"));
  EXPECT_FALSE(fs::exists(output));
}

TEST_F(CommandInspect, WrongWordsAreRefused) {
  EXPECT_EQ(inspect("bag", {"--frame", "5", "--stamp", "1.0"}).exit_code, 2);
  const auto zero = inspect("bag", {"--frame", "0"});
  EXPECT_EQ(zero.exit_code, 2);
  EXPECT_THAT(zero.output, HasSubstr("'0' is not a number above 0"));
  EXPECT_EQ(command({"inspect", "depth", "--bag", folder_ / "bag"}).exit_code, 2);
  EXPECT_EQ(command({"inspect"}).exit_code, 2);
  const auto picture = inspect("bag", {"-o", folder_ / "overlay.txt"});
  EXPECT_EQ(picture.exit_code, 1);
  EXPECT_THAT(picture.output, HasSubstr("must end in .png"));
  const auto rig = command({"inspect",
                            "depth",
                            "--bag",
                            folder_ / "bag",
                            "--parameters",
                            write("rig.yaml", "camera: {width_px: -3}\n")});
  EXPECT_EQ(rig.exit_code, 1);
  EXPECT_THAT(rig.output, HasSubstr("camera.width_px"));
}

}  // namespace
}  // namespace camvox::bringup
