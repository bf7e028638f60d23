#include <unistd.h>

#include <numbers>
#include <sstream>

#include "camvox/bringup/parameter_file.hpp"
#include "camvox/sensors/rig.hpp"
#include "command_fixture.hpp"

// Truth is the rig of the simulated recording.
namespace camvox::bringup {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Rendering on a machine with other work.
constexpr std::chrono::minutes kPatience(3);

/// The extrinsics of a rig.yaml.
geometry::SE3 T_camera_lidar_of(const fs::path& file) {
  std::vector<config::Problem> problems;
  auto parameters = read_parameter_file(file, problems);
  EXPECT_TRUE(problems.empty()) << file;
  config::ParameterMap of_rig;
  for (const auto& [key, parameter] : parameters) {
    if (key.starts_with("rig.")) of_rig.emplace(key.substr(4), parameter);
  }
  sensors::RigConfig rig;
  EXPECT_TRUE(config::load(of_rig, rig).empty()) << file;
  return sensors::make_rig_calibration(rig).T_camera_lidar();
}

double difference_deg(const geometry::SE3& a, const geometry::SE3& b) {
  return (a.rotation().inverse() * b.rotation()).angle_rad() * 180.0 / std::numbers::pi;
}

class CommandCalibrate : public CommandFixture {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("calibrate_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] Result patiently(const std::vector<std::string>& arguments) const {
    const auto process = begin(arguments);
    const int code = process->wait(kPatience);
    return {code, process->output()};
  }
  /// A robot that stands still, with a rig.yaml that is wrong.
  void simulate() {
    const auto result = patiently({"simulate",
                                   "standstill",
                                   "-o",
                                   folder_ / "bag",
                                   "--set",
                                   "duration_s=4",
                                   "--set",
                                   "camera.rate_hz=1",
                                   "--set",
                                   "extrinsics_error_deg=[2.0, -1.5, 1.0]"});
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }

  fs::path folder_;
};

TEST_F(CommandCalibrate, FindsTheRigOfARecording) {
  simulate();
  const auto bag = folder_ / "bag";
  const auto truth = T_camera_lidar_of(bag / "truth_rig.yaml");
  ASSERT_GT(difference_deg(truth, T_camera_lidar_of(bag / "rig.yaml")), 2.0);
  const auto output = folder_ / "result";
  const auto result = patiently({"calibrate", bag, "--parameters", bag / "rig.yaml", "-o", output});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("accepted"));
  EXPECT_LT(difference_deg(truth, T_camera_lidar_of(output / "rig.yaml")), 0.1) << result.output;
  EXPECT_GT(fs::file_size(output / "calibration_before.png"), 1000U);
  EXPECT_GT(fs::file_size(output / "calibration_after.png"), 1000U);

  // From its own result there is nothing to gain: refused, and no rig.yaml that says otherwise.
  const auto again =
      patiently({"calibrate", bag, "--parameters", output / "rig.yaml", "-o", folder_ / "again"});
  EXPECT_EQ(again.exit_code, 1) << again.output;
  EXPECT_THAT(again.output, HasSubstr("refused"));
  EXPECT_FALSE(fs::exists(folder_ / "again" / "rig.yaml"));
  EXPECT_TRUE(fs::exists(folder_ / "again" / "rig_refused.yaml"));

  const auto small = write("small.yaml", "camera: {width_px: 640, height_px: 480}\n");
  const auto wrong_size = command({"calibrate", bag, "--parameters", small, "-o", output});
  EXPECT_EQ(wrong_size.exit_code, 1);
  EXPECT_THAT(wrong_size.output, HasSubstr("the image"));
}

TEST_F(CommandCalibrate, SaysWhatIsWrongWithItsWords) {
  const auto rig = write("rig.yaml", "camera: {width_px: -1}\n");
  const auto bad = command({"calibrate", folder_, "--parameters", rig, "-o", folder_ / "result"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.output, HasSubstr("width_px"));
  const auto good = write("rig.yaml", "camera: {}\n");
  const auto no_bag =
      command({"calibrate", "/no/such/bag", "--parameters", good, "-o", folder_ / "result"});
  EXPECT_EQ(no_bag.exit_code, 1);
  EXPECT_THAT(no_bag.output, HasSubstr("/no/such/bag"));
}

}  // namespace
}  // namespace camvox::bringup
