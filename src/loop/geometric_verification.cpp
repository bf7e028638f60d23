#include "camvox/loop/geometric_verification.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "back_projection.hpp"
#include "camvox/features/feature_grid.hpp"
#include "camvox/features/hamming.hpp"
#include "camvox/loop/consistency.hpp"
#include "camvox/optimization/pose_optimizer.hpp"
#include "feature_matching.hpp"
#include "rigid_ransac.hpp"

namespace camvox::loop {
namespace {

using features::FrameFeatures;
using geometry::SE3;
using optimization::LandmarkMatch;
using optimization::MatchUse;
using optimization::PinholeCamera;
using optimization::PoseEstimate;

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// A feature of the place, as a point.
struct PlacePoint {
  Eigen::Vector3d p_place = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_place = Eigen::Vector3d::Zero();  ///< Along its ray.
  double depth_m = 0.0;
  int octave = 0;
  const features::Descriptor* descriptor = nullptr;
};

PlacePoint place_point(const PlaceView& view, std::size_t feature, const PinholeCamera& camera) {
  const auto& features = *view.features;
  const Eigen::Vector3d f = ray(features.undistorted_px[feature], camera);
  const double depth_m = features.depth_m[feature];
  return {
      view.T_place_camera * (depth_m * f),
      view.T_place_camera.rotation() * (static_cast<double>(features.depth_sigma_m[feature]) * f),
      depth_m,
      features.key_points[feature].octave,
      &features.descriptors[feature]};
}

/// Everything that the layers share.
class Verifier {
 public:
  Verifier(const FrameFeatures& query,
           const Place& place,
           const PinholeCamera& camera,
           const VerificationConfig& config)
      : query_(query), place_(place), camera_(camera), config_(config), grid_(query) {
    for (std::size_t octave = 0; octave < scales_.size(); ++octave) {
      scales_[octave] = std::pow(config.octave_scale, static_cast<double>(octave));
    }
  }

  Verification run() {
    match_by_appearance();
    result_.matches = static_cast<int>(pairs_.size());
    if (result_.matches < config_.min_matches) return fail(VerificationStatus::kTooFewMatches);
    const auto start = ransac();
    if (!start || result_.ransac_inliers < config_.min_matches) {
      return fail(VerificationStatus::kNoRigidMotion);
    }
    keep_ransac_inliers(*start);
    auto estimate = optimize(*start);
    if (estimate.status == PoseEstimate::Status::kOk) {
      estimate = search_and_refine(estimate);
    }
    if (estimate.status != PoseEstimate::Status::kOk)
      return fail(VerificationStatus::kTooFewInliers);
    return judge(estimate);
  }

 private:
  struct Pair {
    std::size_t feature;  ///< Of the query.
    PlacePoint point;
  };

  Verification fail(VerificationStatus status) {
    result_.status = status;
    return result_;
  }

  /// A start that is off (few matches, noisy depth) finds many of its matches beside the true ones,
  /// which hold it back: two rounds left errors of 0.1 m at 3 m that five do not.
  PoseEstimate search_and_refine(PoseEstimate estimate) {
    constexpr double kStays_rad = 3e-4;
    constexpr double kStays_m = 1e-3;
    for (int round = 0; round < config_.guided_rounds; ++round) {
      const SE3 before = estimate.T_world_camera;
      search_around(before, config_.search_radius_px);
      estimate = optimize(before);
      if (estimate.status != PoseEstimate::Status::kOk) break;
      const geometry::Vector6d step = geometry::local(before, estimate.T_world_camera);
      if (step.head<3>().norm() < kStays_rad && step.tail<3>().norm() < kStays_m) break;
    }
    return estimate;
  }

  void match_by_appearance() {
    const auto& first = *place_.front().features;
    const MatchingRule rule = {config_.max_distance_bits,
                               config_.max_ratio,
                               static_cast<std::size_t>(config_.matched_features)};
    for (const auto& match : match_all(query_, first, rule)) {
      pairs_.push_back({match.query, place_point(place_.front(), match.match, camera_)});
    }
  }

  [[nodiscard]] double scale(std::size_t feature) const {
    return scales_[query_.key_points[feature].octave];
  }

  /// The pixel at which the query would see a point, and its depth there; nothing behind it.
  [[nodiscard]] std::optional<Eigen::Vector3d> predict(const SE3& T_query_place,
                                                       const Eigen::Vector3d& p_place) const {
    const Eigen::Vector3d p = T_query_place * p_place;
    if (!(p.z() > 0.05)) return std::nullopt;
    return Eigen::Vector3d(camera_.fx_px * p.x() / p.z() + camera_.cx_px,
                           camera_.fy_px * p.y() / p.z() + camera_.cy_px,
                           p.z());
  }

