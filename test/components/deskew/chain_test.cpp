#include <gtest/gtest.h>

#include <map>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/deskew_component/deskew_component.hpp"
#include "camvox/simulation/simulator.hpp"
#include "camvox/sync_component/sync_component.hpp"
#include "camvox/test/simulated_messages.hpp"

// A simulated robot's messages through sync and deskew, against the simulation's truth.
namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;
using geometry::SE3;
using simulation::ImuSample;
using simulation::LidarScan;
using test::set_stamp;
using test::to_message;

constexpr std::uint32_t kWidth = 64, kHeight = 48;
constexpr std::int64_t kFrame_ns = 100'000'000;

simulation::SimulationOptions noiseless(const std::string& preset) {
  auto options = simulation::preset(preset);
  options.duration_s = 3.05;
  options.images = false;
  options.lidar.range_sigma_m = options.lidar.angle_sigma_deg = 0.0;
  options.lidar.beam_width_deg = options.lidar.beam_height_deg = 0.0;
  options.lidar.drop_probability = 0.0;
  return options;
}

/// The simulated robot, sync, deskew, and a tracker that knows the truth.
class Chain : public ::testing::TestWithParam<const char*> {
 protected:
  Chain() {
    sync_fake_.set_parameter("scan_window", std::string(GetParam()));
    sync_fake_.set_parameter("camera.width_px", std::int64_t{kWidth});
    sync_fake_.set_parameter("camera.height_px", std::int64_t{kHeight});
    sync_fake_.set_parameter("noise_filter", std::string("off"));
    sync_ = std::make_unique<SyncComponent>(sync_fake_);
    deskew_ = std::make_unique<DeskewComponent>(deskew_fake_);
  }

  [[nodiscard]] SE3 T_world_body(std::int64_t stamp_ns) const {
    const auto time_ns = static_cast<double>(stamp_ns - options_.start_stamp_ns);
    return simulator_.trajectory().pose(1e-9 * time_ns);
  }

  void send(const simulation::Event& event) {
    if (const auto* sample = std::get_if<ImuSample>(&event.message)) {
      sync_fake_.send("imu", to_message(*sample));
    } else if (const auto* scan = std::get_if<LidarScan>(&event.message)) {
      sensor_msgs::msg::Image image;  // triggered at the scan's start, as the camera would be
      set_stamp(image, scan->stamp_ns);
      image.width(kWidth);
      image.height(kHeight);
      image.step(kWidth);
      image.encoding("mono8");
      image.data().resize(kWidth * kHeight);
      sync_fake_.send("image", image);
      sync_fake_.send("lidar", to_message(*scan));
      truth_.emplace(scan->stamp_ns, *scan);
    }
  }

  /// Deskews what sync has made since the last call.
  void pass_on() {
    const auto scans = sync_fake_.published<msg::Scan>("scan");
    for (; passed_on_ < scans.size(); ++passed_on_) {
      const auto& scan = *scans[passed_on_];
      deskew_fake_.send("scan", scan);
      constexpr std::size_t kSettling = 12;
      if (passed_on_ >= kSettling) judge(scan, *deskew_fake_.published<msg::Cloud>("cloud").back());
      msg::FramePose pose;
      pose.header().stamp_ns(scan.image_stamp_ns());
      pose.header().frame_id(scan.header().frame_id());
      pose.state(msg::TRACKING_OK);
      pose.T_map_camera(
          conversion::to_array(T_world_body(scan.image_stamp_ns()) * rig_.T_body_camera));
      pose.T_keyframe_camera(pose.T_map_camera());
      deskew_fake_.send("frame_pose", pose);
    }
  }

  void judge(const msg::Scan& scan, const msg::Cloud& cloud) {
    const auto begin_ns = scan.header().stamp_ns();
    const auto source = truth_.find(begin_ns - (begin_ns - options_.start_stamp_ns) % kFrame_ns);
    ASSERT_NE(source, truth_.end());
    const auto& [scan_ns, simulated] = *source;
    ASSERT_EQ(simulated.points.size(), cloud.points_count());
    EXPECT_EQ(cloud.deskew(), msg::DESKEW_GYRO_AND_VELOCITY);
    const SE3 T_image_scan = (T_world_body(scan.image_stamp_ns()) * rig_.T_body_lidar()).inverse() *
                             T_world_body(scan_ns) * rig_.T_body_lidar();
    for (std::size_t i = 0; i < cloud.points_count(); ++i) {
      if (simulated.truth[i].moving) continue;
      const auto& row = cloud.points()[i];
      const Eigen::Vector3d p(
          static_cast<double>(row[0]), static_cast<double>(row[1]), static_cast<double>(row[2]));
      sum_m2_ += (p - T_image_scan * simulated.truth[i].p_lidar_stamp.cast<double>()).squaredNorm();
      ++count_;
    }
  }

  simulation::SimulationOptions options_ = noiseless("demo");
  simulation::Simulator simulator_{options_, 2};
  sensors::RigCalibration rig_ = simulator_.true_rig();
  FakeContext sync_fake_{"sync"}, deskew_fake_{"deskew"};
  std::unique_ptr<SyncComponent> sync_;
  std::unique_ptr<DeskewComponent> deskew_;
  std::map<std::int64_t, LidarScan> truth_;
  std::size_t passed_on_ = 0;
  double sum_m2_ = 0.0;
  std::size_t count_ = 0;
};

TEST_P(Chain, CloudsAgreeWithTheTruthAtTheImagesTime) {
  while (const auto event = simulator_.next()) {
    send(*event);
    pass_on();
  }
  ASSERT_GT(count_, 50'000U);
  const double rms_m = std::sqrt(sum_m2_ / static_cast<double>(count_));
  RecordProperty("rms_mm", std::to_string(1e3 * rms_m));
  // Whole millimetres, and a gyro bias of 3 mrad/s that three seconds have not quite revealed.
  EXPECT_LT(rms_m, 0.01);
}
INSTANTIATE_TEST_SUITE_P(Windows,
                         Chain,
                         ::testing::Values("before", "after"),
                         [](const auto& given) { return std::string(given.param); });

}  // namespace
}  // namespace camvox
