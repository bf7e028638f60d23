#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::depth {

/// Tuning of DepthProjector. YAML keys are the field names.
struct DepthProjectorConfig {
  double min_range_m = 0.5;           ///< Nearer returns are ignored.
  double max_range_m = 130.0;         ///< Farther returns are ignored.
  double range_sigma_m = 0.02;        ///< White noise of a return's range.
  double angle_sigma_deg = 0.05;      ///< White noise of its direction, each way.
  double extrinsics_sigma_deg = 0.1;  ///< Rotation of T_camera_lidar, per axis.
  double extrinsics_sigma_m = 0.002;  ///< Translation of T_camera_lidar, per axis.
  double fill_reach_px = 10.0;        ///< No pixel farther from every return is filled.
  double near_margin_px = 1.0;        ///< Empty beside an edge on the nearer surface...
  double far_margin_px = 4.0;         ///< ...and on the one behind.
  double surface_gap = 0.03;          ///< Surfaces differ by more than this share of depth.
  double max_roughness = 0.02;  ///< Spread about a plane, as a share of depth, that is filled.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_range_m", self.min_range_m, config::at_least(0.0));
    field("max_range_m", self.max_range_m, config::greater_than(0.0), config::at_most(1000.0));
    field("range_sigma_m", self.range_sigma_m, config::greater_than(0.0), config::at_most(1.0));
    field("angle_sigma_deg", self.angle_sigma_deg, config::at_least(0.0), config::at_most(5.0));
    field("extrinsics_sigma_deg",
          self.extrinsics_sigma_deg,
          config::at_least(0.0),
          config::at_most(5.0));
    field(
        "extrinsics_sigma_m", self.extrinsics_sigma_m, config::at_least(0.0), config::at_most(1.0));
    field("fill_reach_px", self.fill_reach_px, config::at_least(0.0), config::at_most(16.0));
    field("near_margin_px", self.near_margin_px, config::at_least(0.0), config::at_most(16.0));
    field("far_margin_px", self.far_margin_px, config::at_least(0.0), config::at_most(16.0));
    field("surface_gap", self.surface_gap, config::at_least(0.001), config::at_most(1.0));
    field("max_roughness", self.max_roughness, config::at_least(0.0), config::at_most(1.0));
  }
};

/// The returns of one scan and where its lidar was.
struct ScanView {
  /// Rows of four: x y z in the lidar frame (m), and a fourth number that is not looked at. Not a
  /// number: no return.
  std::span<const float> points_lidar;
  geometry::SE3
      T_camera_lidar;  ///< Camera: that of the depth image; lidar: when the scan was taken.
};

/// What became of the returns of one image.
struct ProjectionReport {
  std::size_t returns = 0;    ///< Given.
  std::size_t projected = 0;  ///< In range and in the image (or right beside it).
  std::size_t hidden = 0;     ///< Of these: behind a nearer surface, seen from the camera.
  std::size_t filled_px = 0;  ///< Pixels with depth.
};

/// Turns lidar returns into a depth image: z along the optical axis (not range), on the distorted
/// pixels of the camera, with a standard deviation per pixel.
///
/// Method, in cells of 8x8 pixels. A plane of the world is linear in inverse depth over pixels (and
/// lens distortion is, over a few cells). Where the returns of a cell and its neighbours agree with
/// one plane within their noise, and surround the cell, its pixels get that plane's depth: noise is
/// averaged, slopes are kept. Elsewhere the returns are sorted into surfaces (planes of
/// neighbouring cells first, then gaps in depth), and a pixel gets the depth of the nearest
/// return's surface, unless another surface is about as near: which of the two it shows is then not
/// known, and it stays empty. The doubt is greater for the farther surface: the silhouette belongs
/// to the nearer one, whose edge may stand out past its last return. Before that, returns that the
/// lidar saw past an edge, but the camera cannot, are dropped: those that change sides with a
/// return of a nearer surface between the lidar's view and the camera's.
///
/// Sigma: scatter of the returns about the plane (prior: range noise, and angular noise times
/// slope) through the covariance of the fit, roughness, and the uncertainty of the extrinsics.
///
/// Deterministic. Keeps its working memory between calls, so one object per thread.
class DepthProjector {
 public:
  /// Throws config::ConfigError.
  DepthProjector(const sensors::CameraModel& camera, const DepthProjectorConfig& config);
  ~DepthProjector();
  DepthProjector(DepthProjector&&) noexcept;
  DepthProjector& operator=(DepthProjector&&) noexcept;

  /// Writes every pixel of `depth_m` and `sigma_m` (width x height of the camera, rows from the
  /// top, no padding); 0 in both where there is no depth. Several scans are laid over each other;
  /// the caller says by T_camera_lidar how the robot moved in between. No scans give an empty
  /// image. Throws std::logic_error when a span has another size.
  ProjectionReport project(std::span<const ScanView> scans,
                           std::span<float> depth_m,
                           std::span<float> sigma_m);

  /// From now on, uncertainty of the extrinsics (std. dev. per axis), e.g. from a calibration.
  void set_extrinsics_sigma(double rotation_rad, double translation_m);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace camvox::depth