  [[nodiscard]] bool depth_agrees(double predicted_m, double measured_m, double sigma_m) const {
    return std::abs(predicted_m - measured_m) <
           std::max(config_.depth_tolerance * predicted_m, 4.0 * sigma_m);
  }

  [[nodiscard]] bool is_inlier(const SE3& T_query_place, const Pair& pair) const {
    const auto seen = predict(T_query_place, pair.point.p_place);
    if (!seen) return false;
    const Eigen::Vector2d u_px = query_.undistorted_px[pair.feature].cast<double>();
    if ((seen->head<2>() - u_px).norm() > config_.ransac_error_px * scale(pair.feature))
      return false;
    const double depth_m = query_.depth_m[pair.feature];
    if (!(depth_m > 0.0)) return true;
    const double sigma_m =
        std::hypot(pair.point.sigma_place.norm(), query_.depth_sigma_m[pair.feature]);
    return depth_agrees(seen->z(), depth_m, sigma_m);
  }

  std::optional<SE3> ransac() {
    std::vector<PointPair> points;
    for (const auto& pair : pairs_) {
      const double depth_m = query_.depth_m[pair.feature];
      if (!(depth_m > 0.0)) continue;
      const double sigma_m =
          std::hypot(pair.point.sigma_place.norm(), query_.depth_sigma_m[pair.feature]);
      points.push_back({pair.point.p_place,
                        depth_m * ray(query_.undistorted_px[pair.feature], camera_),
                        3.0 * sigma_m + 0.01 * pair.point.depth_m});
    }
    const auto count = [&](const SE3& T_place_query) {
      const SE3 T_query_place = T_place_query.inverse();
      return static_cast<int>(std::count_if(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
        return is_inlier(T_query_place, pair);
      }));
    };
    const auto best = rigid_ransac(
        points,
        {config_.ransac_iterations, static_cast<std::uint64_t>(config_.seed), pairs_.size()},
        count);
    if (best) result_.ransac_inliers = count(*best);
    return best;
  }

  void keep_ransac_inliers(const SE3& T_place_query) {
    const SE3 T_query_place = T_place_query.inverse();
    std::erase_if(pairs_, [&](const Pair& pair) { return !is_inlier(T_query_place, pair); });
  }

  PoseEstimate optimize(const SE3& T_place_query) {
    std::vector<LandmarkMatch> matches;
    matches.reserve(pairs_.size());
    for (const auto& pair : pairs_) {
      LandmarkMatch match;
      match.p_world = pair.point.p_place;
      match.sigma_world = pair.point.sigma_place;
      match.observation.u_px = query_.undistorted_px[pair.feature].cast<double>();
      match.observation.sigma_px = config_.pixel_sigma_px * scale(pair.feature);
      match.observation.depth_m = query_.depth_m[pair.feature];
      match.observation.sigma_depth_m = query_.depth_sigma_m[pair.feature];
      matches.push_back(match);
    }
    return optimization::optimize_pose(T_place_query, matches, camera_);
  }

  /// Replaces the pairs by those of all views that lie near the prediction and look alike.
  void search_around(const SE3& T_place_query, double radius_px) {
    const SE3 T_query_place = T_place_query.inverse();
    std::vector<PlacePoint> best_points(query_.size());
    std::vector<int> best_bits(query_.size(), config_.guided_distance_bits + 1);
    for (const auto& view : place_) {
      for (std::size_t i = 0; i < view.features->size(); ++i) {
        if (!(view.features->depth_m[i] > 0.0F)) continue;
        const auto point = place_point(view, i, camera_);
        const auto seen = predict(T_query_place, point.p_place);
        if (!seen) continue;
        const auto [feature, bits] = most_alike(*seen, point, radius_px);
        if (feature == kNone || bits >= best_bits[feature]) continue;
        best_bits[feature] = bits;
        best_points[feature] = point;
      }
    }
    pairs_.clear();
    for (std::size_t i = 0; i < query_.size(); ++i) {
      if (best_points[i].descriptor != nullptr) pairs_.push_back({i, best_points[i]});
    }
  }

  void find_near(const Eigen::Vector3d& seen, double radius_px) const {
    grid_.find({.u_px = seen.head<2>().cast<float>(), .radius_px = static_cast<float>(radius_px)},
               near_);
  }

