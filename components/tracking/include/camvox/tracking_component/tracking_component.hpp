#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/conversion/extrinsics_in_force.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/tracking/frame_builder.hpp"
#include "camvox/tracking/health.hpp"
#include "camvox/tracking/tracker.hpp"
#include "camvox/tracking_component/frame_queue.hpp"
#include "camvox/tracking_component/keyframe_store.hpp"
#include "camvox/tracking_component/odometry_output.hpp"
#include "camvox/tracking_component/rotation_history.hpp"

namespace camvox {

/// Parameters of TrackingComponent.
struct TrackingComponentConfig {
  /// Process every frame in order, each on the map that was made of the frame before.
  bool lockstep = false;
  bool wait_for_map = true;  ///< In lockstep; false where no mapping runs.
  bool use_imu = true;       ///< Wait for the cloud of a frame too: it brings the gyro's rotation.
  std::string load_map;      ///< As mapping's: not "": find the place in that map first.
  bool localisation_only = false;  ///< Make no keyframes: the map stays as it is.
  /// Of the keyframes sent, the newest that mapping gets again if it lost them (some 200 kB each).
  /// When it lacks more than that, the older half of them is thinned out.
  int keyframes_kept = 300;
  tracking::TrackerConfig tracker;
  tracking::FrameBuilderConfig frame;
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("lockstep", self.lockstep);
    field("wait_for_map", self.wait_for_map);
    field("use_imu", self.use_imu);
    field("load_map", self.load_map);
    field("localisation_only", self.localisation_only);
    field("keyframes_kept", self.keyframes_kept, config::at_least(10));
    field("tracker", self.tracker);
    field("frame", self.frame);
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

/// Follows the camera: the pose of every frame, keyframes, odometry and transforms (see
/// tracking::Tracker). The keyframe of a frame is published before its pose. Live, the newest
/// complete frame counts and what it overtakes is dropped and counted; a frame whose depth does not
/// come is tracked without when the next one is complete. In lockstep a frame also waits for the
/// answer to the relocalisation request of the one before, if anybody listens to requests. Tracking
/// goes on without mapping; what mapping lacks when it is there (again), it gets sent again: all of
/// it up to `keyframes_kept`, and of a longer time what makes a coarser map in one piece.
/// Started anew while mapping goes on, it founds a map until it hears of the one that is there, and
/// then looks for its place in that. The gyro's turns are seen through the extrinsics in force.
class TrackingComponent final : public Component {
 public:
  explicit TrackingComponent(Context& context);

 private:
  using LocalMap = camvox_interfaces::msg::LocalMap;
  using Answer = camvox_interfaces::msg::RelocalisationAnswer;
  using FrameInputs = tracking_component::FrameInputs;

  void on_extrinsics(const camvox_interfaces::msg::Extrinsics& extrinsics);
  void on_map(const LocalMap& map);
  void on_answer(const Answer& answer);
  void send_again(const LocalMap& map);
  void remember_rotation(const camvox_interfaces::msg::Cloud& cloud);
  void process_ready();
  [[nodiscard]] bool may_process() const;
  void process(const FrameInputs& inputs);
  void begin_ids_anew();
  void make_room();
  [[nodiscard]] tracking::Frame make_frame(const FrameInputs& inputs);
  void publish(tracking::FrameResult& result, double time_s);
  void publish_keyframe(const tracking::Keyframe& keyframe,
                        Publisher<camvox_interfaces::msg::Keyframe>& publisher);
  void report(const tracking::FrameResult& result);

  Context& context_;
  TrackingComponentConfig config_;
  sensors::RigCalibration rig_;
  conversion::ExtrinsicsInForce extrinsics_;
  tracking::FrameBuilder builder_;
  tracking::Tracker tracker_;
  tracking::HealthMonitor health_;
  tracking_component::FrameQueue queue_;
  tracking_component::RotationHistory rotations_;
  tracking_component::KeyframeStore store_;
  tracking_component::OdometryOutput odometry_;
  ProgressReporter progress_;
  Publisher<camvox_interfaces::msg::FramePose> poses_;
  Publisher<camvox_interfaces::msg::Keyframe> keyframes_;
  Publisher<camvox_interfaces::msg::Keyframe> resent_keyframes_;
  Publisher<camvox_interfaces::msg::Keyframe> requests_;
  std::uint64_t last_frame_id_ = 0;
  std::uint64_t map_frame_id_ = 0;    ///< Of the newest local map.
  std::uint64_t awaited_answer_ = 0;  ///< In lockstep: to the request of this frame; 0: none.
  std::uint64_t keyframes_sent_ = 0;
  std::uint64_t keyframes_sent_again_ = 0;
  std::uint64_t keyframes_thinned_out_ = 0;
};

}  // namespace camvox
