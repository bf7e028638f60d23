#include "camvox/tracking/health.hpp"

#include <gmock/gmock.h>

namespace camvox::tracking {
namespace {

using testing::HasSubstr;

FrameResult good() {
  FrameResult result;
  result.state = TrackingState::kTracking;
  result.statistics = {1000, 600, 500, 450, 400, 0, 0.7};
  return result;
}

HealthMonitor after(const FrameResult& result, int frames) {
  HealthMonitor monitor;
  for (int i = 0; i < frames; ++i) monitor.add(result);
  return monitor;
}

TEST(HealthTest, GoodFramesAreFine) { EXPECT_EQ(after(good(), 100).status().level, Health::kOk); }

TEST(HealthTest, LostIsAnError) {
  FrameResult result;
  result.state = TrackingState::kLost;
  EXPECT_EQ(after(result, 1).status().level, Health::kError);
  EXPECT_THAT(after(result, 1).status().message, HasSubstr("next to nothing"));
}

TEST(HealthTest, ResidualsThatStayLargePointAtTheCalibration) {
  FrameResult result = good();
  result.statistics.chi2_per_row = 2.5;
  EXPECT_EQ(after(result, 3).status().level, Health::kOk) << "too early";
  EXPECT_EQ(after(result, 60).status().level, Health::kWarn);
  EXPECT_THAT(after(result, 60).status().message, HasSubstr("intrinsics"));
}

TEST(HealthTest, MatchesThatDisagreePointAtTheCalibration) {
  FrameResult result = good();
  result.statistics.inliers = 150;
  EXPECT_EQ(after(result, 60).status().level, Health::kWarn);
}

TEST(HealthTest, DepthThatDisagreesPointsAtTheExtrinsics) {
  FrameResult result = good();
  result.statistics.inliers_with_depth = 50;
  EXPECT_THAT(after(result, 100).status().message, HasSubstr("depth disagrees"));
  // No depth at all says nothing of the extrinsics.
  result.statistics.inliers_with_depth = 0;
  result.statistics.features_with_depth = 0;
  EXPECT_EQ(after(result, 200).status().level, Health::kOk);
}

/// A camera that is turned by 1 degree a frame, to and fro, and sees `scale` times that.
Health turning(double scale, double turn_deg, HealthMonitor* keep = nullptr) {
  HealthMonitor monitor;
  FrameResult result = good();
  for (int i = 0; i < 100; ++i) {
    const double turn_rad = (i / 20 % 2 == 0 ? 1.0 : -1.0) * turn_deg * 0.01745;
    const double noise_rad = (i % 2 == 0 ? 1.0 : -1.0) * 1e-3;
    const geometry::SO3 by_camera = geometry::SO3::exp({noise_rad, scale * turn_rad, 0.0});
    result.T_odom_camera =
        geometry::SE3(result.T_odom_camera.rotation() * by_camera, Eigen::Vector3d::Zero());
    monitor.add(result, geometry::SO3::exp({0.0, turn_rad, 0.0}));
  }
  if (keep != nullptr) *keep = monitor;
  return monitor.status().level;
}

TEST(HealthTest, TurnsThatTheGyroSeesOtherwisePointAtTheFocalLength) {
  EXPECT_EQ(turning(1.0, 1.0), Health::kOk);
  EXPECT_EQ(turning(1.02, 1.0), Health::kOk);
  HealthMonitor monitor;
  EXPECT_EQ(turning(1.25, 1.0, &monitor), Health::kWarn) << "configured 20 % too short";
  EXPECT_THAT(monitor.status().message, HasSubstr("25 % more than the gyro: focal length"));
  EXPECT_EQ(turning(0.9, 1.0, &monitor), Health::kWarn);
  EXPECT_THAT(monitor.status().message, HasSubstr("10 % less"));
  EXPECT_EQ(turning(1.25, 0.01), Health::kOk) << "next to no turn says nothing";
}

}  // namespace
}  // namespace camvox::tracking
