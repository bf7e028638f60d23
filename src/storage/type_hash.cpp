#include "camvox/storage/type_hash.hpp"

#include <openssl/sha.h>

#include <array>

namespace camvox::storage {
namespace {

/// type_description_interfaces/msg/FieldType: number of the kind; arrays, bounded and unbounded
/// sequences of it are 48, 96 and 144 further on.
int type_id(const Field& field) {
  const bool bounded = field.string_capacity > 0;
  const auto base = [&] {
    switch (field.kind) {
      case FieldKind::kMessage:
        return 1;
      case FieldKind::kInt8:
        return 2;
      case FieldKind::kUint8:
      case FieldKind::kChar:  // `char` of a .msg is uint8
        return 3;
      case FieldKind::kInt16:
        return 4;
      case FieldKind::kUint16:
        return 5;
      case FieldKind::kInt32:
        return 6;
      case FieldKind::kUint32:
        return 7;
      case FieldKind::kInt64:
        return 8;
      case FieldKind::kUint64:
        return 9;
      case FieldKind::kFloat32:
        return 10;
      case FieldKind::kFloat64:
        return 11;
      case FieldKind::kBool:
        return 15;
      case FieldKind::kByte:
        return 16;
      case FieldKind::kString:
        return bounded ? 21 : 17;
      case FieldKind::kWstring:
        return bounded ? 22 : 18;
    }
    return 0;
  };
  switch (field.array) {
    case FieldArray::kNone:
      return base();
    case FieldArray::kFixed:
      return base() + 48;
    case FieldArray::kBounded:
      return base() + 96;
    case FieldArray::kUnbounded:
      return base() + 144;
  }
  return 0;
}

std::string field_json(const std::string& name, const Field& field) {
  return R"({"name": ")" + name + R"(", "type": {"type_id": )" + std::to_string(type_id(field)) +
         R"(, "capacity": )" + std::to_string(field.array_size) + R"(, "string_capacity": )" +
         std::to_string(field.string_capacity) + R"(, "nested_type_name": ")" + field.message_type +
         "\"}}";
}

std::string definition_json(const MessageDefinition& definition) {
  std::string fields;
  for (const auto& field : definition.fields) {
    fields += (fields.empty() ? "" : ", ") + field_json(field.name, field);
  }
  if (definition.fields.empty()) {
    Field dummy;
    dummy.kind = FieldKind::kUint8;
    fields = field_json("structure_needs_at_least_one_member", dummy);
  }
  return R"({"type_name": ")" + definition.type + R"(", "fields": [)" + fields + "]}";
}

}  // namespace

std::string type_hash(const MessageSchema& schema) {
  std::string referenced;
  for (const auto& [type, definition] : schema.definitions()) {
    if (type == schema.root().type) continue;
    referenced += (referenced.empty() ? "" : ", ") + definition_json(definition);
  }
  const std::string json = R"({"type_description": )" + definition_json(schema.root()) +
                           R"(, "referenced_type_descriptions": [)" + referenced + "]}";
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  SHA256(reinterpret_cast<const unsigned char*>(json.data()), json.size(), digest.data());
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "RIHS01_";
  for (const unsigned byte : digest) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xFU];
  }
  return text;
}

}  // namespace camvox::storage
