#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/lidar/force_unit.hpp"
#include "camvox/lidar/stationary.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/sync/depth_pairing.hpp"
#include "camvox/sync/frame_assembler.hpp"
#include "camvox/sync_component/depth_input.hpp"
#include "camvox/sync_component/image_input.hpp"
#include "camvox/sync_component/lidar_input.hpp"
#include "camvox/sync_component/sync_report.hpp"

namespace camvox {

/// Parameters of SyncComponent, beside those of sync::SyncConfig.
struct SyncComponentConfig {
  /// Where depth comes from: livox_ros_driver2, livox_interfaces (its older driver), both on
  /// /livox/lidar; point_cloud (sensor_msgs/PointCloud2); depth_image (an RGB-D camera).
  std::string depth_source = "livox_ros_driver2";
  std::string image_transport = "any";  ///< raw, compressed, or any: whichever comes.
  /// Of the frame images. mono8: all that tracking needs. yuv420: the same and colour, for the
  /// dense map. bgr8: for components outside that want nothing else; tracking must convert it.
  std::string encoding = "mono8";
  std::string noise_filter = "moderate";  ///< Livox tag: off, high, moderate or low confidence.
  std::string point_time_unit = "auto";   ///< Of a cloud's time field: auto, s, ms, us or ns.
  double row_time_s = 0.0;  ///< Rolling shutter: from one row to the next; frames get the stamp of
                            ///< the middle row.
  bool lockstep = false;    ///< Never hurry because of the time that passes: for lockstep replay.
  sync::SyncConfig sync;
  lidar::StationaryConfig stationary;
  sync_component::DepthInputConfig rgbd;
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("depth_source",
          self.depth_source,
          config::one_of({"livox_ros_driver2", "livox_interfaces", "point_cloud", "depth_image"}));
    field("image_transport", self.image_transport, config::one_of({"any", "raw", "compressed"}));
    field("encoding", self.encoding, config::one_of({"mono8", "yuv420", "bgr8"}));
    field("noise_filter", self.noise_filter, config::one_of({"off", "high", "moderate", "low"}));
    field("point_time_unit", self.point_time_unit, config::one_of({"auto", "s", "ms", "us", "ns"}));
    field("row_time_s", self.row_time_s, config::at_least(0.0), config::at_most(1e-3));
    field("lockstep", self.lockstep);
    sync::SyncConfig::visit(self.sync, field);
    field("stationary", self.stationary);
    field("rgbd", self.rgbd);
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

/// Makes frames of the sensors' streams: for every trigger one frame image and one scan (or one
/// depth image, of an RGB-D camera) with the same frame id, 1, 2, 3, ... See sync::FrameAssembler
/// for what belongs to a frame and how long it is waited for. Images are decoded when they come,
/// straight into the memory that tracking will read. A trigger without lidar data gets a scan
/// without points. Progress is reported for each image, also for those that made no frame.
class SyncComponent final : public Component {
 public:
  explicit SyncComponent(Context& context);

 private:
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using DepthImage = camvox_interfaces::msg::DepthImage;
  using Scan = camvox_interfaces::msg::Scan;

  void subscribe_camera();
  void subscribe_depth_source();
  template <typename Image>
  void on_image(const Image& image);
  void on_depth(const sensor_msgs::msg::Image& image);
  void on_imu(const sensor_msgs::msg::Imu& imu);
  template <typename Message, typename Read>
  void on_lidar(const Message& message, Read read);

  void publish_ready();
  void publish(const sync::Frame& frame);
  void write_scan(const sync::Frame& frame, Scan& scan, const FrameImage& image);
  void publish_depth(const sync::Frame& frame);
  void leave_out(std::int64_t stamp_ns, const std::string& why);
  void report_progress(std::int64_t stamp_ns, std::uint64_t frame_id);
  [[nodiscard]] bool has_lidar() const { return config_.depth_source != "depth_image"; }

  Context& context_;
  SyncComponentConfig config_;
  sync_component::LidarInputOptions lidar_options_;
  sync_component::ImageInput image_input_;
  sync::FrameAssembler assembler_;
  sync::DepthPairing<std::shared_ptr<Loan<DepthImage>>> depth_pairing_;
  lidar::ForceUnit force_unit_;
  lidar::StationaryDetector stationary_;
  sync_component::SyncReport report_;
  ProgressReporter progress_;
  Publisher<FrameImage> frame_images_;
  Publisher<Scan> scans_;
  Publisher<DepthImage> depth_images_;
  std::deque<Loan<FrameImage>> images_;  // of the pending frames
  std::uint64_t next_frame_id_ = 1;
  std::optional<std::int64_t> previous_image_ns_;
};

}  // namespace camvox
