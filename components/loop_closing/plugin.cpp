#include "camvox/component/component.hpp"
#include "camvox/loop_closing/loop_closing_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::LoopClosingComponent)
