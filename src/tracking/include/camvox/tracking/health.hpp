#pragma once

#include <string>

#include "camvox/tracking/frame.hpp"

namespace camvox::tracking {

enum class Health : std::uint8_t { kOk, kWarn, kError };

/// Judges from the latest frames whether tracking goes well. Beside being lost, it notices what
/// wrong calibration looks like: residuals that stay larger than their sigmas say, many matches
/// that disagree, or depths that disagree while pixels agree.
class HealthMonitor {
 public:
  struct Status {
    Health level = Health::kOk;
    std::string message = "waiting for the first frame";
  };

  void add(const FrameResult& result);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  void judge(const FrameResult& result);

  Status status_;
  int frames_ = 0;               ///< With a pose, up to what the averages need.
  double chi2_per_row_ = 1.0;    ///< Averages over some 20 frames.
  double inlier_share_ = 1.0;    ///< Of the matches.
  double depth_share_ = 1.0;     ///< Of the inliers, those whose depth agrees too.
  double depth_possible_ = 1.0;  ///< Share of the features that have depth.
};

}  // namespace camvox::tracking
