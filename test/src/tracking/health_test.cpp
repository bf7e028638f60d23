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

}  // namespace
}  // namespace camvox::tracking
