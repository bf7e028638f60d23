#include "camvox/tracking_component/tracking_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::TrackingComponent)
