#include "camvox/depth_component/depth_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::DepthComponent)
