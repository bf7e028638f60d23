#include "map_file_messages.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "camvox/mapping/map_file.hpp"
#include "cdr_fields.hpp"

namespace camvox::mapping::map_file {
namespace {

using geometry::SE3;
using storage::Status;
using storage::StatusCode;
using PoseArray = std::array<double, 7>;

constexpr std::size_t kFeatureNumbers = 6;
constexpr std::size_t kViewNumbers = 6;
constexpr std::size_t kDescriptorBytes = sizeof(features::Descriptor::bytes);
constexpr std::size_t kMaxFeatures = 65536;  // 16 bits of a landmark's id
constexpr KeyframeId kMaxKeyframeId = (KeyframeId{1} << 48U) - 1;

PoseArray to_array(const SE3& T) {
  const auto& t = T.translation();
  const auto& q = T.rotation().quaternion();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

bool is_pose(const PoseArray& pose) {
  const double norm = Eigen::Vector4d(pose[3], pose[4], pose[5], pose[6]).norm();
  return std::abs(norm - 1.0) < 1e-6 && Eigen::Vector3d(pose[0], pose[1], pose[2]).allFinite();
}

SE3 to_se3(const PoseArray& pose) {
  return {geometry::SO3(Eigen::Quaterniond(pose[6], pose[3], pose[4], pose[5])),
          Eigen::Vector3d(pose[0], pose[1], pose[2])};
}

template <typename List>
bool all_finite(const List& values) {
  return std::all_of(values.begin(), values.end(), [](auto value) { return std::isfinite(value); });
}

Status corrupt(const std::string& what) { return {StatusCode::kCorrupt, what}; }

std::vector<std::uint8_t> descriptor_bytes(const std::vector<features::Descriptor>& descriptors) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(descriptors.size() * kDescriptorBytes);
  for (const auto& descriptor : descriptors) {
    bytes.insert(bytes.end(), descriptor.bytes.begin(), descriptor.bytes.end());
  }
  return bytes;
}

features::Descriptor descriptor_at(const std::vector<std::uint8_t>& bytes, std::size_t index) {
  features::Descriptor descriptor;
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(index * kDescriptorBytes),
              kDescriptorBytes,
              descriptor.bytes.begin());
  return descriptor;
}

/// The lists of a keyframe message.
struct FeatureLists {
  std::vector<float> features;
  std::vector<float> depth;
  std::vector<std::uint8_t> octaves;
  std::vector<std::uint8_t> descriptors;
};

Status problem_with(const FeatureLists& lists, const std::string& who) {
  const std::size_t count = lists.octaves.size();
  if (count > kMaxFeatures) return {StatusCode::kLimit, who + " has more than 65536 features"};
  if (lists.features.size() != count * kFeatureNumbers || lists.depth.size() != 2 * count ||
      lists.descriptors.size() != count * kDescriptorBytes) {
    return corrupt(who + " has lists of different length");
  }
  if (!all_finite(lists.features) || !all_finite(lists.depth)) {
    return corrupt(who + " has a feature that is not finite");
  }
  return {};
}

features::FrameFeatures to_features(const FeatureLists& lists) {
  features::FrameFeatures features;
  const std::size_t count = lists.octaves.size();
  features.key_points.reserve(count);
  features.undistorted_px.reserve(count);
  features.descriptors.reserve(count);
  features.depth_m.reserve(count);
  features.depth_sigma_m.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float* row = lists.features.data() + i * kFeatureNumbers;
    features.key_points.push_back({row[0], row[1], row[4], row[5], lists.octaves[i]});
    features.undistorted_px.emplace_back(row[2], row[3]);
    features.descriptors.push_back(descriptor_at(lists.descriptors, i));
    features.depth_m.push_back(lists.depth[2 * i]);
    features.depth_sigma_m.push_back(lists.depth[2 * i + 1]);
  }
  return features;
}

/// The lists of a message of landmarks.
struct LandmarkLists {
  std::vector<std::uint64_t> ids;
  std::vector<std::uint64_t> born_at;
  std::vector<double> positions;
  std::vector<float> views;
  std::vector<std::uint8_t> descriptors;
  std::vector<std::uint32_t> visible;
  std::vector<std::uint32_t> found;
  std::vector<std::uint32_t> observation_counts;
  std::vector<std::uint64_t> observation_keyframes;
  std::vector<std::uint32_t> observation_features;
};

