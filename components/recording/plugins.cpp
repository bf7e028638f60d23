#include "camvox/recording/record_component.hpp"
#include "camvox/recording/replay_component.hpp"

// Apart from the classes, which the command links as an ordinary library.
CAMVOX_REGISTER_COMPONENT(camvox::RecordComponent)
CAMVOX_REGISTER_COMPONENT(camvox::ReplayComponent)
