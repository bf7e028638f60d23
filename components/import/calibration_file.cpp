#include "calibration_file.hpp"

namespace camvox::import {
namespace {

struct CalibrationFile {
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

}  // namespace

std::string calibration_text(const sensors::CameraIntrinsics& camera,
                             const sensors::RigConfig& rig) {
  return config::to_yaml(config::dump(CalibrationFile{camera, rig}));
}

sensors::CameraIntrinsics to_intrinsics(const CameraModel& camera) {
  sensors::CameraIntrinsics result;
  result.width_px = camera.width_px;
  result.height_px = camera.height_px;
  result.fx_px = camera.fx_px;
  result.fy_px = camera.fy_px;
  result.cx_px = camera.cx_px;
  result.cy_px = camera.cy_px;
  result.distortion_model = "plumb_bob";
  result.distortion = camera.plumb_bob;
  return result;
}

sensors::RigConfig camera_only_rig() { return sensors::to_config({}); }

}  // namespace camvox::import
