#pragma once

#include <optional>

#include "camvox/config/value.hpp"
#include "camvox/interfaces/rcl_interfaces.hpp"

namespace camvox::bringup {

[[nodiscard]] rcl_interfaces::msg::ParameterValue to_message(const config::Value& value);

/// Nothing for PARAMETER_NOT_SET, a byte array, or an impossible type number.
[[nodiscard]] std::optional<config::Value> from_message(
    const rcl_interfaces::msg::ParameterValue& message);

}  // namespace camvox::bringup
