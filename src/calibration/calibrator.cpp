#include "camvox/calibration/calibrator.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "alignment.hpp"
#include "camvox/calibration/nid.hpp"
#include "prepare.hpp"

namespace camvox::calibration {
namespace {

using geometry::Matrix6d;
using geometry::SE3;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::size_t kStarts = 24;     ///< Places of the grid that are climbed from.
constexpr double kObservable_m = 0.02;  ///< A translation known this well is observed.
constexpr double kMinGain = 0.02;       ///< On held-back edges, to be better at all.

/// Reach of the last stages, in px, or in sigmas of a coarser lidar.
double final_reach_px(const Alignment& alignment, double focal_px, double scale) {
  const double lidar_px = alignment.scenes().front().lidar.sigma_rad * focal_px;
  return std::max(scale, 0.6 * lidar_px * scale / 1.5);
}

/// From a guess some degrees off to the neighbourhood of the solution.
SE3 find(const Alignment& alignment,
         const SE3& guess,
         const TranslationPrior& prior,
         double reach_rad,
         const std::stop_token& stop) {
  struct Climber {
    double score;
    SE3 T_camera_lidar;
  };
  std::vector<Climber> climbers;
  for (const SE3& start : alignment.search(guess, reach_rad, kStarts, stop)) {
    if (stop.stop_requested()) return guess;
    const SE3 T = alignment.climb(start, 0, prior);
    climbers.push_back({alignment.score(T, 1), T});
  }
  std::size_t keep = kStarts / 2;
  for (std::size_t level = 1; level < alignment.levels(); ++level, keep /= 2) {
    std::stable_sort(climbers.begin(), climbers.end(), [](const auto& a, const auto& b) {
      return a.score > b.score;
    });
    climbers.resize(std::min(climbers.size(), keep));
    for (Climber& climber : climbers) {
      if (stop.stop_requested()) return guess;
      climber.T_camera_lidar = alignment.climb(climber.T_camera_lidar, level, prior);
      climber.score =
          alignment.score(climber.T_camera_lidar, std::min(level + 1, alignment.levels() - 1));
    }
  }
  const auto best = std::max_element(
      climbers.begin(), climbers.end(), [](auto& a, auto& b) { return a.score < b.score; });
  return best == climbers.end() ? guess : best->T_camera_lidar;
}

double angle_deg(const SE3& T_a, const SE3& T_b) {
  return (T_a.rotation().inverse() * T_b.rotation()).angle_rad() / kDegree;
}

/// Covariance, inflated to what the halves show: they are half of the data each.
void judge_precision(const Alignment& alignment,
                     const TranslationPrior& prior,
                     double reach_px,
                     const geometry::Vector6d& between_halves,
                     CalibrationResult& result) {
  const NormalEquations equations = alignment.linearise(result.T_camera_lidar, reach_px);
  result.inlier_share = equations.weight > 0.0 ? equations.inlier_weight / equations.weight : 0.0;
  if (!(equations.inlier_weight > 0.0)) return;
  const double sigma_px =
      std::sqrt(std::max(0.01, equations.squared_error_px2 / equations.inlier_weight));
  const Matrix6d data = information(equations, sigma_px);
  const Matrix6d total = data + prior_information(prior);
  const double surprise = between_halves.dot(total * between_halves) / (4.0 * 6.0);
  result.covariance_lidar = total.inverse() * std::max(1.0, surprise);
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
  const Solver rotation(result.covariance_lidar.topLeftCorner<3, 3>());
  const Solver translation(result.covariance_lidar.bottomRightCorner<3, 3>());
  result.sigma_rotation_deg = std::sqrt(rotation.eigenvalues().maxCoeff()) / kDegree;
  result.sigma_translation_m = std::sqrt(translation.eigenvalues().maxCoeff());
  for (int i = 0; i < 3; ++i) {
    if (std::sqrt(translation.eigenvalues()[i]) < kObservable_m) ++result.observable_translations;
  }
}

/// Fits both halves and judges each fit on the other half.
void cross_validate(const Alignment& alignment,
                    const SE3& guess,
                    const TranslationPrior& prior,
                    double reach_px,
                    CalibrationResult& result) {
  const std::size_t level = alignment.levels() - 1;
  const auto fit = [&](Part part) {
    return alignment.refine(
        alignment.climb(result.T_camera_lidar, level, prior, part), reach_px, prior, part);
  };
  const SE3 even = fit(Part::kEven);
  const SE3 odd = fit(Part::kOdd);
  result.disagreement_deg =
      std::max(angle_deg(even, result.T_camera_lidar), angle_deg(odd, result.T_camera_lidar));
  result.held_back_before = 0.5 * (alignment.score(guess, level, Part::kOdd) +
                                   alignment.score(guess, level, Part::kEven));
  result.held_back_after =
      0.5 * (alignment.score(even, level, Part::kOdd) + alignment.score(odd, level, Part::kEven));
  result.score_before = alignment.score(guess, level);
  result.score_after = alignment.score(result.T_camera_lidar, level);
  judge_precision(alignment, prior, reach_px, geometry::local(even, odd), result);
}

std::string number(const char* format, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

/// Why a result must not be used, or "".
std::string objection(const CalibrationResult& r, const GateConfig& gate) {
  if (r.score_after < gate.min_score) {
    return number("score %.2f below %.2f: the edges hardly fit", r.score_after, gate.min_score);
  }
  if (r.disagreement_deg > gate.max_disagreement_deg) {
    return number("halves of the data disagree by %.3f deg, more than %.3f",
                  r.disagreement_deg,
                  gate.max_disagreement_deg);
  }
  if (r.inlier_share < gate.min_inlier_share) {
    return number("inlier share %.2f below %.2f", r.inlier_share, gate.min_inlier_share);
  }
  if (r.sigma_rotation_deg > gate.max_sigma_deg) {
    return number(
        "rotation known to %.3f deg only, not %.3f", r.sigma_rotation_deg, gate.max_sigma_deg);
  }
  if (r.held_back_after < r.held_back_before + kMinGain) {
    return number("not better than before on held-back data: score %.3f, before %.3f",
                  r.held_back_after,
                  r.held_back_before);
  }
  return {};
}

void add_other_costs(const std::vector<Scene>& scenes,
                     const sensors::CameraModel& camera,
                     const SE3& guess,
                     const CamvoxMethodConfig& config,
                     CalibrationResult& result) {
  result.nid_before = 0.0;
  result.nid_after = 0.0;
  for (const Scene& scene : scenes) {
    const auto share = 1.0 / static_cast<double>(scenes.size());
    result.nid_before += share * normalised_information_distance(scene, camera, guess);
    result.nid_after +=
        share * normalised_information_distance(scene, camera, result.T_camera_lidar);
  }
  const CamvoxCost cost(scenes.front(), camera, config);
  result.camvox_cost_before = cost(guess);
  result.camvox_cost_after = cost(result.T_camera_lidar);
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
  const TranslationPrior prior{T_camera_lidar_guess.translation(), config.translation_sigma_m};
  if (config.method == "camvox") {
    const CamvoxCost cost(scenes.front(), camera, config.camvox);
    result.T_camera_lidar = camvox_descend(cost, T_camera_lidar_guess, config.camvox, stop);
  } else {
    result.T_camera_lidar =
        find(alignment, T_camera_lidar_guess, prior, config.max_rotation_deg * kDegree, stop);
    for (const double scale_px : {4.0, 2.5, 1.5}) {
      if (stop.stop_requested()) break;
      const double reach_px = final_reach_px(alignment, intrinsics.fx_px, scale_px);
      result.T_camera_lidar = alignment.refine(result.T_camera_lidar, reach_px, prior);
    }
  }
  if (stop.stop_requested()) return ended(CalibrationStatus::kCancelled);
  const double reach_px = final_reach_px(alignment, intrinsics.fx_px, 1.5);
  cross_validate(alignment, T_camera_lidar_guess, prior, reach_px, result);
  if (stop.stop_requested()) return ended(CalibrationStatus::kCancelled);
  add_other_costs(scenes, camera, T_camera_lidar_guess, config.camvox, result);
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
  report += number("one sigma of the worst axis: %.3f deg, %.4f m\n",
                   r.sigma_rotation_deg,
                   r.sigma_translation_m);
  report +=
      number("score (gain over chance): %.3f before, %.3f after\n", r.score_before, r.score_after);
  report += number(
      "score on held-back data: %.3f before, %.3f after\n", r.held_back_before, r.held_back_after);
  report += number("NID: %.4f before, %.4f after\n", r.nid_before, r.nid_after);
  report +=
      number("CamVox cost: %.2f before, %.2f after\n", r.camvox_cost_before, r.camvox_cost_after);
  report += number(
      "inlier share %.2f, halves disagree by %.3f deg\n", r.inlier_share, r.disagreement_deg);
  return report + (r.accepted ? "accepted\n" : "refused: " + r.reason + "\n");
}

}  // namespace camvox::calibration