Status problem_with(const LandmarkLists& lists) {
  const std::size_t count = lists.ids.size();
  std::uint64_t observations = 0;
  for (const auto number : lists.observation_counts) observations += number;
  const bool equal = lists.born_at.size() == count && lists.positions.size() == 3 * count &&
                     lists.views.size() == kViewNumbers * count &&
                     lists.descriptors.size() == kDescriptorBytes * count &&
                     lists.visible.size() == count && lists.found.size() == count &&
                     lists.observation_counts.size() == count &&
                     lists.observation_keyframes.size() == observations &&
                     lists.observation_features.size() == observations;
  if (!equal) return corrupt("landmarks: lists of different length");
  if (!all_finite(lists.positions) || !all_finite(lists.views)) {
    return corrupt("landmarks: a number is not finite");
  }
  return {};
}

Status problem_with(const MapLandmark& landmark) {
  const auto who = "landmark " + std::to_string(landmark.landmark.id);
  if (landmark.landmark.id == 0 || landmark.observations.empty()) {
    return corrupt(who + " has no id, or nothing sees it");
  }
  const auto not_ascending = [](const Observation& a, const Observation& b) {
    return a.keyframe >= b.keyframe;
  };
  const auto& seen = landmark.observations;
  if (std::adjacent_find(seen.begin(), seen.end(), not_ascending) != seen.end()) {
    return corrupt(who + " is seen by keyframes that are not in order");
  }
  return {};
}

}  // namespace

const MessageKind kHeader{"/map/header",
                          "camvox_map/msg/Header",
                          "uint32 version\n"
                          "uint32 width_px\n"
                          "uint32 height_px\n"
                          "uint32 pyramid_levels\n"
                          "float64 pyramid_factor\n"
                          "float64[4] pinhole_px    # fx fy cx cy\n"
                          "uint64 map_epoch\n"
                          "uint64 keyframes\n"
                          "uint64 landmarks\n"};

const MessageKind kKeyframe{
    "/map/keyframe",
    "camvox_map/msg/Keyframe",
    "uint64 id\n"
    "uint64 parent_id          # in the spanning tree; 0: the root\n"
    "uint64 reference_id       # the keyframe that it was taken from\n"
    "uint64 frame_id\n"
    "uint64 map_epoch\n"
    "int64 stamp_ns\n"
    "float64[7] map_camera        # pose in the map: x y z qx qy qz qw\n"
    "float64[7] reference_camera  # as it was taken\n"
    "float64[36] covariance_camera\n"
    "float32[] features        # six each: u v raw, u v undistorted [px], angle [rad], response\n"
    "float32[] depth           # two each: z (0: none), sigma [m]\n"
    "uint8[] octaves\n"
    "uint8[] descriptors       # 32 each\n"};

const MessageKind kLandmarks{
    "/map/landmarks",
    "camvox_map/msg/Landmarks",
    "uint64[] ids              # (founding keyframe << 16) | feature\n"
    "uint64[] born_at          # the newest keyframe at the time\n"
    "float64[] positions       # three each, map frame [m]\n"
    "float32[] views           # six each: mean direction x y z, distance min max, sigma [m]\n"
    "uint8[] descriptors       # 32 each\n"
    "uint32[] visible\n"
    "uint32[] found\n"
    "uint32[] observation_counts\n"
    "uint64[] observation_keyframes\n"
    "uint32[] observation_features\n"};

const MessageKind kLoopEnds{
    "/map/loop_ends",
    "camvox_map/msg/LoopEnds",
    "uint64[] keyframe_ids     # which loops by surfaces have put where they are\n"};

void encode(const Header& header, storage::ByteBuffer& out) {
  CdrWriter fields(out);
  const auto& camera = header.camera;
  fields.number(header.version);
  fields.number(static_cast<std::uint32_t>(camera.width_px));
  fields.number(static_cast<std::uint32_t>(camera.height_px));
  fields.number(static_cast<std::uint32_t>(camera.scale.levels));
  fields.number(static_cast<double>(camera.scale.factor));
  const auto& pinhole = camera.pinhole;
  for (const double px : {pinhole.fx_px, pinhole.fy_px, pinhole.cx_px, pinhole.cy_px}) {
    fields.number(px);
  }
  fields.number(header.epoch);
  fields.number(header.keyframes);
  fields.number(header.landmarks);
}

