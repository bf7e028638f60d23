#include "camvox/tracking_component/odometry_output.hpp"

#include "camvox/conversion/pose.hpp"
#include "camvox/interfaces/header.hpp"

namespace camvox::tracking_component {
namespace {

using geometry::SE3;
using interfaces::to_header;

constexpr std::size_t kMaxPathPoses = 4000;  // then every second goes
constexpr double kPathStep_m = 0.1;

template <typename Vector>
Vector to_message(const Eigen::Vector3d& v) {
  Vector message;
  message.x(v.x());
  message.y(v.y());
  message.z(v.z());
  return message;
}

geometry_msgs::msg::Quaternion to_message(const geometry::SO3& R) {
  const auto& q = R.quaternion();
  geometry_msgs::msg::Quaternion message;
  message.x(q.x());
  message.y(q.y());
  message.z(q.z());
  message.w(q.w());
  return message;
}

geometry_msgs::msg::Pose to_pose(const SE3& T) {
  geometry_msgs::msg::Pose pose;
  pose.position(to_message<geometry_msgs::msg::Point>(T.translation()));
  pose.orientation(to_message(T.rotation()));
  return pose;
}

geometry_msgs::msg::TransformStamped to_transform(std::int64_t stamp_ns,
                                                  const char* parent,
                                                  const char* child,
                                                  const SE3& T_parent_child) {
  geometry_msgs::msg::TransformStamped message;
  message.header(to_header(stamp_ns, parent));
  message.child_frame_id(child);
  message.transform().translation(
      to_message<geometry_msgs::msg::Vector3>(T_parent_child.translation()));
  message.transform().rotation(to_message(T_parent_child.rotation()));
  return message;
}

/// ROS orders [translation; rotation], along fixed axes at the body: ours is [rotation;
/// translation] of a right perturbation, in the body's axes.
std::array<double, 36> to_ros_covariance(const geometry::Matrix6d& covariance_body,
                                         const geometry::SO3& R_odom_body) {
  const Eigen::Matrix3d R = R_odom_body.matrix();
  geometry::Matrix6d J = geometry::Matrix6d::Zero();
  J.topRightCorner<3, 3>() = R;
  J.bottomLeftCorner<3, 3>() = R;
  return conversion::to_array(geometry::Matrix6d(J * covariance_body * J.transpose()));
}

}  // namespace

OdometryOutput::OdometryOutput(Context& context, const SE3& T_body_camera)
    : T_body_camera_(T_body_camera),
      T_camera_body_(T_body_camera.inverse()),
      odometry_(context.advertise<nav_msgs::msg::Odometry>({"odometry", topics::kOdometry})),
      transforms_(context.advertise<tf2_msgs::msg::TFMessage>({"tf", topics::kTransforms},
                                                              {.qos = qos::kTransforms})),
      path_publisher_(context.advertise<nav_msgs::msg::Path>({"path", topics::kPath})) {}

void OdometryOutput::publish(const tracking::FrameResult& result) {
  const SE3 T_odom_body = result.T_odom_camera * T_camera_body_;
  const SE3 T_map_body = result.T_map_camera * T_camera_body_;
  publish_odometry(result, T_odom_body);
  publish_transforms(result.stamp_ns, T_map_body * T_odom_body.inverse(), T_odom_body);
  extend_path(result.stamp_ns, T_map_body);
}

void OdometryOutput::publish_odometry(const tracking::FrameResult& result, const SE3& T_odom_body) {
  auto message = odometry_.loan();
  message->header(to_header(result.stamp_ns, "odom"));
  message->child_frame_id("base_link");
  message->pose().pose(to_pose(T_odom_body));
  const geometry::Matrix6d Ad = T_body_camera_.adjoint();
  message->pose().covariance(
      to_ros_covariance(Ad * result.covariance_camera * Ad.transpose(), T_odom_body.rotation()));
  geometry::Vector6d twist_camera;
  twist_camera << result.angular_velocity_camera, result.velocity_camera;
  const geometry::Vector6d twist_body = Ad * twist_camera;
  using geometry_msgs::msg::Vector3;
  message->twist().twist().angular(to_message<Vector3>(twist_body.head<3>()));
  message->twist().twist().linear(to_message<Vector3>(twist_body.tail<3>()));
  odometry_.publish(std::move(message));
}

void OdometryOutput::publish_transforms(std::int64_t stamp_ns,
                                        const SE3& T_map_odom,
                                        const SE3& T_odom_body) {
  auto message = transforms_.loan();
  message->transforms().push_back(to_transform(stamp_ns, "map", "odom", T_map_odom));
  message->transforms().push_back(to_transform(stamp_ns, "odom", "base_link", T_odom_body));
  transforms_.publish(std::move(message));
}

void OdometryOutput::extend_path(std::int64_t stamp_ns, const SE3& T_map_body) {
  auto& poses = path_.poses();
  const double step_m = (T_map_body.translation() - T_map_body_last_.translation()).norm();
  if (!poses.empty() && step_m < kPathStep_m) return;
  T_map_body_last_ = T_map_body;
  geometry_msgs::msg::PoseStamped pose;
  pose.header(to_header(stamp_ns, "map"));
  pose.pose(to_pose(T_map_body));
  poses.push_back(std::move(pose));
  if (poses.size() > kMaxPathPoses) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < poses.size(); i += 2) poses[kept++] = std::move(poses[i]);
    poses.resize(kept);
  }
  if (path_publisher_.subscriber_count() == 0) return;
  path_.header(to_header(stamp_ns, "map"));
  path_publisher_.publish(path_);
}

}  // namespace camvox::tracking_component
