#include "camvox/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace camvox::tracking {
namespace {

using geometry::SE3;
using optimization::PoseEstimate;
using optimization::PosePrior;

constexpr int kMinMotionMatches = 20;
constexpr int kMinFeatures = 20;        ///< Fewer in a frame are not worth a search.
constexpr int kMinFeaturesToAsk = 50;   ///< Fewer are not worth a relocalisation request.
constexpr double kWideSearch = 3.0;     ///< Search radius after a pose found by looks alone.
constexpr double kReferenceGain = 0.8;  ///< Another keyframe must be that much nearer.
constexpr int kMaxRelocalisingFrames = 10;
constexpr int kMaxFramesToCome = 50;  ///< For the map of a proposed place.
constexpr double kNsToS = 1e-9;

std::optional<PoseEstimate> if_ok(PoseEstimate estimate) {
  if (estimate.status != PoseEstimate::Status::kOk) return std::nullopt;
  return estimate;
}

/// How far a view is from another one: distance in units of the depth of what is seen, plus angle.
double view_distance(const SE3& T_a_b, double median_depth_m) {
  return T_a_b.translation().norm() / std::max(median_depth_m, 0.5) + T_a_b.rotation().angle_rad();
}

}  // namespace

Tracker::Tracker(const TrackerConfig& config,
                 const TrackingCamera& camera,
                 const SE3& T_body_camera)
    : config_(config),
      camera_(camera),
      T_body_camera_(T_body_camera),
      map_(camera.pinhole, camera.scale),
      limit_(config.max_acceleration_mps2),
      T_odom_camera_(T_body_camera),
      frames_since_request_(config.relocalisation_interval) {
  config::require_valid(config, "tracking");
  camera_.pinhole.virtual_baseline_m = config.virtual_baseline_m;
  if (config.localisation_only || config.relocalise_at_start) state_ = TrackingState::kLost;
}

FrameResult Tracker::track(Frame frame) {
  FrameResult result;
  now_ns_ = frame.stamp_ns;
  result.frame_id = frame.frame_id;
  result.stamp_ns = frame.stamp_ns;
  result.statistics.features = static_cast<int>(frame.features.size());
  // Where keyframes are made, new landmarks replace those that are banned, often for good reason.
  // In a map that stays as it is, one by one all of them would be: each has its unlucky frames.
  if (config_.localisation_only) map_.age_bans();
  FrameMatcher matcher(frame.features, map_, camera_, config_);
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    result.statistics.features_with_depth += matcher.usable_depth_m(i) > 0.0 ? 1 : 0;
  }

  std::optional<PoseEstimate> estimate;
  bool followed = false;
  if (result.statistics.features >= kMinFeatures) {
    if (state_ == TrackingState::kWaiting && map_.empty()) {
      if (result.statistics.features_with_depth >= config_.min_features_with_depth) {
        start_map(frame, matcher, result);
        return result;
      }
    } else {
      if (is_tracked()) estimate = follow(frame, matcher);
      followed = estimate.has_value();
      if (!followed) estimate = find_again(frame, matcher);
    }
  }
  if (estimate) {
    observe_speed(frame, *estimate, followed);
    accept(frame, matcher, *estimate, result);
  } else {
    lose(frame, result);
  }
  fill(result);
  return result;
}

void Tracker::start_map(Frame& frame, const FrameMatcher& matcher, FrameResult& result) {
  state_ = TrackingState::kTracking;
  map_stamp_ns_ = frame.stamp_ns;
  remember(frame, matcher, T_body_camera_);
  add_keyframe(frame, matcher, result);
  fill(result);
}

void Tracker::remember(const Frame& frame, const FrameMatcher& matcher, const SE3& T_map_camera) {
  last_.frame_id = frame.frame_id;
  last_.stamp_ns = frame.stamp_ns;
  last_.T_map_camera = T_map_camera;
  place_epoch_ = map_.map_epoch();
  last_.key_points = frame.features.key_points;
  last_.landmark_ids.assign(frame.features.size(), 0);
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const int landmark = matcher.landmarks()[i];
    if (landmark < 0) continue;
    last_.landmark_ids[i] = map_.landmarks()[static_cast<std::size_t>(landmark)].id;
  }
}

