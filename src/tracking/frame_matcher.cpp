#include "camvox/tracking/frame_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "camvox/features/hamming.hpp"
#include "camvox/tracking/depth_alignment.hpp"

namespace camvox::tracking {
namespace {

using features::Expected;
using geometry::SE3;

constexpr double kMinDepth_m = 0.05;
constexpr float kMinViewCosine = 0.5F;  ///< A patch seen from more than 60 degrees off is another.
constexpr float kStraightCosine = 0.998F;   ///< Seen from nearly the same side: search less.
constexpr float kObliqueFactor = 1.6F;      ///< Search radius for the others.
constexpr float kDistanceSlack = 1.2F;      ///< Of a landmark's range of distances.
constexpr std::size_t kMaxAnywhere = 2000;  ///< Landmarks looked for by looks alone.

features::MatchConfig match_config(double max_ratio, bool check_rotation) {
  features::MatchConfig config;
  config.max_distance = features::kPermissiveDistance;
  config.max_ratio = max_ratio;
  config.check_rotation = check_rotation;
  return config;
}

/// Projects map points into an undistorted image.
class Projector {
 public:
  Projector(const SE3& T_map_camera, const TrackingCamera& camera)
      : R_camera_map_(T_map_camera.rotation().matrix().transpose()),
        p_map_camera_(T_map_camera.translation()),
        camera_(camera) {}

  [[nodiscard]] Eigen::Vector3d to_camera(const Eigen::Vector3d& p_map) const {
    return R_camera_map_ * (p_map - p_map_camera_);
  }
  /// Nothing outside the image.
  [[nodiscard]] std::optional<Eigen::Vector2f> project(const Eigen::Vector3d& p_camera) const {
    if (!(p_camera.z() > kMinDepth_m)) return std::nullopt;
    const auto& pinhole = camera_.pinhole;
    const double u_px = pinhole.fx_px * p_camera.x() / p_camera.z() + pinhole.cx_px;
    const double v_px = pinhole.fy_px * p_camera.y() / p_camera.z() + pinhole.cy_px;
    const bool inside =
        u_px >= 0.0 && v_px >= 0.0 && u_px < camera_.width_px && v_px < camera_.height_px;
    if (!inside) return std::nullopt;
    return Eigen::Vector2f(static_cast<float>(u_px), static_cast<float>(v_px));
  }

