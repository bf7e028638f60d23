#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "camvox/storage/bag_metadata.hpp"
#include "camvox/storage/writer.hpp"

namespace camvox::storage {

/// A topic and all that somebody who reads its messages needs to know.
struct BagTopic {
  std::string name;
  std::string type;                         ///< "sensor_msgs/msg/Imu".
  std::string schema_encoding = "ros2msg";  ///< "ros2msg" or "ros2idl".
  std::string schema;                       ///< Definition of the type and of all that it uses.
  std::string serialization_format = "cdr";
  std::string offered_qos_profiles;   ///< YAML list, see qos_profile.hpp.
  std::string type_description_hash;  ///< "RIHS01_..." or empty.
  std::uint64_t message_count = 0;    ///< Filled by the reader.
  friend bool operator==(const BagTopic&, const BagTopic&) = default;
};

struct BagWriterOptions {
  McapWriterOptions mcap;
  Durability durability = Durability::kProcessCrash;
  std::uint64_t max_file_size = 0;         ///< Start a new file from this size on; 0: never.
  std::uint64_t max_file_duration_ns = 0;  ///< Start a new file after this time; 0: never.
  int metadata_version = 8;                ///< See BagMetadata::version.
  std::map<std::string, std::string> custom_data;
  std::string ros_distro;
};

/// Writes a bag as `ros2 bag record -s mcap` does: a folder `name` with `name_0.mcap`,
/// `name_1.mcap` and so on, and `metadata.yaml`, brought up to date at each new file and at the
/// end. The first error is returned by that call and by all later ones. Not thread-safe.
class BagWriter {
 public:
  /// Makes the folder, which must not exist yet.
  static Result<std::unique_ptr<BagWriter>> create(const std::filesystem::path& folder,
                                                   BagWriterOptions options = {});
  /// Closes the bag if nobody did; an error is then lost.
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// Number of the topic for `write`.
  Result<std::size_t> add_topic(BagTopic topic);

  /// Times are nanoseconds since the Unix epoch. Data is copied or written before this returns.
  Status write(std::size_t topic,
               std::int64_t log_time_ns,
               std::int64_t publish_time_ns,
               Bytes data,
               std::uint32_t sequence = 0);

  /// Goes on in a new file.
  Status split();

  /// Closes the open chunk: all messages so far are then in the file.
  Status flush();

  Status close();

  [[nodiscard]] const BagMetadata& metadata() const { return metadata_; }
  [[nodiscard]] std::filesystem::path current_file() const;

  /// Called after a file was closed and the next one opened, with both paths.
  std::function<void(const std::filesystem::path& closed, const std::filesystem::path& opened)>
      on_split;

 private:
  BagWriter(std::filesystem::path folder, BagWriterOptions options);
  Status open_file();
  Status close_file();
  [[nodiscard]] bool full(std::int64_t log_time_ns) const;
  [[nodiscard]] Metadata rosbag2_record() const;
  Status add_to_file(const BagTopic& topic);
  void count(std::size_t topic, std::int64_t log_time_ns);

  std::filesystem::path folder_;
  BagWriterOptions options_;
  std::vector<BagTopic> topics_;
  BagMetadata metadata_;
  std::unique_ptr<McapWriter> writer_;
  std::vector<std::uint16_t> channel_ids_;  ///< In the open file, by topic.
  Status status_;
};

}  // namespace camvox::storage
