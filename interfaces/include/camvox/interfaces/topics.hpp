#pragma once

#include <string>
#include <string_view>

/// Every topic name of the pipeline, once. Names are ROS names; on the wire "rt" goes before
/// them. Components use them as defaults, and a config may remap each.
namespace camvox::interfaces::topics {

// Edge topics, in.
inline constexpr std::string_view kImage = "/camera/image_raw";
inline constexpr std::string_view kCompressedImage = "/camera/image_raw/compressed";
inline constexpr std::string_view kCameraInfo = "/camera/camera_info";
inline constexpr std::string_view kRegisteredDepth = "/camera/depth_registered/image_raw";
inline constexpr std::string_view kLidar = "/livox/lidar";
inline constexpr std::string_view kImu = "/livox/imu";
inline constexpr std::string_view kGnss = "/gnss/fix";
inline constexpr std::string_view kClock = "/clock";

// Edge topics, out.
inline constexpr std::string_view kOdometry = "/camvox/odometry";
inline constexpr std::string_view kPath = "/camvox/path";
inline constexpr std::string_view kDenseMap = "/camvox/dense_map";
inline constexpr std::string_view kTransforms = "/tf";
inline constexpr std::string_view kStaticTransforms = "/tf_static";
inline constexpr std::string_view kDiagnostics = "/diagnostics";

// Internal topics.
inline constexpr std::string_view kFrameImage = "/camvox/frame_image";
inline constexpr std::string_view kScan = "/camvox/scan";
inline constexpr std::string_view kCloud = "/camvox/cloud";
inline constexpr std::string_view kDepthImage = "/camvox/depth_image";
inline constexpr std::string_view kFramePose = "/camvox/frame_pose";
inline constexpr std::string_view kKeyframe = "/camvox/keyframe";
inline constexpr std::string_view kResentKeyframe = "/camvox/resent_keyframe";
inline constexpr std::string_view kMapKeyframe = "/camvox/map_keyframe";
inline constexpr std::string_view kLocalMap = "/camvox/local_map";
inline constexpr std::string_view kMapUpdate = "/camvox/map_update";
inline constexpr std::string_view kLoopCorrection = "/camvox/loop_correction";
inline constexpr std::string_view kRelocalisationRequest = "/camvox/relocalisation_request";
inline constexpr std::string_view kRelocalisationAnswer = "/camvox/relocalisation_answer";
inline constexpr std::string_view kExtrinsics = "/camvox/extrinsics";
inline constexpr std::string_view kProgress = "/camvox/progress";

/// What is wrong with a topic name by ROS 2's rules, or "": it must start with '/', have only
/// [A-Za-z0-9_/], no "//", no '/' at the end, no token that starts with a digit.
[[nodiscard]] inline std::string name_problem(std::string_view name) {
  const std::string quoted = "topic name '" + std::string(name) + "' ";
  if (!name.starts_with('/')) return quoted + "must start with '/'";
  if (name.size() > 250) return quoted + "is longer than 250 characters";
  if (name.ends_with('/')) return quoted + "must not end with '/'";
  char previous = ' ';
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9';
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (!digit && !letter && c != '/') return quoted + "may hold only letters, digits, '_' and '/'";
    if (c == '/' && previous == '/') return quoted + "has an empty part ('//')";
    if (digit && previous == '/') return quoted + "has a part that starts with a digit";
    previous = c;
  }
  return {};
}

}  // namespace camvox::interfaces::topics
