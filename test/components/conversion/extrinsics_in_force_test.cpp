#include "camvox/conversion/extrinsics_in_force.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {
namespace {

using geometry::SE3;
using geometry::SO3;

class ExtrinsicsInForceTest : public ::testing::Test {
 protected:
  bool take(std::uint64_t version, std::int64_t stamp_ns, double x_m, std::uint8_t applied = 1) {
    camvox_interfaces::msg::Extrinsics extrinsics;
    extrinsics.header().stamp_ns(stamp_ns);
    extrinsics.version(version);
    extrinsics.applied(applied);
    extrinsics.T_camera_lidar(to_array(SE3({}, {x_m, 0.0, 0.0})));
    return in_force_.take(extrinsics);
  }
  [[nodiscard]] double x_m() const { return in_force_.T_camera_lidar().translation().x(); }

  static sensors::RigCalibration rig() {
    sensors::RigCalibration rig;
    rig.T_lidar_camera = SE3({}, {-7.0, 0.0, 0.0});
    rig.T_imu_lidar = SE3(SO3::exp({0.0, 0.0, 0.5 * std::numbers::pi}), {0.0, 2.0, 0.0});
    return rig;
  }

  ExtrinsicsInForce in_force_{rig()};
};

TEST_F(ExtrinsicsInForceTest, TheRigFilesUntilACalibrationPasses) {
  EXPECT_EQ(x_m(), 7.0);
  EXPECT_EQ(in_force_.version(), 0U);
  EXPECT_FALSE(take(1, 100, 1.0, 0)) << "a proposal";
  EXPECT_EQ(x_m(), 7.0);
  EXPECT_TRUE(take(1, 100, 1.0));
  EXPECT_EQ(x_m(), 1.0);
  EXPECT_EQ(in_force_.version(), 1U);
}

/// The lidar is 2 m along the IMU's y, which is the lidar's x and the camera's: these two are
/// parallel, and see the IMU 2 m behind the lidar.
TEST_F(ExtrinsicsInForceTest, TheImuMovesWithTheLidar) {
  const Eigen::Vector3d x_imu(1.0, 0.0, 0.0);
  for (const double lidar_m : {7.0, 1.0}) {
    const SE3 T_camera_imu = in_force_.T_camera_imu();
    EXPECT_LT((T_camera_imu.translation() - Eigen::Vector3d(lidar_m - 2.0, 0.0, 0.0)).norm(),
              1e-12);
    EXPECT_LT((T_camera_imu.rotation() * x_imu - Eigen::Vector3d(0.0, -1.0, 0.0)).norm(), 1e-12);
    (void)take(1, 100, 1.0);
  }
}

TEST_F(ExtrinsicsInForceTest, WhatIsRepeatedOrOlderIsNothingNew) {
  EXPECT_TRUE(take(3, 300, 3.0));
  EXPECT_FALSE(take(3, 300, 3.0)) << "repeated after a proposal that was refused";
  EXPECT_FALSE(take(2, 200, 2.0));
  EXPECT_EQ(x_m(), 3.0);
}

TEST_F(ExtrinsicsInForceTest, ARestartedCalibrationCountsFromOneAgain) {
  EXPECT_TRUE(take(3, 300, 3.0));
  EXPECT_TRUE(take(1, 400, 4.0));
  EXPECT_EQ(in_force_.version(), 1U);
  EXPECT_FALSE(take(1, 400, 4.0));
  EXPECT_TRUE(take(2, 500, 5.0));
  EXPECT_EQ(x_m(), 5.0);
}

TEST_F(ExtrinsicsInForceTest, AClockThatWasSetBackCountsOn) {
  EXPECT_TRUE(take(3, 300, 3.0));
  EXPECT_TRUE(take(4, 10, 4.0));
  EXPECT_TRUE(take(5, 20, 5.0));
  EXPECT_EQ(x_m(), 5.0);
}

TEST_F(ExtrinsicsInForceTest, AMessageThatWasNeverFilledChangesNothing) {
  camvox_interfaces::msg::Extrinsics empty;
  empty.version(1);
  empty.applied(1);
  EXPECT_THROW((void)in_force_.take(empty), std::logic_error);
  EXPECT_EQ(x_m(), 7.0);
  EXPECT_EQ(in_force_.version(), 0U);
}

}  // namespace
}  // namespace camvox::conversion
