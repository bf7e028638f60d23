#pragma once

#include <string_view>

#include "camvox/component/context.hpp"

namespace camvox {

/// The message type of serialised messages (RawMessage) under a ROS type name.
[[nodiscard]] MessageType raw_message_type(std::string_view ros_name);

}  // namespace camvox
