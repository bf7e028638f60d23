#include "camvox/component/component.hpp"
#include "camvox/deskew_component/deskew_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::DeskewComponent)
