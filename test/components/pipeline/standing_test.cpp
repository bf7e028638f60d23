// A robot that goes nowhere: it stands, or turns on the spot.
#include "pipeline_fixture.hpp"

namespace camvox::test {
namespace {

using ::testing::HasSubstr;

double mean_m(const std::vector<JudgedFrame>& frames, double from_s, double to_s) {
  double sum_m = 0.0;
  int count = 0;
  for (const auto& frame : frames) {
    if (!frame.tracked() || frame.time_s < from_s || frame.time_s >= to_s) continue;
    sum_m += frame.error_m;
    ++count;
  }
  return sum_m / count;
}

// A minute of it is bench/robustness/standstill_bench.
TEST(Standstill, MakesNoKeyframesAndDoesNotDrift) {
  const Recording recording("standstill", 5.0);
  Pipeline pipeline(recording);
  const auto frames = run(pipeline, recording);
  EXPECT_EQ(tracked_share(frames, 0.1, 5.0), 1.0);
  EXPECT_EQ(pipeline.keyframes(), 1);
  EXPECT_LT(mean_m(frames, 4.0, 5.0), 0.01);
  // A frame alone, with pixels 2.5 times as wide as those of the rig's camera.
  EXPECT_LT(worst_m(frames), 0.025);
}

class Turning : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { recording_ = std::make_unique<Recording>("rotation", 8.0); }
  static void TearDownTestSuite() { recording_.reset(); }

  /// A pipeline whose focal length is wrong by that factor.
  static Pipeline::SetUp focal(double factor) {
    return [factor](FakeContext& context) {
      if (context.name() == "deskew") return;  // it looks at no image
      const auto& camera = recording_->options().intrinsics;
      context.set_parameter("camera.fx_px", factor * camera.fx_px);
      context.set_parameter("camera.fy_px", factor * camera.fy_px);
    };
  }

  inline static std::unique_ptr<Recording> recording_;
};

TEST_F(Turning, OnTheSpotIsFollowed) {
  Pipeline pipeline(*recording_);
  const auto frames = run(pipeline, *recording_);
  EXPECT_EQ(tracked_share(frames, 0.1, 8.0), 1.0);
  EXPECT_LT(worst_m(frames), 0.05);
  EXPECT_EQ(pipeline.tracking().diagnostics().status().level, HealthLevel::kOk);
}

// The gyro holds the camera's turns near its own, and what is left over looks like motion: the
// health must tell it all the same. An error of 5 % is hidden by that.
TEST_F(Turning, AWrongFocalLengthIsReported) {
  for (const double factor : {0.9, 1.1, 1.2}) {
    Pipeline pipeline(*recording_, focal(factor));
    run(pipeline, *recording_);
    const auto status = pipeline.tracking().diagnostics().status();
    EXPECT_EQ(status.level, HealthLevel::kWarn) << factor << ": " << status.message;
    EXPECT_THAT(status.message, HasSubstr(factor < 1.0 ? "more than the gyro" : "less")) << factor;
  }
}

}  // namespace
}  // namespace camvox::test