void encode(const MapKeyframe& keyframe, storage::ByteBuffer& out) {
  const auto& frame = keyframe.frame;
  const auto& features = frame.features;
  FeatureLists lists;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto& point = features.key_points[i];
    const auto& undistorted = features.undistorted_px[i];
    lists.features.insert(lists.features.end(),
                          {point.u_px,
                           point.v_px,
                           undistorted.x(),
                           undistorted.y(),
                           point.angle_rad,
                           point.response});
    lists.depth.insert(lists.depth.end(), {features.depth_m[i], features.depth_sigma_m[i]});
    lists.octaves.push_back(point.octave);
  }
  CdrWriter fields(out);
  for (const auto id :
       {frame.id, keyframe.parent, frame.parent_id, frame.frame_id, frame.map_epoch}) {
    fields.number(id);
  }
  fields.number(frame.stamp_ns);
  for (const auto& T : {frame.T_map_camera, frame.T_parent_camera}) {
    const PoseArray pose = to_array(T);
    fields.array(std::span(pose));
  }
  const Eigen::Matrix<double, 6, 6, Eigen::RowMajor> covariance = frame.covariance_camera;
  fields.array(std::span<const double>(covariance.data(), 36));
  fields.sequence(lists.features);
  fields.sequence(lists.depth);
  fields.sequence(lists.octaves);
  fields.sequence(descriptor_bytes(features.descriptors));
}

void encode(std::span<const MapLandmark* const> landmarks, storage::ByteBuffer& out) {
  LandmarkLists lists;
  std::vector<features::Descriptor> descriptors;
  for (const auto* each : landmarks) {
    const auto& landmark = each->landmark;
    const auto& p = landmark.p_map;
    const auto& f = landmark.f_map;
    lists.ids.push_back(landmark.id);
    lists.born_at.push_back(each->born_at);
    lists.positions.insert(lists.positions.end(), {p.x(), p.y(), p.z()});
    lists.views.insert(
        lists.views.end(),
        {f.x(), f.y(), f.z(), landmark.min_distance_m, landmark.max_distance_m, landmark.sigma_m});
    descriptors.push_back(landmark.descriptor);
    lists.visible.push_back(each->visible);
    lists.found.push_back(each->found);
    lists.observation_counts.push_back(static_cast<std::uint32_t>(each->observations.size()));
    for (const auto& seen : each->observations) {
      lists.observation_keyframes.push_back(seen.keyframe);
      lists.observation_features.push_back(seen.feature);
    }
  }
  CdrWriter fields(out);
  fields.sequence(lists.ids);
  fields.sequence(lists.born_at);
  fields.sequence(lists.positions);
  fields.sequence(lists.views);
  fields.sequence(descriptor_bytes(descriptors));
  fields.sequence(lists.visible);
  fields.sequence(lists.found);
  fields.sequence(lists.observation_counts);
  fields.sequence(lists.observation_keyframes);
  fields.sequence(lists.observation_features);
}

void encode(const std::set<KeyframeId>& loop_ends, storage::ByteBuffer& out) {
  CdrWriter(out).sequence(std::vector(loop_ends.begin(), loop_ends.end()));
}

storage::Result<Header> decode_header(storage::Bytes message) {
  CdrReader fields(message);
  Header header;
  header.version = fields.number<std::uint32_t>();
  if (fields.ok() && (header.version < 1 || header.version > kMapFileVersion)) return header;
  auto& camera = header.camera;
  camera.width_px = static_cast<int>(fields.number<std::uint32_t>());
  camera.height_px = static_cast<int>(fields.number<std::uint32_t>());
  camera.scale.levels = static_cast<int>(fields.number<std::uint32_t>());
  camera.scale.factor = static_cast<float>(fields.number<double>());
  auto& pinhole = camera.pinhole;
  for (double* px : {&pinhole.fx_px, &pinhole.fy_px, &pinhole.cx_px, &pinhole.cy_px}) {
    *px = fields.number<double>();
  }
  header.epoch = fields.number<std::uint64_t>();
  header.keyframes = fields.number<std::uint64_t>();
  header.landmarks = fields.number<std::uint64_t>();
  if (!fields.complete()) return corrupt("the header has another length than it should");
  return header;
}