 private:
  Eigen::Matrix3d R_camera_map_;
  Eigen::Vector3d p_map_camera_;
  const TrackingCamera& camera_;
};

}  // namespace

FrameMatcher::FrameMatcher(const features::FrameFeatures& features,
                           const MapReplica& map,
                           const TrackingCamera& camera,
                           const TrackerConfig& config)
    : features_(features), map_(map), camera_(camera), config_(config), grid_(features) {
  for (int octave = 0; octave < camera.scale.levels; ++octave) {
    octave_scale_.push_back(std::pow(camera.scale.factor, static_cast<float>(octave)));
  }
  clear();
}

void FrameMatcher::clear() {
  landmark_of_.assign(features_.size(), -1);
  taken_.assign(features_.size(), 0);
  in_use_.assign(map_.landmarks().size(), 0);
}

int FrameMatcher::match(const std::vector<Expected>& expected,
                        const std::vector<std::size_t>& landmarks,
                        const features::MatchConfig& match_config) {
  const auto matches =
      features::match_by_projection(expected, features_, grid_, taken_, match_config);
  for (const auto& match : matches) {
    const std::size_t landmark = landmarks[match.query];
    landmark_of_[match.target] = static_cast<int>(landmark);
    taken_[match.target] = 1;
    in_use_[landmark] = 1;
  }
  return static_cast<int>(matches.size());
}

int FrameMatcher::match_last_frame(const TrackedFrame& last,
                                   const SE3& T_map_camera,
                                   double radius_px) {
  const Projector projector(T_map_camera, camera_);
  std::vector<Expected> expected;
  std::vector<std::size_t> landmarks;
  for (std::size_t i = 0; i < last.landmark_ids.size(); ++i) {
    if (last.landmark_ids[i] == 0) continue;
    const auto landmark = map_.find(last.landmark_ids[i]);
    if (!landmark || in_use_[*landmark] != 0 || map_.is_banned(*landmark)) continue;
    const auto& known = map_.landmarks()[*landmark];
    const auto u_px = projector.project(projector.to_camera(known.p_map));
    if (!u_px) continue;
    const int octave = last.key_points[i].octave;
    Expected wanted;
    wanted.area.u_px = *u_px;
    wanted.area.radius_px =
        static_cast<float>(radius_px) * octave_scale_[static_cast<std::size_t>(octave)];
    wanted.area.min_octave = octave - 1;
    wanted.area.max_octave = octave + 1;
    wanted.descriptor = known.descriptor;
    wanted.angle_rad = last.key_points[i].angle_rad;
    expected.push_back(wanted);
    landmarks.push_back(*landmark);
  }
  return match(expected, landmarks, match_config(0.9, true));
}

int FrameMatcher::match_local_map(const SE3& T_map_camera, double radius_px) {
  const Projector projector(T_map_camera, camera_);
  std::vector<Expected> expected;
  std::vector<std::size_t> landmarks;
  for (std::size_t i = 0; i < map_.landmarks().size(); ++i) {
    if (in_use_[i] != 0 || map_.is_banned(i)) continue;
    const auto& known = map_.landmarks()[i];
    const auto u_px = projector.project(projector.to_camera(known.p_map));
    if (!u_px) continue;
    const Eigen::Vector3f ray = (known.p_map - T_map_camera.translation()).cast<float>();
    const float distance_m = ray.norm();
    if (distance_m * kDistanceSlack < known.min_distance_m) continue;
    if (distance_m > known.max_distance_m * kDistanceSlack) continue;
    const float cosine = ray.dot(known.f_map) / distance_m;
    if (!(cosine > kMinViewCosine)) continue;
    const int octave = predicted_octave(distance_m, known.max_distance_m, camera_.scale);
    Expected wanted;
    wanted.area.u_px = *u_px;
    wanted.area.radius_px = static_cast<float>(radius_px) *
                            (cosine > kStraightCosine ? 1.0F : kObliqueFactor) *
                            octave_scale_[static_cast<std::size_t>(octave)];
    wanted.area.min_octave = octave - 1;
    wanted.area.max_octave = octave + 1;
    wanted.descriptor = known.descriptor;
    expected.push_back(wanted);
    landmarks.push_back(i);
  }
  return match(expected, landmarks, match_config(0.8, false));
}

std::optional<SE3> FrameMatcher::match_anywhere(const SE3& T_map_camera_near) {
  clear();
  std::vector<std::size_t> candidates;
  const Projector projector(T_map_camera_near, camera_);
  for (std::size_t i = 0; i < map_.landmarks().size(); ++i) {
    const auto& known = map_.landmarks()[i];
    const float cosine =
        (known.p_map - T_map_camera_near.translation()).cast<float>().normalized().dot(known.f_map);
    if (cosine > 0.0F && !map_.is_banned(i)) candidates.push_back(i);
  }
  const std::size_t stride = 1 + candidates.size() / kMaxAnywhere;
  std::vector<std::uint16_t> distances(features_.size());
  std::vector<std::uint16_t> best(features_.size(), features::kStrictDistance + 1);
  std::vector<int> owner(features_.size(), -1);
  for (std::size_t c = 0; c < candidates.size(); c += stride) {
    const auto& known = map_.landmarks()[candidates[c]];
    features::hamming_distances(known.descriptor, features_.descriptors, distances);
    const auto nearest = std::min_element(distances.begin(), distances.end());
    if (nearest == distances.end()) break;
    const auto feature = static_cast<std::size_t>(nearest - distances.begin());
    const auto near_count = std::count_if(distances.begin(), distances.end(), [&](auto distance) {
      return 0.8 * distance <= *nearest;
    });
    if (*nearest >= best[feature] || near_count > 1) continue;
    best[feature] = *nearest;
    owner[feature] = static_cast<int>(candidates[c]);
  }
  std::vector<PointPair> pairs;
  std::vector<std::size_t> features_of_pairs;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const double depth_m = usable_depth_m(i);
    if (owner[i] < 0 || depth_m <= 0.0) continue;
    const auto& u_px = features_.undistorted_px[i];
    pairs.push_back({map_.landmarks()[static_cast<std::size_t>(owner[i])].p_map,
                     {(u_px.x() - camera_.pinhole.cx_px) / camera_.pinhole.fx_px * depth_m,
                      (u_px.y() - camera_.pinhole.cy_px) / camera_.pinhole.fy_px * depth_m,
                      depth_m}});
    features_of_pairs.push_back(i);
  }
  const auto alignment = align_by_depth(pairs, {});
  if (!alignment) return std::nullopt;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (!alignment->inliers[k]) continue;
    const std::size_t feature = features_of_pairs[k];
    landmark_of_[feature] = owner[feature];
    taken_[feature] = 1;
    in_use_[static_cast<std::size_t>(owner[feature])] = 1;
  }
  return alignment->T_map_camera;
}

