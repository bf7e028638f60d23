#pragma once

#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "camvox/calibration/camvox_method.hpp"
#include "camvox/calibration/lidar_edges.hpp"
#include "camvox/calibration/scene.hpp"
#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::calibration {

/// When a result replaces the extrinsics in force. What a result must reach follows from what its
/// data can tell: significance is in standard errors, from the spread over the view, and a lidar
/// that sees less sharply may know less. YAML keys are the field names.
struct GateConfig {
  double min_fit = 0.15;          ///< Of a perfect fit.
  double min_significance = 2.0;  ///< Of the fit, in standard errors.
  double max_rival = 0.6;         ///< Fit of the best other place, of that of the result;
  double min_lead = 3.0;          ///< unless the result leads by this many standard errors.
  double min_gain = 2.0;          ///< Over the old extrinsics on held-back data, standard errors.
  double max_sigma_deg = 0.1;     ///< Of the worst-known axis of rotation, for a dense lidar;
  double max_sigma = 0.6;         ///< for a sparse one this many times its resolution.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_fit", self.min_fit, config::at_least(0.0), config::at_most(1.0));
    field("min_significance", self.min_significance, config::at_least(0.0));
    field("max_rival", self.max_rival, config::at_least(0.0), config::at_most(1.0));
    field("min_lead", self.min_lead, config::at_least(0.0));
    field("min_gain", self.min_gain, config::at_least(0.0));
    field("max_sigma_deg", self.max_sigma_deg, config::greater_than(0.0));
    field("max_sigma", self.max_sigma, config::at_least(0.0));
  }
};

/// Tuning of calibrate. YAML keys are the field names.
struct CalibrationConfig {
  std::string method = "edges";      ///< edges: ours, 6 DoF; camvox: the paper's, rotation only.
  double max_rotation_deg = 6.0;     ///< How far the first guess may be off.
  double translation_sigma_m = 0.1;  ///< How well its translation is known, per axis.
  LidarEdgeConfig lidar_edges;
  GateConfig gate;
  CamvoxMethodConfig camvox;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("method", self.method, config::one_of({"edges", "camvox"}));
    field("max_rotation_deg",
          self.max_rotation_deg,
          config::greater_than(0.0),
          config::at_most(20.0));
    field("translation_sigma_m",
          self.translation_sigma_m,
          config::greater_than(0.0),
          config::at_most(10.0));
    field("lidar_edges", self.lidar_edges);
    field("gate", self.gate);
    field("camvox", self.camvox);
  }
};

/// How a calibration ended. Only kDone comes with numbers.
enum class CalibrationStatus {
  kDone,  ///< There is a result; `accepted` tells whether it passed the gate.
  kCancelled,
  kNoScene,
  kWrongImageSize,  ///< The image is not of the size that the intrinsics are for.
  kBlankImage,      ///< No contrast: covered lens, night.
  kNoImageEdges,
  kEmptyCloud,   ///< Too few returns in the camera's view.
  kNoLidarEdges  ///< A scene without structure: a wall.
};
[[nodiscard]] std::string_view to_string(CalibrationStatus status);

/// A result and all that is needed to judge it.
struct CalibrationResult {
  CalibrationStatus status = CalibrationStatus::kNoScene;
  bool accepted = false;  ///< Passed the gate.
  std::string reason;     ///< Why not, for people; empty when accepted.
  geometry::SE3 T_camera_lidar;
  /// Of a right perturbation (axes of the lidar), [rotation; translation].
  geometry::Matrix6d covariance_lidar = geometry::Matrix6d::Zero();
  double score_before = 0.0;  ///< Gain over chance, nats per edge: higher is better.
  double score_after = 0.0;
  double held_back_before = 0.0;  ///< The same, on the half that a fit did not see.
  double held_back_after = 0.0;
  double held_back_error = 0.0;  ///< Standard error of their difference.
  double fit = 0.0;              ///< Gain over chance, of what a perfect fit would gain: 0 to 1.
  double fit_error = 0.0;        ///< Its standard error.
  double rival_fit = 0.0;        ///< The same of the best of the other places that were tried.
  double lead = 0.0;             ///< Over that one, in standard errors of the difference.
  double resolution_deg = 0.0;   ///< How sharply the lidar sees: sigma.
  double nid_before = 1.0;       ///< Normalised information distance, 0 to 1: lower is better.
  double nid_after = 1.0;
  double camvox_cost_before = 0.0;  ///< The paper's cost, px; of the first scene.
  double camvox_cost_after = 0.0;
  /// By how much the lidar sees near things too wide and too high, which is solved for as well.
  Eigen::Vector2d widening_rad = Eigen::Vector2d::Zero();
  double inlier_share = 0.0;
  double disagreement_deg = 0.0;     ///< Largest, between the result and the fits of both halves.
  double sigma_rotation_deg = 0.0;   ///< Of the worst-known axis.
  double sigma_translation_m = 0.0;  ///< Of the worst-known axis.
  int observable_translations = 0;   ///< Axes that the scenes give to 2 cm, 0 to 3.
  std::size_t lidar_edges = 0;
};

/// Finds the extrinsics of camera and lidar from natural scenes; one image and some seconds of a
/// non-repeating lidar are enough.
///
/// `edges`: edges of reflectivity and depth (see extract_lidar_edges) are fitted to the image's in
/// four levels from 0.8 degrees to a pixel. A grid over rotations finds where to start, expectation
/// maximisation climbs the levels in 6 DoF, the translation held by its prior where the scenes do
/// not determine it. The last stage also finds by how much the lidar's beam widens near things,
/// and follows the sharp outlines of a spinning lidar if they hold all rotations. Ideas: Levinson &
/// Thrun, "Automatic online calibration of cameras and lasers", RSS 2013 (edges); Yuan et al., RA-L
/// 2021 (edges in 3D); Koide et al., ICRA 2023 (NID). `camvox`: see camvox_method.hpp.
///
/// The verdict is the same for both methods: a fit to each half of the view (a chessboard of
/// tiles) is judged on the other half, against the old extrinsics. Deterministic, without threads;
/// `stop` ends it within some tens of milliseconds. Throws config::ConfigError for bad intrinsics
/// or config.
[[nodiscard]] CalibrationResult calibrate(const std::vector<Scene>& scenes,
                                          const sensors::CameraIntrinsics& intrinsics,
                                          const geometry::SE3& T_camera_lidar_guess,
                                          const CalibrationConfig& config = {},
                                          const std::stop_token& stop = {});

/// The result in lines for people.
[[nodiscard]] std::string report_text(const CalibrationResult& result);

}  // namespace camvox::calibration