storage::Result<SavedKeyframe> decode_keyframe(storage::Bytes message) {
  CdrReader fields(message);
  SavedKeyframe keyframe;
  auto& frame = keyframe.frame;
  for (std::uint64_t* id :
       {&frame.id, &keyframe.parent, &frame.parent_id, &frame.frame_id, &frame.map_epoch}) {
    *id = fields.number<std::uint64_t>();
  }
  frame.stamp_ns = fields.number<std::int64_t>();
  const auto map_camera = fields.array<double, 7>();
  const auto reference_camera = fields.array<double, 7>();
  const auto covariance = fields.array<double, 36>();
  FeatureLists lists;
  lists.features = fields.sequence<float>();
  lists.depth = fields.sequence<float>();
  lists.octaves = fields.sequence<std::uint8_t>();
  lists.descriptors = fields.sequence<std::uint8_t>();
  const auto who = "keyframe " + std::to_string(frame.id);
  if (!fields.complete()) return corrupt(who + " has another length than it should");
  if (frame.id == 0 || frame.id > kMaxKeyframeId) return corrupt(who + ": not an id");
  if (!is_pose(map_camera) || !is_pose(reference_camera) || !all_finite(covariance)) {
    return corrupt(who + " has a pose that is none");
  }
  if (auto problem = problem_with(lists, who); !problem.ok()) return problem;
  frame.T_map_camera = to_se3(map_camera);
  frame.T_parent_camera = to_se3(reference_camera);
  frame.covariance_camera =
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariance.data());
  frame.features = to_features(lists);
  return keyframe;
}

storage::Result<std::vector<MapLandmark>> decode_landmarks(storage::Bytes message) {
  CdrReader fields(message);
  LandmarkLists lists;
  lists.ids = fields.sequence<std::uint64_t>();
  lists.born_at = fields.sequence<std::uint64_t>();
  lists.positions = fields.sequence<double>();
  lists.views = fields.sequence<float>();
  lists.descriptors = fields.sequence<std::uint8_t>();
  lists.visible = fields.sequence<std::uint32_t>();
  lists.found = fields.sequence<std::uint32_t>();
  lists.observation_counts = fields.sequence<std::uint32_t>();
  lists.observation_keyframes = fields.sequence<std::uint64_t>();
  lists.observation_features = fields.sequence<std::uint32_t>();
  if (!fields.complete()) return corrupt("landmarks: another length than it should be");
  if (auto problem = problem_with(lists); !problem.ok()) return problem;
  std::vector<MapLandmark> landmarks(lists.ids.size());
  std::size_t observation = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    auto& landmark = landmarks[i].landmark;
    const float* view = lists.views.data() + kViewNumbers * i;
    landmark.id = lists.ids[i];
    landmark.p_map = Eigen::Vector3d::Map(lists.positions.data() + 3 * i);
    landmark.f_map = Eigen::Vector3f::Map(view);
    landmark.min_distance_m = view[3];
    landmark.max_distance_m = view[4];
    landmark.sigma_m = view[5];
    landmark.descriptor = descriptor_at(lists.descriptors, i);
    landmarks[i].born_at = lists.born_at[i];
    landmarks[i].visible = lists.visible[i];
    landmarks[i].found = lists.found[i];
    landmarks[i].observations.reserve(lists.observation_counts[i]);
    for (std::uint32_t k = 0; k < lists.observation_counts[i]; ++k, ++observation) {
      landmarks[i].observations.push_back(
          {lists.observation_keyframes[observation], lists.observation_features[observation]});
    }
    if (auto problem = problem_with(landmarks[i]); !problem.ok()) return problem;
  }
  return landmarks;
}

storage::Result<std::set<KeyframeId>> decode_loop_ends(storage::Bytes message) {
  CdrReader fields(message);
  const auto ids = fields.sequence<std::uint64_t>();
  if (!fields.complete()) return corrupt("loop ends: another length than it should be");
  return std::set<KeyframeId>(ids.begin(), ids.end());
}

}  // namespace camvox::mapping::map_file