std::optional<PosePrior> Tracker::gyro_prior(const Frame& frame, const SE3& T_map_camera) const {
  if (!frame.R_previous_camera || config_.gyro_sigma_deg <= 0.0) return std::nullopt;
  const double sigma_rad = config_.gyro_sigma_deg * std::numbers::pi / 180.0;
  PosePrior prior;
  prior.T_world_camera = T_map_camera;
  prior.information.diagonal().head<3>().setConstant(1.0 / (sigma_rad * sigma_rad));
  return prior;
}

// First near where the motion predicts each landmark, then in a wider circle.
std::optional<PoseEstimate> Tracker::follow(const Frame& frame, FrameMatcher& matcher) {
  const double dt_s = static_cast<double>(frame.stamp_ns - last_.stamp_ns) * kNsToS;
  const SE3 T_predicted = last_.T_map_camera * motion_.predict(dt_s, frame.R_previous_camera);
  const auto prior = gyro_prior(frame, T_predicted);
  const double radius_px =
      frame.R_previous_camera ? config_.motion_radius_gyro_px : config_.motion_radius_px;
  for (const double factor : {1.0, 2.0}) {
    matcher.clear();
    if (matcher.match_last_frame(last_, T_predicted, factor * radius_px) < kMinMotionMatches) {
      continue;
    }
    const auto start = if_ok(matcher.optimize(T_predicted, prior));
    if (!start) continue;
    auto estimate = refine(matcher, start->T_world_camera, config_.map_radius_px, prior);
    const bool enough = estimate && estimate->inliers >= config_.min_inliers;
    if (enough && is_possible(frame, *estimate)) return estimate;
  }
  return std::nullopt;
}

std::optional<PoseEstimate> Tracker::find_again(const Frame& frame, FrameMatcher& matcher) {
  // At a place just proposed, nothing can be found before its map has come.
  if (!has_map_of_place()) return std::nullopt;
  auto estimate = state_ == TrackingState::kRelocalising ? find_at_hint(matcher) : std::nullopt;
  if (!estimate) estimate = find_by_looks(matcher);
  if (!estimate || !is_possible(frame, *estimate)) return std::nullopt;
  return estimate;
}

// A view from elsewhere shares few features with the map that stand out among all of an image. The
// proposed pose tells where each must be, if it is not too long ago.
std::optional<PoseEstimate> Tracker::find_at_hint(FrameMatcher& matcher) const {
  for (const double factor : {kWideSearch, 2.0 * kWideSearch}) {
    matcher.clear();
    const auto start =
        refine(matcher, last_.T_map_camera, factor * config_.map_radius_px, std::nullopt);
    if (!start) continue;
    auto estimate = refine(matcher, start->T_world_camera, config_.map_radius_px, std::nullopt);
    if (estimate && estimate->inliers >= config_.min_inliers_relocalised) return estimate;
  }
  return std::nullopt;
}

std::optional<PoseEstimate> Tracker::find_by_looks(FrameMatcher& matcher) const {
  const auto T_map_camera = matcher.match_anywhere(last_.T_map_camera);
  if (!T_map_camera) return std::nullopt;
  const auto start = if_ok(matcher.optimize(*T_map_camera));
  if (!start) return std::nullopt;
  auto estimate =
      refine(matcher, start->T_world_camera, kWideSearch * config_.map_radius_px, std::nullopt);
  if (!estimate || estimate->inliers < config_.min_inliers_relocalised) return std::nullopt;
  return estimate;
}

bool Tracker::is_possible(const Frame& frame, const PoseEstimate& estimate) {
  const double dt_s = static_cast<double>(frame.stamp_ns - last_.stamp_ns) * kNsToS;
  const SE3 T_last_camera = last_.T_map_camera.inverse() * estimate.T_world_camera;
  const double sigma_m = std::sqrt(estimate.covariance_camera.diagonal().tail<3>().sum());
  if (limit_.allows(T_last_camera, dt_s, sigma_m)) return true;
  ++refused_poses_;
  return false;
}

