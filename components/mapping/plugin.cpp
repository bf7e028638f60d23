#include "camvox/mapping_component/mapping_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::MappingComponent)
