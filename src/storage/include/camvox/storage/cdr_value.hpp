#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/message_schema.hpp"

namespace camvox::storage {

struct CdrValue;

/// A field with its value, in the order of the definition.
struct CdrMember;

using CdrMembers = std::vector<CdrMember>;
using CdrList = std::vector<CdrValue>;

/// Array of numbers or bools, in place: a 2.6 MB image stays one view. `element(i)` decodes one.
struct CdrArray {
  FieldKind kind = FieldKind::kUint8;
  Bytes bytes;  ///< Not aligned; little-endian unless `swapped`.
  bool swapped = false;

  [[nodiscard]] std::size_t size() const { return bytes.size() / size_of(kind); }
  [[nodiscard]] CdrValue element(std::size_t index) const;
};

/// A value of any message, decoded from CDR by its schema. Integers of all widths are 64 bits here.
struct CdrValue {
  std::variant<std::monostate,
               bool,
               std::int64_t,
               std::uint64_t,
               float,
               double,
               std::string,
               CdrArray,
               CdrList,
               CdrMembers>
      data;

  /// Field of a message by name, or element of an array by number, along a path like
  /// "header.stamp.sec" or "transforms[0].child_frame_id"; nothing when there is none.
  [[nodiscard]] std::optional<CdrValue> at(std::string_view path) const;

  /// Any number or bool as such; nothing for other values.
  [[nodiscard]] std::optional<double> as_double() const;
  [[nodiscard]] std::optional<std::int64_t> as_integer() const;
};

struct CdrMember {
  std::string name;
  CdrValue value;
};

/// Decodes a message (with its 4-byte encapsulation head: CDR or PL-free XCDR1, both byte orders).
/// Views in the result are of `cdr`. kTruncated when the data end early, kCorrupt when a length
/// makes no sense, kLimit over a million values. Arrays of numbers count as one.
Result<CdrValue> decode_cdr(const MessageSchema& schema, Bytes cdr);

/// The field `header.stamp` (or `stamp`) in nanoseconds; nothing when the message has none.
[[nodiscard]] std::optional<std::int64_t> header_stamp_ns(const CdrValue& message);

struct YamlStyle {
  std::size_t max_array_length = 128;  ///< Longer arrays end with '...', like `ros2 topic echo`.
  bool hide_arrays = false;            ///< "<sequence type: uint8, length: 7>" instead of values.
  bool hide_strings = false;
  bool flow = false;  ///< Arrays in one line.
};

/// YAML as `ros2 topic echo` prints it (without the closing "---").
[[nodiscard]] std::string to_yaml(const CdrValue& value, const YamlStyle& style = {});

}  // namespace camvox::storage