// A step to a pose found anew is one that the camera has made if it was held against the limit:
// otherwise the last pose may have been another map's, or a proposal.
void Tracker::observe_speed(const Frame& frame, const PoseEstimate& estimate, bool followed) {
  const double dt_s = static_cast<double>(frame.stamp_ns - last_.stamp_ns) * kNsToS;
  if (dt_s <= 0.0 || !(followed || limit_.knows_velocity())) return;
  limit_.observe(last_.T_map_camera.inverse() * estimate.T_world_camera, dt_s);
}

std::optional<PoseEstimate> Tracker::refine(FrameMatcher& matcher,
                                            const SE3& T_map_camera,
                                            double radius_px,
                                            const std::optional<PosePrior>& prior) const {
  matcher.match_local_map(T_map_camera, radius_px);
  return if_ok(matcher.optimize(T_map_camera, prior));
}

void Tracker::accept(Frame& frame,
                     const FrameMatcher& matcher,
                     const PoseEstimate& estimate,
                     FrameResult& result) {
  const double dt_s = static_cast<double>(frame.stamp_ns - last_.stamp_ns) * kNsToS;
  const SE3 T_last_camera = last_.T_map_camera.inverse() * estimate.T_world_camera;
  if (is_tracked() && dt_s > 0.0) {
    motion_.observe(T_last_camera, dt_s);
    T_odom_camera_ = T_odom_camera_ * T_last_camera;
  } else {
    motion_.reset();
  }
  state_ = config_.localisation_only ? TrackingState::kLocalisationOnly : TrackingState::kTracking;
  frames_lost_ = 0;
  requested_frame_id_.reset();

  for (const auto& verdict : matcher.verdicts()) map_.judge(verdict.landmark, verdict.agreed);
  remember(frame, matcher, estimate.T_world_camera);
  result.covariance_camera = estimate.covariance_camera;
  result.statistics.matches = static_cast<int>(matcher.verdicts().size());
  result.statistics.inliers = estimate.inliers;
  result.statistics.inliers_with_depth = estimate.inliers_with_depth;
  result.statistics.chi2_per_row = estimate.chi2_per_row;
  most_inliers_ = std::max(most_inliers_, estimate.inliers);
  const double depth_m = median_depth_m(matcher);
  choose_reference(depth_m);
  if (is_keyframe_due(frame, matcher, depth_m)) add_keyframe(frame, matcher, result);
}

void Tracker::lose(Frame& frame, FrameResult& result) {
  if (is_tracked()) give_up_pose();
  if (state_ == TrackingState::kWaiting) return;
  ++frames_lost_;
  ++frames_since_request_;
  const int patience = has_map_of_place() ? kMaxRelocalisingFrames : kMaxFramesToCome;
  if (state_ == TrackingState::kRelocalising && frames_lost_ > patience) {
    state_ = TrackingState::kLost;
    place_epoch_ = map_.map_epoch();  // in what is here it may be found by looks
  }
  const bool ask = state_ == TrackingState::kLost &&
                   frames_since_request_ > config_.relocalisation_interval &&
                   result.statistics.features >= kMinFeaturesToAsk;
  if (!ask) return;
  frames_since_request_ = 0;
  requested_frame_id_ = frame.frame_id;
  Keyframe request = make_keyframe(frame);
  request.landmark_ids.assign(request.features.size(), 0);
  result.relocalisation_request = std::move(request);
}

void Tracker::relocalise(const RelocalisationHint& hint) {
  if (requested_frame_id_ != hint.frame_id) return;
  requested_frame_id_.reset();
  if (is_tracked() || (!map_.empty() && hint.map_epoch < map_.map_epoch())) return;
  state_ = TrackingState::kRelocalising;
  limit_.forget();
  frames_lost_ = 0;
  reference_id_ = hint.keyframe_id;
  last_.T_map_camera = hint.T_map_camera;
  place_epoch_ = hint.map_epoch;
  last_.landmark_ids.assign(last_.landmark_ids.size(), 0);
}

