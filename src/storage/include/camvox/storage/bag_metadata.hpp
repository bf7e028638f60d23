#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// A topic of a bag, as metadata.yaml lists it.
struct BagTopicMetadata {
  std::string name;
  std::string type;  ///< For instance "sensor_msgs/msg/Imu".
  std::string serialization_format = "cdr";
  std::string offered_qos_profiles;   ///< YAML list, see qos_profile.hpp.
  std::string type_description_hash;  ///< "RIHS01_..." or empty.
  std::uint64_t message_count = 0;
  friend bool operator==(const BagTopicMetadata&, const BagTopicMetadata&) = default;
};

/// A file of a bag, as metadata.yaml lists it.
struct BagFileMetadata {
  std::string path;  ///< Relative to the bag's folder.
  std::int64_t starting_time_ns = 0;
  std::int64_t duration_ns = 0;
  std::uint64_t message_count = 0;
  friend bool operator==(const BagFileMetadata&, const BagFileMetadata&) = default;
};

/// Content of a bag's metadata.yaml (rosbag2_storage's BagMetadata).
struct BagMetadata {
  /// Decides on the keys: 5 (Humble) `files`, 6 `custom_data`, 7 (Iron) `type_description_hash`,
  /// 8 `ros_distro`, 9 (Jazzy) QoS words instead of numbers. 8 is read by all of them.
  int version = 8;
  std::string storage_identifier = "mcap";
  std::int64_t duration_ns = 0;
  std::int64_t starting_time_ns = 0;
  std::uint64_t message_count = 0;
  std::vector<BagTopicMetadata> topics;
  std::string compression_format;
  std::string compression_mode;
  std::vector<BagFileMetadata> files;
  std::map<std::string, std::string> custom_data;
  std::string ros_distro;
  friend bool operator==(const BagMetadata&, const BagMetadata&) = default;
};

/// Without the top key of metadata.yaml, as in the MCAP metadata record `rosbag2`. Always with QoS
/// as text, which the readers of version 9 also accept.
[[nodiscard]] std::string to_yaml(const BagMetadata& metadata);

/// With or without the top key; versions 1 to 9.
Result<BagMetadata> parse_bag_metadata(const std::string& yaml);

/// `metadata.yaml` of a bag's folder. Written aside and then renamed: there is never half a file.
Status write_bag_metadata(const std::filesystem::path& folder, const BagMetadata& metadata);
Result<BagMetadata> read_bag_metadata(const std::filesystem::path& folder);

}  // namespace camvox::storage
