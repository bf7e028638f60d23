#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// Seconds and nanoseconds of a QoS deadline or lifespan.
struct QosDuration {
  std::uint64_t sec = 9223372036;  ///< The defaults mean infinite.
  std::uint64_t nsec = 854775807;
  friend bool operator==(const QosDuration&, const QosDuration&) = default;
};

/// QoS of a publisher as ROS 2 records it. The numbers are those of rmw and of metadata.yaml.
struct QosProfile {
  enum class History { kSystemDefault, kKeepLast, kKeepAll, kUnknown };
  enum class Reliability { kSystemDefault, kReliable, kBestEffort, kUnknown, kBestAvailable };
  enum class Durability { kSystemDefault, kTransientLocal, kVolatile, kUnknown, kBestAvailable };
  enum class Liveliness {
    kSystemDefault,
    kAutomatic,
    kManualByNode,
    kManualByTopic,
    kUnknown,
    kBestAvailable
  };

  History history = History::kKeepLast;
  std::uint64_t depth = 10;
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  QosDuration deadline;
  QosDuration lifespan;
  Liveliness liveliness = Liveliness::kAutomatic;
  QosDuration liveliness_lease_duration;
  bool avoid_ros_namespace_conventions = false;

  friend bool operator==(const QosProfile&, const QosProfile&) = default;
};

/// The text of `offered_qos_profiles`: a YAML list, with numbers for the enums, which every ROS 2
/// distribution reads (Humble does not read words).
[[nodiscard]] std::string to_yaml(const std::vector<QosProfile>& profiles);

/// Reads such a list, enums as numbers or words; missing keys keep their default. Empty text is an
/// empty list.
Result<std::vector<QosProfile>> parse_qos_profiles(const std::string& yaml);

/// Reads a file of QoS overrides as `ros2 bag` takes it: a map from topics to profiles. `origin`
/// is the file's name for messages.
Result<std::map<std::string, QosProfile>> parse_qos_overrides(const std::string& yaml,
                                                              const std::string& origin);

}  // namespace camvox::storage
