#pragma once

#include <string>

#include "camvox/lidar/stationary.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/sync/frame_assembler.hpp"
#include "camvox/sync_component/depth_input.hpp"
#include "camvox/sync_component/lidar_input.hpp"

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

namespace sync_component {

/// Throws config::ConfigError with all problems of camera and rig.
[[nodiscard]] SyncComponentConfig checked(SyncComponentConfig config);

[[nodiscard]] sync::AssemblerOptions assembler_options(const SyncComponentConfig& config);
[[nodiscard]] LidarInputOptions lidar_input_options(const SyncComponentConfig& config);

}  // namespace sync_component
}  // namespace camvox
