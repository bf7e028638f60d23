#pragma once

#include <optional>
#include <string>

#include "camvox/geometry/so3.hpp"
#include "camvox/tracking/frame.hpp"

namespace camvox::tracking {

enum class Health : std::uint8_t { kOk, kWarn, kError };

/// Judges from the latest frames whether tracking goes well. Beside being lost, it notices what
/// wrong calibration looks like: residuals that stay larger than their sigmas say, many matches
/// that disagree, depths that disagree while pixels agree, or turns that the gyro sees larger or
/// smaller than the camera. (A wrong focal length alone leaves residuals small: landmarks stand
/// where depth puts them along the same wrong rays, so that only the angles give it away.)
class HealthMonitor {
 public:
  struct Status {
    Health level = Health::kOk;
    std::string message = "waiting for the first frame";
  };

  /// `R_previous_camera` is the gyro's rotation since the frame before, if known.
  void add(const FrameResult& result,
           const std::optional<geometry::SO3>& R_previous_camera = std::nullopt);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  /// Least squares of the camera's turns over the gyro's: sums of products, old ones fading.
  struct Turns {
    double gyro_gyro = 0.0;
    double gyro_camera = 0.0;
    double camera_camera = 0.0;
    double count = 0.0;
  };

  void compare_turns(const FrameResult& result, const std::optional<geometry::SO3>& gyro);
  /// How much larger the camera sees turns (0.1: by 10 %); 0 when it may as well be chance.
  [[nodiscard]] double turn_excess() const;
  void judge(const FrameResult& result);

  Status status_;
  Turns turns_;
  std::optional<geometry::SO3> R_odom_camera_;  ///< Of the frame before, if it was tracked.
  int frames_ = 0;                              ///< With a pose, up to what the averages need.
  double chi2_per_row_ = 1.0;                   ///< Averages over some 20 frames.
  double inlier_share_ = 1.0;                   ///< Of the matches.
  double depth_share_ = 1.0;                    ///< Of the inliers, those whose depth agrees too.
  double depth_possible_ = 1.0;                 ///< Share of the features that have depth.
};

}  // namespace camvox::tracking
