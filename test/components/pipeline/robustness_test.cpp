// What goes wrong on a robot, on images, through all components: a drive over a plaza with people.
#include "pipeline_fixture.hpp"

namespace camvox::test {
namespace {

constexpr double kDuration_s = 9.0;
constexpr double kBegin_s = 4.0;

class Robustness : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { recording_ = std::make_unique<Recording>("demo", kDuration_s); }
  static void TearDownTestSuite() { recording_.reset(); }

  std::vector<JudgedFrame> drive(const Mishap& mishap = {}) {
    return run(pipeline_, *recording_, mishap);
  }
  /// All pixels have that value from kBegin_s to kBegin_s + 2.
  static Mishap flat(std::uint8_t value) {
    return [value](SensorMessage& sent) {
      const bool gone = sent.time_s >= kBegin_s && sent.time_s < kBegin_s + 2.0;
      if (auto* image = std::get_if<sensor_msgs::msg::Image>(&sent.message); image && gone) {
        std::ranges::fill(image->data(), value);
      }
      return true;
    };
  }

  inline static std::unique_ptr<Recording> recording_;
  Pipeline pipeline_{*recording_};
};

TEST_F(Robustness, NothingGoesWrong) {
  const auto frames = drive();
  EXPECT_GE(frames.size(), 88U);
  EXPECT_EQ(tracked_share(frames, 0.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.1);
}

TEST_F(Robustness, TwoBlackSeconds) {
  const auto frames = drive(flat(0));
  EXPECT_EQ(tracked_share(frames, kBegin_s, kBegin_s + 2.0), 0.0);
  EXPECT_EQ(tracked_share(frames, kBegin_s + 2.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.2);
}

TEST_F(Robustness, TwoWashedOutSeconds) {
  const auto frames = drive(flat(255));
  EXPECT_EQ(tracked_share(frames, kBegin_s, kBegin_s + 2.0), 0.0);
  EXPECT_EQ(tracked_share(frames, kBegin_s + 2.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.2);
}

TEST_F(Robustness, HalfOfTheFramesAreDropped) {
  int images = 0;
  const auto frames = drive([&](SensorMessage& sent) { return !is_image(sent) || ++images % 2; });
  EXPECT_GE(frames.size(), 43U);
  EXPECT_EQ(tracked_share(frames, 0.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.15);
}

TEST_F(Robustness, NoImuComes) {
  const auto frames = drive([](SensorMessage& sent) { return !is_imu(sent); });
  EXPECT_EQ(tracked_share(frames, 0.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.2);
}

TEST_F(Robustness, NoDepthForThreeSeconds) {
  const auto frames = drive([](SensorMessage& sent) {
    return !is_lidar(sent) || sent.time_s < kBegin_s || sent.time_s >= kBegin_s + 3.0;
  });
  EXPECT_EQ(tracked_share(frames, 0.5, kDuration_s), 1.0);
  EXPECT_LT(worst_m(frames), 0.2);
}

}  // namespace
}  // namespace camvox::test
