#pragma once

#include <fmt/format.h>

#include <string>

#include "camvox/component/context.hpp"
#include "camvox/storage/cdr_value.hpp"
#include "command.hpp"

namespace camvox::command {

/// Decodes serialised messages of one type by its definition.
class MessageDecoder {
 public:
  /// Throws CommandError for a type whose definition is not known here.
  explicit MessageDecoder(const std::string& type_name) : schema_(schema_of(type_name)) {}

  /// The value refers to the bytes of the message. Throws CommandError if it is malformed.
  [[nodiscard]] storage::CdrValue decode(const RawMessage& message) const {
    auto value = storage::decode_cdr(
        schema_, {reinterpret_cast<const std::byte*>(message.cdr.data()), message.cdr.size()});
    if (!value.ok()) throw CommandError("malformed message: " + value.status().message());
    return *std::move(value);
  }

 private:
  static storage::MessageSchema schema_of(const std::string& type_name) {
    const auto* type = interfaces::find_message_type(type_name);
    if (type == nullptr) {
      throw CommandError(
          fmt::format("the definition of type {} is not known to camvox", type_name));
    }
    auto schema = storage::MessageSchema::parse(type_name, std::string(type->schema));
    if (!schema.ok()) throw std::logic_error(schema.status().message());
    return *std::move(schema);
  }

  storage::MessageSchema schema_;
};

}  // namespace camvox::command
