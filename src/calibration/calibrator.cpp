#include "camvox/calibration/calibrator.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "alignment.hpp"
#include "camvox/calibration/nid.hpp"
#include "prepare.hpp"
#include "verdict.hpp"

namespace camvox::calibration {
namespace {

using geometry::SE3;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kSamePlace =
    4.0;  ///< Two are one place within so many sigmas of the finest level.
constexpr std::size_t kStarts = 24;  ///< Places of the grid that are climbed from.

constexpr double kWidening = 0.3;             ///< Sigma of the widening, in resolutions.
constexpr std::size_t kEnoughOutlines = 100;  ///< To be fitted to first.

/// The last stages: their reach is in px, or in sigmas of a coarser lidar.
Stage stage_of(const Alignment& alignment, double scale_px) {
  const double lidar_px = alignment.scenes().front().lidar.sigma_rad * alignment.focal_px();
  Stage stage;
  stage.reach_px = std::max(scale_px, 0.4 * lidar_px * scale_px);
  // Windows over several scan lines are wide, and what is in them differs from side to side.
  if (alignment.count(EdgeKind::kOutline) > 0) stage.shared_error = 0.6;
  return stage;
}

/// A place that edges fit to.
struct Climber {
  double score = 0.0;
  SE3 T_camera_lidar;
};

double angle_rad(const SE3& T_a, const SE3& T_b) {
  return (T_a.rotation().inverse() * T_b.rotation()).angle_rad();
}

/// Sorts the best to the front, and drops those that ended within `radius_rad` of a better one.
void keep_different(std::vector<Climber>& climbers, double radius_rad, std::size_t count) {
  std::stable_sort(climbers.begin(), climbers.end(), [](const auto& a, const auto& b) {
    return a.score > b.score;
  });
  std::vector<Climber> kept;
  for (const Climber& climber : climbers) {
    const bool near = std::any_of(kept.begin(), kept.end(), [&](const Climber& other) {
      return angle_rad(other.T_camera_lidar, climber.T_camera_lidar) < radius_rad;
    });
    if (!near && kept.size() < count) kept.push_back(climber);
  }
  climbers = std::move(kept);
}

/// From a guess some degrees off to the neighbourhood of the solution, best first.
std::vector<Climber> find(const Alignment& alignment,
                          const SE3& guess,
                          const Prior& prior,
                          double reach_rad,
                          const std::stop_token& stop) {
  std::vector<Climber> climbers;
  for (const SE3& start : alignment.search(guess, reach_rad, kStarts, stop)) {
    if (stop.stop_requested()) return {};
    const SE3 T = alignment.climb(start, 0, prior);
    climbers.push_back({alignment.score(T, 1), T});
  }
  std::size_t keep = kStarts / 2;
  for (std::size_t level = 1; level < alignment.levels(); ++level, keep = keep * 2 / 3) {
    keep_different(climbers, 0.5 * alignment.width_rad(level - 1), keep);
    for (Climber& climber : climbers) {
      if (stop.stop_requested()) return {};
      climber.T_camera_lidar = alignment.climb(climber.T_camera_lidar, level, prior);
      climber.score =
          alignment.score(climber.T_camera_lidar, std::min(level + 1, alignment.levels() - 1));
    }
  }
  keep_different(climbers, alignment.width_rad(alignment.levels() - 1), keep);
  return climbers;
}

/// From a place to a fraction of a pixel.
Fit refine(const Alignment& alignment,
           const Climber& place,
           const Prior& prior,
           const std::stop_token& stop) {
  Fit fit{place.T_camera_lidar};
  for (const double scale_px : {4.0, 2.5, 1.5}) {
    if (stop.stop_requested()) break;
    fit = alignment.refine(fit, stage_of(alignment, scale_px), prior);
  }
  return fit;
}

double worst_variance(const geometry::Matrix6d& covariance) {
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
  return Solver(covariance.topLeftCorner<3, 3>(), Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

/// Lets outlines lead, whose places are known best, if they alone hold all three rotations: in one
/// turn of a spinning lidar they often follow a few posts, in several scenes they do not.
void follow_outlines(const Alignment& alignment, const Prior& prior, Fit& fit, Stage& stage) {
  if (alignment.count(EdgeKind::kOutline) < kEnoughOutlines) return;
  Stage sharp = stage;
  sharp.reflectivity = 0.5;
  sharp.depth = 0.1;
  sharp.outline = 15.0;
  sharp.shared_error = 0.2;
  // Wide windows first: the edges that led so far may have settled beside the outlines.
  Stage wide = sharp;
  wide.reach_px *= 2.0;
  const Fit other = alignment.refine(alignment.refine(fit, wide, prior), sharp, prior);
  const auto variance = [&](const Fit& of, const Stage& in) {
    return worst_variance(covariance_of(alignment, of, in, prior));
  };
  if (!(variance(other, sharp) < variance(fit, stage))) return;
  fit = other;
  stage = sharp;
}

/// The best of the other places. One that fits well may only have been slow: where rotation and
/// translation can stand in for each other, it ends at the result when it is refined.
std::optional<SE3> rival_of(const Alignment& alignment,
                            const SE3& T_camera_lidar,
                            const std::vector<Climber>& places,
                            const Prior& prior,
                            const std::stop_token& stop) {
  const double radius_rad = kSamePlace * alignment.width_rad(alignment.levels() - 1);
  for (std::size_t i = 1; i < places.size() && !stop.stop_requested(); ++i) {
    const SE3 T = refine(alignment, places[i], prior, stop).T_camera_lidar;
    if (angle_rad(T, T_camera_lidar) > radius_rad) return T;
  }
  return std::nullopt;
}

void add_other_costs(const std::vector<Scene>& scenes,
                     const sensors::CameraModel& camera,
                     const SE3& guess,
                     const CamvoxMethodConfig& config,
                     const std::stop_token& stop,
                     CalibrationResult& result) {
  result.nid_before = 0.0;
  result.nid_after = 0.0;
  for (const Scene& scene : scenes) {
    if (stop.stop_requested()) return;
    const auto share = 1.0 / static_cast<double>(scenes.size());
    result.nid_before += share * normalised_information_distance(scene, camera, guess);
    result.nid_after +=
        share * normalised_information_distance(scene, camera, result.T_camera_lidar);
  }
  if (stop.stop_requested()) return;
  const CamvoxCost cost(scenes.front(), camera, config);
  if (stop.stop_requested()) return;
  result.camvox_cost_before = cost(guess);
  if (stop.stop_requested()) return;
  result.camvox_cost_after = cost(result.T_camera_lidar);
}

std::string line(const char* format, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

}  // namespace

std::string_view to_string(CalibrationStatus status) {
  switch (status) {
    case CalibrationStatus::kDone:
      return "done";
    case CalibrationStatus::kCancelled:
      return "cancelled";
    case CalibrationStatus::kNoScene:
      return "no scene";
    case CalibrationStatus::kWrongImageSize:
      return "image is not of the size that the intrinsics are for";
    case CalibrationStatus::kBlankImage:
      return "image without contrast";
    case CalibrationStatus::kNoImageEdges:
      return "image without edges";
    case CalibrationStatus::kEmptyCloud:
      return "too few lidar returns in the camera's view";
    case CalibrationStatus::kNoLidarEdges:
      return "lidar sees no edges in the camera's view";
  }
  return "unknown";
}

CalibrationResult calibrate(const std::vector<Scene>& scenes,
                            const sensors::CameraIntrinsics& intrinsics,
                            const SE3& T_camera_lidar_guess,
                            const CalibrationConfig& config,
                            const std::stop_token& stop) {
  config::require_valid(config, "calibration");
  const sensors::CameraModel camera(intrinsics);
  CalibrationResult result;
  result.T_camera_lidar = T_camera_lidar_guess;
  const auto ended = [&](CalibrationStatus status) {
    CalibrationResult none;
    none.T_camera_lidar = T_camera_lidar_guess;
    none.status = status;
    none.reason = to_string(status);
    return none;
  };
  Preparation preparation = prepare(scenes, intrinsics, T_camera_lidar_guess, config, stop);
  if (preparation.status != CalibrationStatus::kDone) return ended(preparation.status);
  const Alignment alignment(camera, std::move(preparation.scenes));
  for (const auto& scene : alignment.scenes()) result.lidar_edges += scene.lidar.edges.size();
  const double lidar_rad = alignment.scenes().front().lidar.sigma_rad;
  const Prior prior{
      T_camera_lidar_guess.translation(), config.translation_sigma_m, kWidening * lidar_rad};
  Contest contest{T_camera_lidar_guess, {}, prior, stage_of(alignment, 1.5), stop};
  if (config.method == "camvox") {
    const CamvoxCost cost(scenes.front(), camera, config.camvox);
    result.T_camera_lidar = camvox_descend(cost, T_camera_lidar_guess, config.camvox, stop);
  } else {
    const auto places =
        find(alignment, T_camera_lidar_guess, prior, config.max_rotation_deg * kDegree, stop);
    if (!places.empty()) {
      Fit fit = refine(alignment, places[0], prior, stop);
      contest.rival = rival_of(alignment, fit.T_camera_lidar, places, prior, stop);
      follow_outlines(alignment, prior, fit, contest.stage);
      result.T_camera_lidar = fit.T_camera_lidar;
      result.widening_rad = fit.widening_rad;
    }
  }
  if (stop.stop_requested()) return ended(CalibrationStatus::kCancelled);
  examine(alignment, contest, result);
  if (stop.stop_requested()) return ended(CalibrationStatus::kCancelled);
  add_other_costs(scenes, camera, T_camera_lidar_guess, config.camvox, stop, result);
  if (stop.stop_requested()) return ended(CalibrationStatus::kCancelled);
  result.status = CalibrationStatus::kDone;
  result.reason = objection(result, config.gate);
  result.accepted = result.reason.empty();
  return result;
}

std::string report_text(const CalibrationResult& r) {
  if (r.status != CalibrationStatus::kDone) {
    return "no result: " + std::string(to_string(r.status)) + "\n";
  }
  const auto& t = r.T_camera_lidar.translation();
  const auto& q = r.T_camera_lidar.rotation().quaternion();
  char text[256];
  std::snprintf(
      text,
      sizeof(text),
      "T_camera_lidar: translation %.4f %.4f %.4f m, quaternion xyzw %.6f %.6f %.6f %.6f\n",
      t.x(),
      t.y(),
      t.z(),
      q.x(),
      q.y(),
      q.z(),
      q.w());
  std::string report = text;
  report += line("one sigma of the worst axis: %.3f deg, %.4f m\n",
                 r.sigma_rotation_deg,
                 r.sigma_translation_m);
  report +=
      line("score (gain over chance): %.3f before, %.3f after\n", r.score_before, r.score_after);
  report += line(
      "score on held-back data: %.3f before, %.3f after\n", r.held_back_before, r.held_back_after);
  report += line("NID: %.4f before, %.4f after\n", r.nid_before, r.nid_after);
  report +=
      line("CamVox cost: %.2f before, %.2f after\n", r.camvox_cost_before, r.camvox_cost_after);
  report +=
      line("inlier share %.2f, halves disagree by %.3f deg\n", r.inlier_share, r.disagreement_deg);
  report += line("the lidar's beam adds to outlines: %.3f deg across, %.3f deg up\n",
                 r.widening_rad.x() / kDegree,
                 r.widening_rad.y() / kDegree);
  report += line("%.2f of a perfect fit, the next best place %.2f\n", r.fit, r.rival_fit);
  return report + (r.accepted ? "accepted\n" : "refused: " + r.reason + "\n");
}

}  // namespace camvox::calibration
