#include "camvox/interfaces/qos.hpp"

namespace camvox::interfaces {

std::string to_string(const Qos& qos) {
  return "keep_last(" + std::to_string(qos.depth) + "), " +
         (qos.reliable ? "reliable" : "best_effort") + ", " +
         (qos.latched ? "transient_local" : "volatile");
}

std::string to_rosbag2_yaml(const Qos& qos) {
  // rosbag2's integers (keep_last 1; reliable 1, best_effort 2; transient_local 1, volatile 2):
  // every distribution reads them. Infinite durations are rmw's.
  static const std::string kInfinite = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return "- history: 1\n  depth: " + std::to_string(qos.depth) +
         "\n  reliability: " + (qos.reliable ? "1" : "2") +
         "\n  durability: " + (qos.latched ? "1" : "2") + "\n  deadline:" + kInfinite +
         "  lifespan:" + kInfinite + "  liveliness: 1\n  liveliness_lease_duration:" + kInfinite +
         "  avoid_ros_namespace_conventions: false\n";
}

}  // namespace camvox::interfaces
