#include "simulated_messages.hpp"

#include <cstring>

namespace camvox::import {
namespace {

Eigen::Isometry3d isometry(const geometry::SE3& T) { return Eigen::Isometry3d(T.matrix()); }

template <std::size_t N>
void set_diagonal(std::array<double, N>& covariance, double variance) {
  for (std::size_t i = 0; i < 3; ++i) covariance[4 * i] = variance;
}

/// Little-endian pixels of `encoding`.
sensor_msgs::msg::Image make_image(std::int64_t stamp_ns,
                                   int width_px,
                                   int height_px,
                                   const char* encoding,
                                   std::span<const std::byte> pixels) {
  sensor_msgs::msg::Image message;
  message.header(interfaces::to_header(stamp_ns, kCameraFrame));
  message.width(static_cast<std::uint32_t>(width_px));
  message.height(static_cast<std::uint32_t>(height_px));
  message.encoding(encoding);
  message.step(static_cast<std::uint32_t>(pixels.size() / message.height()));
  message.data().resize(pixels.size());
  std::memcpy(message.data().data(), pixels.data(), pixels.size());
  return message;
}

sensor_msgs::msg::PointField flag_field(const std::string& name, std::uint32_t offset) {
  constexpr std::uint8_t kUint8 = 2;
  auto field = float_field(name, offset);
  field.datatype(kUint8);
  return field;
}

}  // namespace

sensor_msgs::msg::Image to_image(const simulation::SimulatedFrame& frame) {
  const auto& image = frame.image;
  return make_image(
      frame.stamp_ns, image.width_px, image.height_px, "rgb8", std::as_bytes(std::span(image.rgb)));
}

sensor_msgs::msg::CameraInfo to_camera_info(std::int64_t stamp_ns,
                                            const sensors::CameraIntrinsics& camera) {
  auto coefficients = camera.distortion;
  coefficients.resize(camera.distortion_model == "plumb_bob"     ? 5
                      : camera.distortion_model == "equidistant" ? 4
                                                                 : 8);
  auto message = make_camera_info(stamp_ns,
                                  {camera.width_px,
                                   camera.height_px,
                                   camera.fx_px,
                                   camera.fy_px,
                                   camera.cx_px,
                                   camera.cy_px,
                                   std::move(coefficients)});
  message.distortion_model(camera.distortion_model);
  return message;
}

sensor_msgs::msg::Image to_depth_image(const simulation::SimulatedFrame& frame) {
  const auto& depth = frame.depth;
  return make_image(frame.stamp_ns,
                    depth.width_px,
                    depth.height_px,
                    "32FC1",
                    std::as_bytes(std::span(depth.z_m)));
}

livox_ros_driver2::msg::CustomMsg to_livox(const simulation::LidarScan& scan) {
  livox_ros_driver2::msg::CustomMsg message;
  message.header(interfaces::to_header(scan.stamp_ns, kLivoxFrame));
  message.timebase(static_cast<std::uint64_t>(scan.stamp_ns));
  message.point_num(static_cast<std::uint32_t>(scan.points.size()));
  message.points().reserve(scan.points.size());
  for (const auto& point : scan.points) {
    livox_ros_driver2::msg::CustomPoint sent;
    sent.offset_time(point.offset_ns);
    sent.x(point.p_lidar.x());
    sent.y(point.p_lidar.y());
    sent.z(point.p_lidar.z());
    sent.reflectivity(point.reflectivity);
    sent.tag(point.tag);
    sent.line(point.line);
    message.points().push_back(sent);
  }
  return message;
}

sensor_msgs::msg::PointCloud2 to_truth_points(const simulation::LidarScan& scan) {
  constexpr std::uint32_t kStep = 16;
  sensor_msgs::msg::PointCloud2 message;
  message.header(interfaces::to_header(scan.stamp_ns, kLivoxFrame));
  message.height(1);
  message.width(static_cast<std::uint32_t>(scan.truth.size()));
  message.fields({float_field("x", 0),
                  float_field("y", 4),
                  float_field("z", 8),
                  flag_field("mixed", 12),
                  flag_field("moving", 13)});
  message.point_step(kStep);
  message.row_step(kStep * message.width());
  message.is_dense(true);
  message.data().resize(message.row_step());
  auto* out = message.data().data();
  for (const auto& point : scan.truth) {
    std::memcpy(out, point.p_lidar_stamp.data(), 12);
    out[12] = point.mixed ? 1 : 0;
    out[13] = point.moving ? 1 : 0;
    out += kStep;
  }
  return message;
}

sensor_msgs::msg::Imu to_imu(const simulation::ImuSample& sample,
                             double gyro_variance,
                             double accel_variance) {
  sensor_msgs::msg::Imu message;
  message.header(interfaces::to_header(sample.stamp_ns, kImuFrame));
  message.angular_velocity(to_message(sample.omega_rad_s));
  message.linear_acceleration(to_message(sample.force_m_s2));
  message.orientation_covariance()[0] = -1.0;  // REP-145: no orientation
  set_diagonal(message.angular_velocity_covariance(), gyro_variance);
  set_diagonal(message.linear_acceleration_covariance(), accel_variance);
  return message;
}

sensor_msgs::msg::Imu to_bias(const simulation::ImuSample& sample) {
  auto bias = sample;
  bias.omega_rad_s = sample.gyro_bias_rad_s;
  bias.force_m_s2 = sample.accel_bias_m_s2;
  return to_imu(bias, 0.0, 0.0);
}

sensor_msgs::msg::NavSatFix to_fix(const simulation::GnssSample& sample) {
  constexpr std::int8_t kGroundAugmented = 2;
  constexpr std::uint16_t kGps = 1;
  constexpr std::uint8_t kDiagonalKnown = 2;
  sensor_msgs::msg::NavSatFix message;
  message.header(interfaces::to_header(sample.stamp_ns, kGnssFrame));
  message.status().status(kGroundAugmented);
  message.status().service(kGps);
  message.latitude(sample.fix.latitude_deg);
  message.longitude(sample.fix.longitude_deg);
  message.altitude(sample.fix.altitude_m);
  set_diagonal(message.position_covariance(), sample.sigma_m * sample.sigma_m);
  message.position_covariance_type(kDiagonalKnown);
  return message;
}

nav_msgs::msg::Odometry to_odometry(const simulation::TruthState& truth) {
  const auto& body = truth.body;
  auto message = make_odometry(truth.stamp_ns, kBaseFrame, isometry(body.T_world_body));
  message.header().frame_id(kWorldFrame);
  const Eigen::Vector3d v_body = body.T_world_body.rotation().inverse() * body.v_world;
  message.twist().twist().linear(to_message(v_body));
  message.twist().twist().angular(to_message(body.omega_body));
  return message;
}

tf2_msgs::msg::TFMessage to_transforms(std::int64_t stamp_ns, const sensors::RigCalibration& rig) {
  tf2_msgs::msg::TFMessage message;
  const auto add = [&](const char* child, const geometry::SE3& T_body_child) {
    message.transforms().push_back(
        make_transform(stamp_ns, kBaseFrame, child, isometry(T_body_child)));
  };
  add(kCameraFrame, rig.T_body_camera);
  add(kLivoxFrame, rig.T_body_lidar());
  add(kImuFrame, rig.T_body_imu());
  add(kGnssFrame, geometry::SE3(geometry::SO3(), rig.p_body_gnss));
  return message;
}

}  // namespace camvox::import
