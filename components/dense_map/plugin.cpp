#include "camvox/component/component.hpp"
#include "camvox/dense_map/dense_map_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::DenseMapComponent)