double FrameMatcher::usable_depth_m(std::size_t feature) const {
  const double depth_m = features_.depth_m[feature];
  const double sigma_m = features_.depth_sigma_m[feature];
  const bool usable =
      depth_m > 0.0 && sigma_m > 0.0 && sigma_m <= config_.max_depth_sigma_ratio * depth_m;
  return usable ? depth_m : 0.0;
}

optimization::LandmarkMatch FrameMatcher::make_match(std::size_t feature) const {
  const auto& known = map_.landmarks()[static_cast<std::size_t>(landmark_of_[feature])];
  optimization::LandmarkMatch match;
  match.p_world = known.p_map;
  match.sigma_world = static_cast<double>(known.sigma_m) * known.f_map.cast<double>();
  match.observation.u_px = features_.undistorted_px[feature].cast<double>();
  match.observation.sigma_px =
      config_.sigma_px * static_cast<double>(octave_scale_[features_.key_points[feature].octave]);
  match.observation.depth_m = usable_depth_m(feature);
  match.observation.sigma_depth_m = features_.depth_sigma_m[feature];
  return match;
}

optimization::PoseEstimate FrameMatcher::optimize(
    const SE3& T_map_camera, const std::optional<optimization::PosePrior>& prior) {
  std::vector<optimization::LandmarkMatch> matches;
  std::vector<std::size_t> features_of_matches;
  for (std::size_t i = 0; i < landmark_of_.size(); ++i) {
    if (landmark_of_[i] < 0) continue;
    matches.push_back(make_match(i));
    features_of_matches.push_back(i);
  }
  optimization::PoseOptimizerOptions options;
  if (config_.depth_model == "virtual_stereo") {
    options.depth_model = optimization::DepthModel::kVirtualStereo;
  }
  auto estimate =
      optimization::optimize_pose(T_map_camera, matches, camera_.pinhole, options, prior);
  if (estimate.status != optimization::PoseEstimate::Status::kOk) return estimate;

  verdicts_.clear();
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const std::size_t feature = features_of_matches[k];
    const auto landmark = static_cast<std::size_t>(landmark_of_[feature]);
    const bool had_depth = matches[k].observation.depth_m > 0.0;
    const auto use = estimate.uses[k];
    const bool agreed = use == optimization::MatchUse::kPixelAndDepth ||
                        (use == optimization::MatchUse::kPixel && !had_depth);
    verdicts_.push_back({landmark, agreed});
    if (use != optimization::MatchUse::kOutlier) continue;
    landmark_of_[feature] = -1;
    taken_[feature] = 0;
    in_use_[landmark] = 0;
  }
  return estimate;
}

int FrameMatcher::match_count() const {
  return static_cast<int>(std::count_if(
      landmark_of_.begin(), landmark_of_.end(), [](int landmark) { return landmark >= 0; }));
}

}  // namespace camvox::tracking
