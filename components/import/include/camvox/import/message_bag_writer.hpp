#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "camvox/interfaces/message_type.hpp"
#include "camvox/interfaces/qos.hpp"
#include "camvox/storage/bag_writer.hpp"

namespace camvox::import {

/// A topic that was written, and how much.
struct WrittenTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/msg/Imu".
  std::uint64_t message_count = 0;
  std::int64_t first_time_ns = 0;  ///< Log times, lowest and highest.
  std::int64_t last_time_ns = 0;
};

/// Writes typed messages into a bag: serialises them, and stores with each topic what a reader
/// needs (definition, type hash, QoS). For importers and simulators, which have messages and no
/// middleware. Not thread-safe.
class MessageBagWriter {
 public:
  /// Makes the folder, which must not exist yet.
  static storage::Result<std::unique_ptr<MessageBagWriter>> create(
      const std::filesystem::path& folder, storage::BagWriterOptions options = {});

  /// Adds a topic before its first message, with a QoS of the caller's choice. kInvalid if the
  /// topic exists with another type.
  storage::Status add_topic(const std::string& topic,
                            const interfaces::MessageType& type,
                            const interfaces::Qos& qos);

  /// Writes a message, and adds its topic if that is new: with the QoS of static transforms for
  /// /tf_static, and the default QoS for all others. kInvalid if the message cannot be serialised
  /// or the topic has another type.
  template <typename T>
  storage::Status write(const std::string& topic, std::int64_t log_time_ns, const T& message) {
    return write(topic, log_time_ns, interfaces::message_type<T>(), &message);
  }
  storage::Status write(const std::string& topic,
                        std::int64_t log_time_ns,
                        const interfaces::MessageType& type,
                        const void* message);

  /// Writes a message that is CDR already, with its four-byte encapsulation.
  storage::Status write_cdr(const std::string& topic,
                            std::int64_t log_time_ns,
                            const interfaces::MessageType& type,
                            std::span<const std::uint8_t> cdr);

  storage::Status close() { return bag_->close(); }

  /// In the order in which they were added.
  [[nodiscard]] const std::vector<WrittenTopic>& topics() const { return topics_; }

 private:
  explicit MessageBagWriter(std::unique_ptr<storage::BagWriter> bag) : bag_(std::move(bag)) {}
  storage::Result<std::size_t> number_of(const std::string& topic,
                                         const interfaces::MessageType& type);

  std::unique_ptr<storage::BagWriter> bag_;
  std::vector<WrittenTopic> topics_;  ///< By number in the bag.
  std::vector<std::uint8_t> cdr_;
};

}  // namespace camvox::import
