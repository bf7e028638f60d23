#include "camvox/calibration_component/calibration_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::CalibrationComponent)