void Tracker::relocalisation_failed(std::uint64_t frame_id) {
  if (requested_frame_id_ == frame_id) requested_frame_id_.reset();
}

std::optional<KeyframeId> Tracker::thin_out(std::size_t most) {
  const auto gone = map_.thin_out(most);
  if (gone == reference_id_) reference_id_ = map_.keyframes().back().id;
  return gone;
}

void Tracker::begin_ids_anew() {
  map_.forget_frame_id();
  requested_frame_id_.reset();
}

void Tracker::give_up_pose() {
  state_ = TrackingState::kLost;
  motion_.reset();
  frames_lost_ = 0;
  frames_since_request_ = config_.relocalisation_interval;
}

// The pose was one in a map that nobody else has. A place that was proposed meanwhile is one in the
// other map.
void Tracker::leave_map_for(const LocalMap& other) {
  map_.clear();
  limit_.forget();
  if (state_ == TrackingState::kRelocalising) return;
  give_up_pose();
  reference_id_ = other.keyframes.back().id;
  last_.T_map_camera = other.keyframes.back().T_map_camera;
  place_epoch_ = other.map_epoch;
  last_.landmark_ids.assign(last_.landmark_ids.size(), 0);
}

bool Tracker::update_map(LocalMap map) {
  const bool foreign = map_.is_foreign(map);
  if (foreign) leave_map_for(map);
  const bool had_map_of_place = has_map_of_place();
  follow_map(std::move(map));
  if (!had_map_of_place && has_map_of_place()) frames_lost_ = 0;  // only now it can be found
  return !foreign;
}

bool Tracker::has_map_of_place() const {
  return map_.map_epoch() >= place_epoch_ && map_.T_map_keyframe(reference_id_);
}

void Tracker::follow_map(LocalMap map) {
  const bool is_of_old_map = map_.map_epoch() >= place_epoch_;
  const auto T_map_old = map_.T_map_keyframe(reference_id_);
  const auto old_keyframes = map_.keyframes();
  if (!map_.apply(std::move(map))) return;
  map_stamp_ns_ = now_ns_;
  if (state_ == TrackingState::kWaiting) state_ = TrackingState::kLost;
  if (!T_map_old || !is_of_old_map) return;  // a new place: the pose came with it
  const auto carry = [&](const SE3& T_old, const SE3& T_new) {
    last_.T_map_camera = T_new * T_old.inverse() * last_.T_map_camera;
  };
  if (const auto T_map_new = map_.T_map_keyframe(reference_id_); T_map_new) {
    carry(*T_map_old, *T_map_new);
    return;
  }
  // The reference was culled: along with the newest keyframe that is in both maps.
  for (auto old = old_keyframes.rbegin(); old != old_keyframes.rend(); ++old) {
    const auto T_map_new = map_.T_map_keyframe(old->id);
    if (!T_map_new) continue;
    carry(old->T_map_camera, *T_map_new);
    reference_id_ = old->id;
    return;
  }
  reference_id_ = map_.keyframes().back().id;
}

double Tracker::median_depth_m(const FrameMatcher& matcher) const {
  std::vector<double> depths_m;
  const SE3 T_camera_map = last_.T_map_camera.inverse();
  for (const int landmark : matcher.landmarks()) {
    if (landmark < 0) continue;
    const auto& known = map_.landmarks()[static_cast<std::size_t>(landmark)];
    depths_m.push_back((T_camera_map * known.p_map).z());
  }
  if (depths_m.empty()) return 1.0;
  const auto middle = depths_m.begin() + static_cast<std::ptrdiff_t>(depths_m.size() / 2);
  std::nth_element(depths_m.begin(), middle, depths_m.end());
  return *middle;
}

SE3 Tracker::T_keyframe_camera() const {
  const auto T_map_keyframe = map_.T_map_keyframe(reference_id_);
  return T_map_keyframe ? T_map_keyframe->inverse() * last_.T_map_camera : SE3();
}

