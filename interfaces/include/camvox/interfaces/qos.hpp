#pragma once

#include <string>

namespace camvox::interfaces {

/// Quality of service of one endpoint, in ROS 2's words. History is always KEEP_LAST.
struct Qos {
  int depth = 10;        ///< Samples that wait for a slow reader; the oldest goes first.
  bool reliable = true;  ///< Repeat what the network lost (writer); demand it (reader).
  bool latched = false;  ///< TRANSIENT_LOCAL: a late reader gets the last `depth` samples.

  friend bool operator==(const Qos&, const Qos&) = default;
};

/// Publish reliable, subscribe best-effort: matches every driver and every tool.
/// Profiles of rmw/qos_profiles.h; the sensor profile's writer side is reliable on purpose.
namespace qos {
inline constexpr Qos kDefault{10, true, false};
inline constexpr Qos kSensorReader{5, false, false};
inline constexpr Qos kSensorWriter{5, true, false};
inline constexpr Qos kServices{10, true, false};
inline constexpr Qos kClock{1, false, false};
inline constexpr Qos kTransforms{100, true, false};
inline constexpr Qos kStaticTransformsWriter{1, true, true};
inline constexpr Qos kStaticTransformsReader{100, true, true};
inline constexpr Qos kDiagnostics{10, true, false};

/// Internal topics: a short queue, so that a late component works on new data.
inline constexpr Qos kFrames{4, true, false};
/// Internal topics where each message matters to the map.
inline constexpr Qos kKeyframes{32, true, false};
/// The last value is the state: extrinsics, maps.
inline constexpr Qos kState{1, true, true};
}  // namespace qos

/// "keep_last(5), reliable, volatile", for people.
[[nodiscard]] std::string to_string(const Qos& qos);

/// The YAML list that rosbag2 stores as `offered_qos_profiles`.
[[nodiscard]] std::string to_rosbag2_yaml(const Qos& qos);

}  // namespace camvox::interfaces
