#pragma once

#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"

namespace camvox::sensors {

/// Size, projection and lens distortion of a camera. Defaults are those of the CamVox rig. YAML
/// keys are the field names; model names and coefficient orders are those of ROS's CameraInfo and
/// of OpenCV. A pixel's centre has integer coordinates: (0, 0) is the centre of the first pixel.
struct CameraIntrinsics {
  int width_px = 1520;     ///< Columns of the image.
  int height_px = 568;     ///< Rows of the image.
  double fx_px = 957.994;  ///< Focal length along the rows.
  double fy_px = 955.328;  ///< Focal length along the columns.
  double cx_px = 790.335;  ///< Principal point, column.
  double cy_px = 250.663;  ///< Principal point, row.
  /// plumb_bob (k1 k2 p1 p2 k3), rational_polynomial (k1 k2 p1 p2 k3 k4 k5 k6) or
  /// equidistant (k1 k2 k3 k4).
  std::string distortion_model = "plumb_bob";
  /// Coefficients in the order above; missing ones at the end are zero.
  std::vector<double> distortion = {-0.12, 0.1162, 0.0, 0.0, 0.0};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("width_px", self.width_px, config::at_least(1), config::at_most(65536));
    field("height_px", self.height_px, config::at_least(1), config::at_most(65536));
    field("fx_px", self.fx_px, config::greater_than(0.0));
    field("fy_px", self.fy_px, config::greater_than(0.0));
    field("cx_px", self.cx_px, config::greater_than(-1e6), config::less_than(1e6));
    field("cy_px", self.cy_px, config::greater_than(-1e6), config::less_than(1e6));
    field("distortion_model",
          self.distortion_model,
          config::one_of({"plumb_bob", "rational_polynomial", "equidistant"}));
    field("distortion", self.distortion, config::at_least(-1e6), config::at_most(1e6));
  }
};

/// Everything that is wrong with `intrinsics`: broken constraints and too many coefficients for
/// the model. Empty when a CameraModel can be made of it.
[[nodiscard]] std::vector<config::Problem> check(const CameraIntrinsics& intrinsics,
                                                 const std::string& origin = "camera");

}  // namespace camvox::sensors
