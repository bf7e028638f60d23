#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// Types that a field can have without another definition.
enum class FieldKind {
  kBool,
  kByte,  ///< `byte` in a definition; 8 bits without sign.
  kChar,  ///< `char` in a definition; 8 bits without sign.
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kString,
  kWstring,
  kMessage,  ///< Another message, by name.
};

enum class FieldArray { kNone, kFixed, kBounded, kUnbounded };

/// One field of a message.
struct Field {
  std::string name;
  FieldKind kind = FieldKind::kBool;
  std::string message_type;           ///< "pkg/msg/Type" of a kMessage.
  std::uint32_t string_capacity = 0;  ///< Of `string<=N`; 0: any length.
  FieldArray array = FieldArray::kNone;
  std::uint32_t array_size = 0;  ///< Length of a fixed array, most elements of a bounded sequence.
  std::string default_text;      ///< As in the definition; empty: none.
};

struct Constant {
  std::string name;
  FieldKind kind = FieldKind::kBool;
  std::string value_text;  ///< As in the definition, strings without their quotes.
};

struct MessageDefinition {
  std::string type;  ///< "pkg/msg/Type".
  std::vector<Field> fields;
  std::vector<Constant> constants;
};

/// A message type with all that it uses, read from the text of a `ros2msg` schema: the definition
/// of the type, then for each dependency a line of 80 '=', a line "MSG: pkg/Type" and its
/// definition (design.ros2.org, "Interface definition").
class MessageSchema {
 public:
  /// `type` is the name of the first definition, "pkg/msg/Type" or "pkg/Type".
  /// All problems of the text are in the message of the status, with their lines. Types that nest
  /// themselves, that are not defined, or deeper than 64 are refused.
  static Result<MessageSchema> parse(const std::string& type, const std::string& text);

  [[nodiscard]] const MessageDefinition& root() const { return definitions_.at(root_); }
  /// Of a type that a field names; all of them exist.
  [[nodiscard]] const MessageDefinition& definition(const std::string& type) const {
    return definitions_.at(type);
  }
  [[nodiscard]] const std::map<std::string, MessageDefinition>& definitions() const {
    return definitions_;
  }

 private:
  std::string root_;
  std::map<std::string, MessageDefinition> definitions_;
};

/// Bytes of a number or bool in CDR, which is also its alignment; 0 for strings and messages.
[[nodiscard]] std::size_t size_of(FieldKind kind);

/// The word of a definition: "int32".
[[nodiscard]] std::string to_string(FieldKind kind);

/// "pkg/Type" -> "pkg/msg/Type"; others stay.
[[nodiscard]] std::string full_type_name(const std::string& type);

}  // namespace camvox::storage
