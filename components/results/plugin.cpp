#include "camvox/results/results_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::ResultsComponent)
