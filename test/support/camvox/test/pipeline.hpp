#pragma once

#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/depth_component/depth_component.hpp"
#include "camvox/deskew_component/deskew_component.hpp"
#include "camvox/loop_closing/loop_closing_component.hpp"
#include "camvox/mapping_component/mapping_component.hpp"
#include "camvox/sync_component/sync_component.hpp"
#include "camvox/test/simulated_messages.hpp"
#include "camvox/tracking_component/tracking_component.hpp"

namespace camvox::test {

/// What drivers would send, in order of arrival.
struct SensorMessage {
  std::int64_t arrival_ns = 0;
  double time_s = 0.0;  ///< Since the recording began.
  std::variant<sensor_msgs::msg::Image, livox_ros_driver2::msg::CustomMsg, sensor_msgs::msg::Imu>
      message;
};

/// A simulated drive with a small camera and a sparse lidar, kept in memory, with its truth.
class Recording {
 public:
  Recording(const std::string& preset, double duration_s) : options_(small(preset, duration_s)) {
    simulation::Simulator simulator(options_, 2);
    while (auto event = simulator.next()) {
      std::visit([&](const auto& made) { add(event->arrival_ns, made); }, event->message);
    }
    trajectory_ = simulator.trajectory();
    rig_ = sensors::make_rig_calibration(options_.rig);
  }

  [[nodiscard]] const std::vector<SensorMessage>& messages() const { return messages_; }
  [[nodiscard]] const simulation::SimulationOptions& options() const { return options_; }
  [[nodiscard]] const sensors::RigCalibration& rig() const { return rig_; }
  [[nodiscard]] double time_s(std::int64_t stamp_ns) const {
    return 1e-9 * static_cast<double>(stamp_ns - options_.start_stamp_ns);
  }
  [[nodiscard]] geometry::SE3 T_world_body(std::int64_t stamp_ns) const {
    return trajectory_->pose(time_s(stamp_ns));
  }

 private:
  static simulation::SimulationOptions small(const std::string& preset, double duration_s) {
    auto options = simulation::preset(preset);
    constexpr double kScale = 0.4;
    auto& camera = options.intrinsics;
    camera.width_px = 608;
    camera.height_px = 228;
    camera.fx_px *= kScale;
    camera.fy_px *= kScale;
    camera.cx_px = (camera.cx_px + 0.5) * kScale - 0.5;
    camera.cy_px = (camera.cy_px + 0.5) * kScale - 0.5;
    options.lidar.point_interval_ns = 40'000;
    options.duration_s = duration_s;
    return options;
  }

  template <typename Made>
  void add(std::int64_t arrival_ns, const Made& made) {
    if constexpr (requires { to_message(made); }) {
      messages_.push_back({arrival_ns, time_s(made.stamp_ns), to_message(made)});
    }
  }

  simulation::SimulationOptions options_;
  std::optional<simulation::Trajectory> trajectory_;
  sensors::RigCalibration rig_;
  std::vector<SensorMessage> messages_;
};

/// All components of the pipeline, each in a context of its own, wired by their topics, in one
/// thread and lockstep. Sync's clock is the messages' time of arrival.
class Pipeline {
 public:
  using FramePose = camvox_interfaces::msg::FramePose;
  using SetUp = std::function<void(FakeContext& context)>;

  /// `set_up` may give each component further parameters.
  explicit Pipeline(const Recording& recording, const SetUp& set_up = {}) {
    for (auto* context : {&sync_, &deskew_, &depth_, &tracking_, &mapping_, &loop_closing_}) {
      give_parameters(recording, *context);
      if (set_up) set_up(*context);
    }
    components_.push_back(std::make_unique<SyncComponent>(sync_));
    components_.push_back(std::make_unique<DeskewComponent>(deskew_));
    components_.push_back(std::make_unique<DepthComponent>(depth_));
    components_.push_back(std::make_unique<TrackingComponent>(tracking_));
    components_.push_back(std::make_unique<MappingComponent>(mapping_));
    components_.push_back(std::make_unique<LoopClosingComponent>(loop_closing_));
    for (auto& component : components_) component->start();
    for (const auto* port : {"depth", "depth_mm", "camera_info", "coloured_cloud"}) {
      depth_.set_subscriber_count(port, 0);
    }
  }
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline() {
    for (auto& component : components_) component->stop();
  }

  void send(const SensorMessage& sent) {
    const auto now_ns = sync_.now_ns();
    if (first_) sync_.set_now_ns(sent.arrival_ns);
    if (!first_ && sent.arrival_ns > now_ns) {
      sync_.advance(std::chrono::nanoseconds(sent.arrival_ns - now_ns));
    }
    first_ = false;
    std::visit([this](const auto& message) { send_to_sync(message); }, sent.message);
    while (pass_everything_on()) {
    }
  }

  /// Every frame that was tracked so far, or not.
  [[nodiscard]] const std::vector<FramePose>& poses() const { return poses_; }
  [[nodiscard]] int keyframes() const { return keyframes_; }
  [[nodiscard]] FakeContext& sync() { return sync_; }
  [[nodiscard]] FakeContext& tracking() { return tracking_; }

 private:
  static void give_parameters(const Recording& recording, FakeContext& context);

  void send_to_sync(const sensor_msgs::msg::Image& image) { sync_.send("image", image); }
  void send_to_sync(const livox_ros_driver2::msg::CustomMsg& scan) { sync_.send("lidar", scan); }
  void send_to_sync(const sensor_msgs::msg::Imu& imu) { sync_.send("imu", imu); }

  bool pass_everything_on();
  template <typename T>
  bool pass_on(FakeContext& from, const char* port, std::vector<FakeContext*> readers) {
    const auto messages = from.take_published<T>(port);
    for (const auto& message : messages) {
      for (auto* reader : readers) reader->pass_on(port, message);
    }
    return !messages.empty();
  }

  FakeContext sync_{"sync"}, deskew_{"deskew"}, depth_{"depth"}, tracking_{"tracking"},
      mapping_{"mapping"}, loop_closing_{"loop_closing"};
  std::vector<std::unique_ptr<Component>> components_;
  std::vector<FramePose> poses_;
  int keyframes_ = 0;
  bool first_ = true;
};

}  // namespace camvox::test
