#pragma once

#include <string>

#include "camvox/storage/message_schema.hpp"

namespace camvox::storage {

/// Hash of a message type as ROS 2 (Iron and later) computes it: "RIHS01_" and the SHA-256 of the
/// JSON of the type description (REP 2011 and 2016). Comments, constants and defaults do not count.
[[nodiscard]] std::string type_hash(const MessageSchema& schema);

}  // namespace camvox::storage
