#include "camvox/component/component.hpp"
#include "camvox/sync_component/sync_component.hpp"

CAMVOX_REGISTER_COMPONENT(camvox::SyncComponent)
