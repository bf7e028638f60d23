#pragma once

#include <cstdint>

#include "camvox/component/context.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/tracking/frame.hpp"

namespace camvox::tracking_component {

/// What ROS wants to know of the pose (REP-105): Odometry of base_link in `odom`, which never
/// jumps; the transforms map -> odom, which takes the corrections, and odom -> base_link; the Path
/// in `map` while somebody reads it.
class OdometryOutput {
 public:
  OdometryOutput(Context& context, const geometry::SE3& T_body_camera);

  /// Sends all of it for a frame that has a pose.
  void publish(const tracking::FrameResult& result);

 private:
  void publish_odometry(const tracking::FrameResult& result, const geometry::SE3& T_odom_body);
  void publish_transforms(std::int64_t stamp_ns,
                          const geometry::SE3& T_map_odom,
                          const geometry::SE3& T_odom_body);
  void extend_path(std::int64_t stamp_ns, const geometry::SE3& T_map_body);

  geometry::SE3 T_body_camera_;
  geometry::SE3 T_camera_body_;
  Publisher<nav_msgs::msg::Odometry> odometry_;
  Publisher<tf2_msgs::msg::TFMessage> transforms_;
  Publisher<nav_msgs::msg::Path> path_publisher_;
  nav_msgs::msg::Path path_;
  geometry::SE3 T_map_body_last_;  ///< Of the path's last pose.
};

}  // namespace camvox::tracking_component
