#include "camvox/sensors/rig.hpp"

#include <gmock/gmock.h>

#include "camvox/sensors/imu_noise.hpp"
#include "camvox/sensors/lidar_model.hpp"

namespace camvox::sensors {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Rig, DefaultAxesAreThoseOfTheRobot) {
  const RigCalibration rig = make_rig_calibration();
  // What is ahead in the camera is ahead on the body; image right is body right (-y).
  EXPECT_LT((rig.T_body_camera.rotation() * Vector3d::UnitZ() - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((rig.T_body_camera.rotation() * Vector3d::UnitX() + Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((rig.T_body_lidar().rotation().matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((rig.T_body_imu().rotation().matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

TEST(Rig, DefaultLidarTranslationIsThePapers) {
  const Vector3d t_camera_lidar = make_rig_calibration().T_camera_lidar().translation();
  EXPECT_LT((t_camera_lidar - Vector3d(-0.082984, -0.0221759, 0.0727962)).norm(), 1e-12);
}

TEST(Rig, LidarSitsTenCentimetresAboveTheImu) {
  const RigCalibration rig = make_rig_calibration();
  const Vector3d difference = rig.T_body_lidar().translation() - rig.T_body_imu().translation();
  EXPECT_LT((difference - Vector3d(0, 0, 0.1)).norm(), 1e-12);
}

TEST(Rig, ConfigRoundTrip) {
  RigConfig config;
  config.T_lidar_camera.rotation_xyzw = {0.1, 0.7, -0.1, 0.7};
  config.imu_time_offset_ns = -5'000'000;
  const RigCalibration rig = make_rig_calibration(config);
  const RigCalibration again = make_rig_calibration(to_config(rig));
  EXPECT_LT(geometry::local(rig.T_lidar_camera, again.T_lidar_camera).norm(), 1e-12);
  EXPECT_EQ(again.imu_time_offset_ns, -5'000'000);
  RigConfig loaded;
  EXPECT_THAT(config::load(config::dump(config), loaded), IsEmpty());
  EXPECT_EQ(loaded.T_lidar_camera.rotation_xyzw, config.T_lidar_camera.rotation_xyzw);
}

TEST(Rig, BadRigGivesAllProblems) {
  RigConfig bad;
  bad.T_body_camera.translation_m = {1.0};
  bad.T_imu_lidar.rotation_xyzw = {0.0, 0.0, 0.0, 0.0};
  bad.p_body_gnss_m = {};
  try {
    (void)make_rig_calibration(bad);
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 3u);
    EXPECT_THAT(error.what(), HasSubstr("T_body_camera.translation_m: expected 3 numbers, got 1"));
    EXPECT_THAT(error.what(), HasSubstr("T_imu_lidar.rotation_xyzw"));
    EXPECT_THAT(error.what(), HasSubstr("p_body_gnss_m"));
  }
}

TEST(SensorModels, DefaultsAreValidAndBadValuesAreNot) {
  EXPECT_THAT(config::check(ImuNoise{}), IsEmpty());
  EXPECT_THAT(config::check(LidarModel{}), IsEmpty());
  LidarModel lidar;
  lidar.lines = 0;
  lidar.max_range_m = -1.0;
  EXPECT_EQ(config::check(lidar).size(), 2u);
}

}  // namespace
}  // namespace camvox::sensors
