#include "camvox/conversion/extrinsics_in_force.hpp"

#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {

bool ExtrinsicsInForce::take(const Extrinsics& extrinsics) {
  const auto stamp_ns = extrinsics.header().stamp_ns();
  const bool newer = extrinsics.version() > version_ || stamp_ns > stamp_ns_;
  if (extrinsics.applied() == 0 || !newer) return false;
  T_camera_lidar_ = to_se3(extrinsics.T_camera_lidar());
  version_ = extrinsics.version();
  stamp_ns_ = stamp_ns;
  return true;
}

}  // namespace camvox::conversion
