#include "camvox/conversion/extrinsics_in_force.hpp"

#include <gtest/gtest.h>

#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {
namespace {

using geometry::SE3;

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

  ExtrinsicsInForce in_force_{SE3({}, {7.0, 0.0, 0.0})};
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
