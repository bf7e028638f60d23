#include "camvox/depth_overlay/depth_overlay_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::DepthOverlayComponent)