void Tracker::choose_reference(double median_depth_m) {
  const SE3 T_camera_map = last_.T_map_camera.inverse();
  const auto present = map_.T_map_keyframe(reference_id_);
  double nearest = present ? kReferenceGain * view_distance(T_camera_map * *present, median_depth_m)
                           : std::numeric_limits<double>::infinity();
  for (const auto& keyframe : map_.keyframes()) {
    const double distance = view_distance(T_camera_map * keyframe.T_map_camera, median_depth_m);
    if (distance >= nearest) continue;
    nearest = distance;
    reference_id_ = keyframe.id;
  }
}

bool Tracker::is_keyframe_due(const Frame& frame,
                              const FrameMatcher& matcher,
                              double median_depth_m) const {
  if (config_.localisation_only) return false;
  const SE3 T_reference_camera = T_keyframe_camera();
  KeyframeCues cues;
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const bool matched = matcher.landmarks()[i] >= 0;
    const double depth_m = matcher.usable_depth_m(i);
    const bool close = depth_m > 0.0 && depth_m <= config_.close_depth_m;
    cues.inliers += matched ? 1 : 0;
    cues.tracked_close += matched && close ? 1 : 0;
    cues.untracked_close += !matched && close ? 1 : 0;
  }
  cues.reference_inliers = most_inliers_;
  cues.pending_keyframes = static_cast<int>(map_.pending_count());
  cues.keyframes = static_cast<int>(map_.keyframes().size());
  cues.since_map_s = static_cast<double>(frame.stamp_ns - map_stamp_ns_) * kNsToS;
  cues.since_last_s = static_cast<double>(frame.stamp_ns - last_keyframe_stamp_ns_) * kNsToS;
  cues.baseline_ratio = T_reference_camera.translation().norm() / median_depth_m;
  cues.rotation_rad = T_reference_camera.rotation().angle_rad();
  return is_keyframe(cues, config_.keyframe);
}

Keyframe Tracker::make_keyframe(const Frame& frame) const {
  Keyframe keyframe;
  keyframe.frame_id = frame.frame_id;
  keyframe.stamp_ns = frame.stamp_ns;
  keyframe.map_epoch = map_.map_epoch();
  keyframe.parent_id = reference_id_;
  keyframe.T_map_camera = last_.T_map_camera;
  keyframe.T_parent_camera = T_keyframe_camera();
  keyframe.features = frame.features;
  return keyframe;
}

void Tracker::add_keyframe(const Frame& frame, const FrameMatcher& matcher, FrameResult& result) {
  Keyframe keyframe = make_keyframe(frame);
  keyframe.id = map_.next_keyframe_id();
  keyframe.covariance_camera = result.covariance_camera;
  keyframe.landmark_ids = last_.landmark_ids;
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const double depth_m = matcher.usable_depth_m(i);
    if (keyframe.landmark_ids[i] != 0 || depth_m <= 0.0) continue;
    if (depth_m <= config_.close_depth_m) keyframe.landmark_ids[i] = landmark_id(keyframe.id, i);
  }
  map_.add(keyframe);
  last_.landmark_ids = keyframe.landmark_ids;
  reference_id_ = keyframe.id;
  last_keyframe_stamp_ns_ = frame.stamp_ns;
  most_inliers_ = 0;
  result.keyframe = std::move(keyframe);
}

void Tracker::fill(FrameResult& result) const {
  result.state = state_;
  result.map_epoch = map_.map_epoch();
  result.reference_keyframe_id = reference_id_;
  result.T_map_camera = last_.T_map_camera;
  result.T_keyframe_camera = T_keyframe_camera();
  result.T_odom_camera = T_odom_camera_;
  result.angular_velocity_camera = motion_.twist_camera().head<3>();
  result.velocity_camera = motion_.twist_camera().tail<3>();
  result.statistics.refused_poses = refused_poses_;
  result.statistics.banned_landmarks = map_.banned_count();
}

}  // namespace camvox::tracking
