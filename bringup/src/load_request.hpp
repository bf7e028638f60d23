#pragma once

#include "camvox/bringup/system_config.hpp"
#include "camvox/interfaces/composition_interfaces.hpp"

namespace camvox::bringup {

/// A LoadNode request as an entry of the config. `extra_arguments` may hold executor, on_error and
/// watchdog_s. Throws std::runtime_error with all that is wrong.
[[nodiscard]] ComponentConfig to_component_config(
    const composition_interfaces::srv::LoadNode_Request& request);

}  // namespace camvox::bringup
