/// libFuzzer target: schema texts, messages and YAML from a file that cannot be trusted. The input
/// is a schema text, a zero byte, then the message (and all of it once more as YAML).
#include <algorithm>
#include <cstdint>

#include "camvox/storage/bag_metadata.hpp"
#include "camvox/storage/cdr_value.hpp"
#include "camvox/storage/message_schema.hpp"
#include "camvox/storage/qos_profile.hpp"
#include "camvox/storage/type_hash.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace camvox::storage;
  const std::string input(reinterpret_cast<const char*>(data), size);
  const std::size_t split = std::min(input.find('\0'), input.size());
  (void)parse_qos_profiles(input).ok();
  (void)parse_bag_metadata(input).ok();
  const auto schema = MessageSchema::parse("pkg/msg/Type", input.substr(0, split));
  if (!schema.ok()) return 0;
  (void)type_hash(*schema);
  const auto message = std::string_view(input).substr(std::min(split + 1, size));
  const auto value = decode_cdr(*schema, as_bytes(message));
  if (!value.ok()) return 0;
  (void)header_stamp_ns(*value);
  (void)to_yaml(*value);
  (void)to_yaml(*value, {.max_array_length = 3, .flow = true});
  return 0;
}
