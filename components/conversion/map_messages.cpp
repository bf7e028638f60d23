#include "camvox/conversion/map_messages.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "camvox/conversion/keyframe.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {
namespace {

namespace msg = camvox_interfaces::msg;

void write(const Eigen::Vector3d& vector, std::array<double, 3>& array) {
  Eigen::Vector3d::Map(array.data()) = vector;
}

void check_counts(const msg::LocalMap& message) {
  const auto landmarks = message.landmark_ids_count();
  if (message.keyframe_poses_count() != message.keyframe_ids_count() ||
      message.landmark_positions_count() != landmarks ||
      message.landmark_views_count() != landmarks ||
      message.landmark_descriptors_count() != landmarks) {
    throw std::invalid_argument("local map: lists of different length");
  }
}

}  // namespace

bool write_keyframe(const tracking::Keyframe& keyframe, msg::Keyframe& message) {
  message.header().stamp_ns(keyframe.stamp_ns);
  message.header().frame_id(keyframe.frame_id);
  message.id(keyframe.id);
  message.map_epoch(keyframe.map_epoch);
  message.parent_keyframe_id(keyframe.parent_id);
  message.T_map_camera(to_array(keyframe.T_map_camera));
  message.T_parent_camera(to_array(keyframe.T_parent_camera));
  message.covariance_camera(to_array(keyframe.covariance_camera));
  if (!write_features(keyframe.features, message)) return false;
  std::copy(
      keyframe.landmark_ids.begin(), keyframe.landmark_ids.end(), message.landmark_ids().begin());
  return true;
}

tracking::Keyframe read_keyframe(const msg::Keyframe& message) {
  tracking::Keyframe keyframe;
  keyframe.id = message.id();
  keyframe.frame_id = message.header().frame_id();
  keyframe.stamp_ns = message.header().stamp_ns();
  keyframe.map_epoch = message.map_epoch();
  keyframe.parent_id = message.parent_keyframe_id();
  keyframe.T_map_camera = to_se3(message.T_map_camera());
  keyframe.T_parent_camera = to_se3(message.T_parent_camera());
  keyframe.covariance_camera = to_matrix(message.covariance_camera());
  keyframe.features = read_features(message);
  keyframe.landmark_ids.assign(
      message.landmark_ids().begin(),
      message.landmark_ids().begin() + static_cast<std::ptrdiff_t>(message.landmark_ids_count()));
  return keyframe;
}

std::size_t write_local_map(const tracking::LocalMap& map, msg::LocalMap& message) {
  message.header().frame_id(map.frame_id);
  message.map_epoch(map.map_epoch);
  message.reference_keyframe_id(map.reference_keyframe_id);
  message.next_keyframe_id(map.next_keyframe_id);
  const std::size_t keyframes =
      std::min<std::size_t>(map.keyframes.size(), msg::LOCAL_MAP_KEYFRAMES);
  for (std::size_t i = 0; i < keyframes; ++i) {
    message.keyframe_ids()[i] = map.keyframes[i].id;
    message.keyframe_poses()[i] = to_array(map.keyframes[i].T_map_camera);
  }
  message.keyframe_ids_count(static_cast<std::uint32_t>(keyframes));
  message.keyframe_poses_count(static_cast<std::uint32_t>(keyframes));
  const std::size_t landmarks =
      std::min<std::size_t>(map.landmarks.size(), msg::LOCAL_MAP_LANDMARKS);
  for (std::size_t i = 0; i < landmarks; ++i) {
    const auto& landmark = map.landmarks[i];
    message.landmark_ids()[i] = landmark.id;
    write(landmark.p_map, message.landmark_positions()[i]);
    message.landmark_views()[i] = {landmark.f_map.x(),
                                   landmark.f_map.y(),
                                   landmark.f_map.z(),
                                   landmark.min_distance_m,
                                   landmark.max_distance_m,
                                   landmark.sigma_m};
    message.landmark_descriptors()[i] = landmark.descriptor.bytes;
  }
  const auto count = static_cast<std::uint32_t>(landmarks);
  message.landmark_ids_count(count);
  message.landmark_positions_count(count);
  message.landmark_views_count(count);
  message.landmark_descriptors_count(count);
  return map.keyframes.size() - keyframes + map.landmarks.size() - landmarks;
}

tracking::LocalMap read_local_map(const msg::LocalMap& message) {
  check_counts(message);
  tracking::LocalMap map;
  map.frame_id = message.header().frame_id();
  map.map_epoch = message.map_epoch();
  map.reference_keyframe_id = message.reference_keyframe_id();
  map.next_keyframe_id = message.next_keyframe_id();
  for (std::uint32_t i = 0; i < message.keyframe_ids_count(); ++i) {
    map.keyframes.push_back({message.keyframe_ids()[i], to_se3(message.keyframe_poses()[i])});
  }
  map.landmarks.reserve(message.landmark_ids_count());
  for (std::uint32_t i = 0; i < message.landmark_ids_count(); ++i) {
    const auto& view = message.landmark_views()[i];
    tracking::Landmark landmark;
    landmark.id = message.landmark_ids()[i];
    landmark.p_map = Eigen::Vector3d::Map(message.landmark_positions()[i].data());
    landmark.f_map = Eigen::Vector3f(view[0], view[1], view[2]);
    landmark.min_distance_m = view[3];
    landmark.max_distance_m = view[4];
    landmark.sigma_m = view[5];
    landmark.descriptor.bytes = message.landmark_descriptors()[i];
    map.landmarks.push_back(landmark);
  }
  return map;
}

void write_frame_pose(const tracking::FrameResult& result, msg::FramePose& message) {
  message.header().stamp_ns(result.stamp_ns);
  message.header().frame_id(result.frame_id);
  message.map_epoch(result.map_epoch);
  message.reference_keyframe_id(result.reference_keyframe_id);
  message.T_map_camera(to_array(result.T_map_camera));
  message.T_keyframe_camera(to_array(result.T_keyframe_camera));
  message.covariance_camera(to_array(result.covariance_camera));
  write(result.velocity_camera, message.velocity_camera());
  write(result.angular_velocity_camera, message.angular_velocity_camera());
  message.features(static_cast<std::uint32_t>(result.statistics.features));
  message.features_with_depth(static_cast<std::uint32_t>(result.statistics.features_with_depth));
  message.matches(static_cast<std::uint32_t>(result.statistics.matches));
  message.inliers(static_cast<std::uint32_t>(result.statistics.inliers));
  message.state(static_cast<std::uint8_t>(result.state));
}

}  // namespace camvox::conversion
