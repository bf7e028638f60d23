#pragma once

#include <deque>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/conversion/extrinsics_in_force.hpp"
#include "camvox/depth/depth_projector.hpp"
#include "camvox/depth_component/coloured_cloud.hpp"
#include "camvox/depth_component/scan_accumulator.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox {

/// Parameters of DepthComponent.
struct DepthComponentConfig {
  int accumulate_scans = 1;  ///< Scans laid over each other: the newest, and those before it.
  bool lockstep = false;     ///< If they are more than one, cloud k waits for the pose of k-1.
  depth::DepthProjectorConfig projector;
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;  ///< T_lidar_camera, until a calibration says better.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("accumulate_scans",
          self.accumulate_scans,
          config::at_least(1),
          config::at_most(depth_component::ScanAccumulator::kMaxScans));
    field("lockstep", self.lockstep);
    field("projector", self.projector);
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

/// Projects each cloud into a depth image, straight into the memory that tracking reads. New
/// extrinsics that passed their gate take effect with the next cloud; each image carries their
/// version. While somebody reads them there are edge topics too: the depth as 32FC1 (m) and 16UC1
/// (mm), with its CameraInfo, and the scan as a coloured cloud.
class DepthComponent final : public Component {
 public:
  explicit DepthComponent(Context& context);

 private:
  using Cloud = camvox_interfaces::msg::Cloud;
  using DepthImage = camvox_interfaces::msg::DepthImage;
  using FramePose = camvox_interfaces::msg::FramePose;
  using Extrinsics = camvox_interfaces::msg::Extrinsics;
  using Image = sensor_msgs::msg::Image;
  using CameraInfo = sensor_msgs::msg::CameraInfo;

  void on_extrinsics(const Extrinsics& extrinsics);
  void on_cloud(const Sample<Cloud>& cloud);
  void on_pose(const FramePose& pose);
  void process_waiting();
  void process(const Cloud& cloud);
  void publish_edge_topics(const DepthImage& depth);

  Context& context_;
  DepthComponentConfig config_;
  depth::DepthProjector projector_;
  conversion::ExtrinsicsInForce extrinsics_;
  depth_component::ScanAccumulator accumulator_;
  std::deque<Sample<Cloud>> waiting_;  ///< In lockstep, for poses.
  std::uint64_t last_cloud_id_ = 0;
  std::uint64_t newest_pose_id_ = 0;
  ProgressReporter progress_;
  Publisher<DepthImage> depth_images_;
  Publisher<Image> metres_;
  Publisher<Image> millimetres_;
  Publisher<CameraInfo> camera_info_;
  depth_component::ColouredCloudOutput coloured_cloud_;
};

}  // namespace camvox