  /// The feature of the query that looks most like a point seen at a pixel, and its distance.
  [[nodiscard]] std::pair<std::size_t, int> most_alike(const Eigen::Vector3d& seen,
                                                       const PlacePoint& point,
                                                       double radius_px) const {
    const double octave =
        point.octave + std::log(point.depth_m / seen.z()) / std::log(config_.octave_scale);
    std::size_t best = kNone;
    int best_bits = 257;
    const double radius = radius_px * std::pow(config_.octave_scale, std::clamp(octave, 0.0, 7.0));
    find_near(seen, radius);
    for (const auto feature : near_) {
      if (std::abs(query_.key_points[feature].octave - octave) > 2.0) continue;
      const int bits = features::hamming_distance(*point.descriptor, query_.descriptors[feature]);
      if (bits < best_bits) {
        best_bits = bits;
        best = feature;
      }
    }
    return {best, best_bits};
  }

  Verification judge(const PoseEstimate& estimate) {
    result_.T_place_query = estimate.T_world_camera;
    result_.covariance_query = estimate.covariance_camera;
    result_.inliers = estimate.inliers;
    result_.cells = occupied_cells(estimate);
    if (result_.inliers < config_.min_inliers || result_.cells < config_.min_cells) {
      return fail(VerificationStatus::kTooFewInliers);
    }
    const auto sigma = largest_sigma(estimate.covariance_camera);
    if (sigma.rotation_rad > config_.max_rotation_sigma_deg * std::numbers::pi / 180.0 ||
        sigma.translation_m > config_.max_translation_sigma_m) {
      return fail(VerificationStatus::kUncertain);
    }
    compare_depths();
    return fail(result_.depth_agreement < config_.min_depth_agreement
                    ? VerificationStatus::kDepthDisagrees
                    : VerificationStatus::kOk);
  }

  /// Of the image divided into 8 x 4 cells (as far as the query has features).
  [[nodiscard]] int occupied_cells(const PoseEstimate& estimate) const {
    Eigen::Vector2f low = query_.undistorted_px.front();
    Eigen::Vector2f high = low;
    for (const auto& pixel : query_.undistorted_px) {
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
    const Eigen::Array2f size_px = (high - low).array().max(1.0F) / Eigen::Array2f(8.0F, 4.0F);
    std::set<std::pair<int, int>> cells;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (estimate.uses[i] == MatchUse::kOutlier) continue;
      const Eigen::Array2f cell =
          (query_.undistorted_px[pairs_[i].feature] - low).array() / size_px * 0.999F;
      cells.emplace(static_cast<int>(cell.x()), static_cast<int>(cell.y()));
    }
    return static_cast<int>(cells.size());
  }

  /// Layer of surfaces: the depth that the query measured beside every predicted point. Points
  /// that the query sees something else in front of or behind count against the pose.
  void compare_depths() {
    constexpr double kNear_px = 10.0;
    const SE3 T_query_place = result_.T_place_query.inverse();
    const auto& first = place_.front();
    int agree = 0;
    for (std::size_t i = 0; i < first.features->size(); ++i) {
      if (!(first.features->depth_m[i] > 0.0F)) continue;
      const auto point = place_point(first, i, camera_);
      const auto seen = predict(T_query_place, point.p_place);
      if (!seen) continue;
      bool compared = false;
      bool agrees = false;
      find_near(*seen, kNear_px);
      for (const auto feature : near_) {
        if (!(query_.depth_m[feature] > 0.0F)) continue;
        compared = true;
        const double sigma_m = std::hypot(point.sigma_place.norm(), query_.depth_sigma_m[feature]);
        agrees = agrees || depth_agrees(seen->z(), query_.depth_m[feature], sigma_m);
      }
      result_.depths_compared += compared ? 1 : 0;
      agree += agrees ? 1 : 0;
    }
    if (result_.depths_compared > 0)
      result_.depth_agreement = static_cast<double>(agree) / result_.depths_compared;
  }

  const FrameFeatures& query_;
  const Place& place_;
  const PinholeCamera& camera_;
  const VerificationConfig& config_;
  features::FeatureGrid grid_;
  std::array<double, 256> scales_{};  ///< By octave.
  mutable std::vector<std::uint32_t> near_;
  std::vector<Pair> pairs_;
  Verification result_;
};

}  // namespace

std::string_view to_string(VerificationStatus status) {
  switch (status) {
    case VerificationStatus::kOk:
      return "ok";
    case VerificationStatus::kTooFewMatches:
      return "too few matches";
    case VerificationStatus::kNoRigidMotion:
      return "no rigid motion";
    case VerificationStatus::kTooFewInliers:
      return "too few inliers";
    case VerificationStatus::kUncertain:
      return "uncertain pose";
    case VerificationStatus::kDepthDisagrees:
      return "depth disagrees";
  }
  return "?";
}

Verification verify(const FrameFeatures& query,
                    const Place& place,
                    const PinholeCamera& camera,
                    const VerificationConfig& config) {
  if (place.empty() || query.size() == 0 || place.front().features->size() == 0) return {};
  return Verifier(query, place, camera, config).run();
}

}  // namespace camvox::loop
