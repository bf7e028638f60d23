#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace camvox::interfaces {

/// Everything that the middleware, the recorder and the command line need to know of one message.
///
/// *Plain* messages have a fixed layout and live in loaned memory; inside a container they are
/// read in place. *ROS* messages hold strings and sequences and are serialised at every hop.
/// Outside the container both are CDR that ROS 2 can read: a plain message crosses as the ROS 2
/// message described by `schema`, with only the used part of its lists.
struct MessageType {
  std::string ros_name;     ///< "sensor_msgs/msg/Imu"
  std::string dds_name;     ///< "sensor_msgs::msg::dds_::Imu_"
  std::string type_hash;    ///< RIHS01_... (REP-2016)
  std::string_view schema;  ///< Definition with dependencies, MCAP encoding "ros2msg".
  bool plain = false;
  std::size_t size = 0;  ///< sizeof the C++ struct.

  void* (*create)() = nullptr;       ///< A default-constructed message on the heap.
  void (*destroy)(void*) = nullptr;  ///< Frees what `create` gave.
  /// Back to a default message; the rows of a plain message's lists stay as they are.
  void (*reset)(void* message) = nullptr;
  /// Copies a message; of a plain one only the used part, so that capacity costs nothing.
  void (*copy)(const void* from, void* to) = nullptr;
  /// False if a counter of a plain message exceeds its list's capacity. Others: always true.
  bool (*counters_valid)(const void* message) = nullptr;

  /// Bytes of the CDR form with its four-byte encapsulation, as on the wire and in a recording.
  std::size_t (*cdr_size)(const void* message) = nullptr;
  /// Writes the CDR form; returns its size, or 0 if the message is invalid or does not fit.
  std::size_t (*write_cdr)(const void* message, std::uint8_t* data, std::size_t size) = nullptr;
  /// Reads CDR into an existing message; false if it is malformed or over capacity.
  bool (*read_cdr)(const std::uint8_t* data, std::size_t size, void* message) = nullptr;

  /// The CDR form as a vector; empty if the message is invalid.
  [[nodiscard]] std::vector<std::uint8_t> to_cdr(const void* message) const;
};

/// The description of message type T, e.g. `message_type<sensor_msgs::msg::Imu>()`.
/// Include "camvox/interfaces/<package>.hpp" for the messages of a package.
template <typename T>
const MessageType& message_type();

/// All message types of this package, in a fixed order.
[[nodiscard]] std::vector<const MessageType*> all_message_types();

/// Looks a type up by its ROS ("pkg/msg/Name") or DDS name; nullptr if there is none.
[[nodiscard]] const MessageType* find_message_type(std::string_view name);

/// "sensor_msgs/msg/Imu" -> "sensor_msgs::msg::dds_::Imu_".
[[nodiscard]] std::string to_dds_type_name(std::string_view ros_name);
/// "sensor_msgs::msg::dds_::Imu_" -> "sensor_msgs/msg/Imu"; other names come back unchanged.
[[nodiscard]] std::string to_ros_type_name(std::string_view dds_name);

/// The ROS-type descriptor under another package name, for drivers that renamed their messages
/// (livox_interfaces/msg/CustomMsg is livox_ros_driver2/msg/CustomMsg).
[[nodiscard]] MessageType renamed(const MessageType& type, std::string_view ros_name);

/// An owned message of a type known at run time.
using AnyMessage = std::shared_ptr<void>;
[[nodiscard]] AnyMessage make_message(const MessageType& type);

}  // namespace camvox::interfaces
