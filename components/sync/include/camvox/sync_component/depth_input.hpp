#pragma once

#include <string>

#include "camvox/config/parameters.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::sync_component {

/// Noise of an RGB-D camera: sigma = sigma_base_m + sigma_quadratic (z - sigma_nearest_m)^2. The
/// defaults are those of the first Kinect (Nguyen, Izadi, Lovell, "Modeling Kinect sensor noise for
/// improved 3D reconstruction and tracking", 3DIMPVT 2012). YAML keys are the field names.
struct DepthInputConfig {
  double min_depth_m = 0.2;         ///< Nearer is no depth.
  double max_depth_m = 10.0;        ///< Farther is no depth.
  double sigma_base_m = 0.0012;     ///< Standard deviation at sigma_nearest_m.
  double sigma_quadratic = 0.0019;  ///< Growth with depth, 1/m.
  double sigma_nearest_m = 0.4;     ///< Where the noise is least.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_depth_m", self.min_depth_m, config::at_least(0.0));
    field("max_depth_m", self.max_depth_m, config::greater_than(0.0), config::at_most(1000.0));
    field("sigma_base_m", self.sigma_base_m, config::greater_than(0.0));
    field("sigma_quadratic", self.sigma_quadratic, config::at_least(0.0));
    field("sigma_nearest_m", self.sigma_nearest_m, config::at_least(0.0));
  }
};

/// Writes a depth image that is registered to the camera's (16UC1 in mm or 32FC1 in m, 0 or NaN
/// for none, as REP-118 has it) with its sigma; all but the header. Returns what is wrong, or "".
[[nodiscard]] std::string read_depth(const sensor_msgs::msg::Image& image,
                                     const sensors::CameraIntrinsics& camera,
                                     const DepthInputConfig& config,
                                     camvox_interfaces::msg::DepthImage& depth);

}  // namespace camvox::sync_component
