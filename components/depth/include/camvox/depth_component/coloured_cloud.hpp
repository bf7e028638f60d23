#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "camvox/component/component.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::depth_component {

/// The edge topic "coloured_cloud": the returns of a scan in the camera's frame, each with the
/// colour of its pixel. Returns outside the image are left out, and those that the depth image
/// shows to lie behind a nearer surface: that surface's colour is not theirs. Made only while
/// somebody reads it. Image and cloud of a frame may come in either order.
class ColouredCloudOutput {
 public:
  /// Advertises the topic and subscribes to the frame images.
  ColouredCloudOutput(Context& context, const sensors::CameraIntrinsics& camera);

  void add(const camvox_interfaces::msg::Cloud& cloud,
           const camvox_interfaces::msg::DepthImage& depth,
           const geometry::SE3& T_camera_lidar);

 private:
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using PointCloud2 = sensor_msgs::msg::PointCloud2;
  struct VisibleReturn {
    Eigen::Vector3f p_camera;
    int u_px;
    int v_px;
  };
  struct Uncoloured {
    std::int64_t stamp_ns;
    std::vector<VisibleReturn> returns;
  };

  void publish_if_complete(std::uint64_t frame_id);

  sensors::CameraModel camera_;
  Publisher<PointCloud2> clouds_;
  std::map<std::uint64_t, Sample<FrameImage>> images_;  ///< That wait for their cloud,
  std::map<std::uint64_t, Uncoloured> uncoloured_;      ///< and clouds for their image.
};

}  // namespace camvox::depth_component
