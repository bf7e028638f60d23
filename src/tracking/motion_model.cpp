#include "camvox/tracking/motion_model.hpp"

#include <stdexcept>

namespace camvox::tracking {

void MotionModel::observe(const geometry::SE3& T_previous_camera, double dt_s) {
  if (!(dt_s > 0.0)) throw std::logic_error("MotionModel: time must go on");
  twist_ = T_previous_camera.log() / dt_s;
}

geometry::SE3 MotionModel::predict(double dt_s,
                                   const std::optional<geometry::SO3>& R_present_next) const {
  const geometry::SE3 T_present_next = geometry::SE3::exp(twist_camera() * dt_s);
  if (!R_present_next) return T_present_next;
  return {*R_present_next, T_present_next.translation()};
}

}  // namespace camvox::tracking
