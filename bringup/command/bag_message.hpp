#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "camvox/interfaces/message_type.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "command.hpp"

namespace camvox::command {

/// A recorded message as its type. Throws CommandError naming the topic if it is malformed.
template <typename Message>
[[nodiscard]] Message decode(const storage::BagMessage& raw, const std::string& topic) {
  Message message;
  if (!interfaces::message_type<Message>().read_cdr(
          reinterpret_cast<const std::uint8_t*>(raw.data.data()), raw.data.size(), &message)) {
    throw CommandError(fmt::format("{}: a message is malformed", topic));
  }
  return message;
}

}  // namespace camvox::command
