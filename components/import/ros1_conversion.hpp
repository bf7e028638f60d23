#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "camvox/storage/byte_io.hpp"
#include "camvox/storage/message_schema.hpp"

namespace camvox::import {

/// Turns messages as ROS 1 serialises them (packed, little-endian, wiki.ros.org/msg) into CDR of a
/// ROS 2 type. The two definitions are walked side by side once, into a list of steps; each message
/// then follows the steps.
class Ros1Conversion {
 public:
  /// `definition` is that of a ROS 1 bag. Throws ImportError with the first difference if the types
  /// are not the same but for `seq` of Header (dropped) and `tag` of CustomPoint (0 if absent).
  Ros1Conversion(const std::string& ros1_type,
                 const std::string& definition,
                 const storage::MessageSchema& target);

  /// Replaces `cdr` by the message with its encapsulation; false if the data do not fit the type.
  [[nodiscard]] bool convert(storage::Bytes message, std::vector<std::uint8_t>& cdr) const;

 private:
  /// What to do with the next field. A nested message is its steps, in line.
  struct Step {
    enum class Kind { kNumber, kBool, kString, kMessages, kDrop, kZero };
    Kind kind = Kind::kNumber;
    std::size_t size = 0;  ///< Bytes of a number.
    storage::FieldArray array = storage::FieldArray::kNone;
    std::size_t count = 1;      ///< Elements of a fixed array.
    std::vector<Step> element;  ///< Of each message in an array.
  };
  using Steps = std::vector<Step>;

  static Steps plan(const storage::MessageSchema& from,
                    const storage::MessageDefinition& source,
                    const storage::MessageSchema& to,
                    const storage::MessageDefinition& target);
  static void plan_field(const storage::MessageSchema& from,
                         const storage::Field& source,
                         const storage::MessageSchema& to,
                         const storage::Field& target,
                         Steps& steps);
  static bool run(const Steps& steps, storage::ByteReader& in, std::vector<std::uint8_t>& cdr);
  static bool run_step(const Step& step, storage::ByteReader& in, std::vector<std::uint8_t>& cdr);

  Steps steps_;
};

/// The definition of a ROS 1 bag in the words of ROS 2: Header, time and duration by their full
/// names, field names in lower case (CameraInfo has D, K, R, P), no comments, no constants.
[[nodiscard]] std::string to_ros2_definition(const std::string& ros1_definition);

}  // namespace camvox::import
