#include "trajectory_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "bag_message.hpp"
#include "camvox/interfaces/geometry_msgs.hpp"
#include "camvox/interfaces/header.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/trajectory/gnss.hpp"
#include "camvox/trajectory/trajectory_file.hpp"
#include "command.hpp"

namespace camvox::command {
namespace {

constexpr std::array kTypes = {
    "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/NavSatFix"};

template <typename T>
T unwrap(storage::Result<T> result) {
  if (!result.ok()) throw CommandError(result.status().message());
  return *std::move(result);
}

const storage::BagTopic& choose_topic(const storage::BagReader& bag, const std::string& wanted) {
  const auto& topics = bag.topics();
  const auto usable = [](const storage::BagTopic& topic) {
    return std::find(kTypes.begin(), kTypes.end(), topic.type) != kTypes.end();
  };
  std::vector<const storage::BagTopic*> found;
  for (const auto& topic : topics) {
    if (usable(topic) && (wanted.empty() || topic.name == wanted)) found.push_back(&topic);
  }
  if (found.empty()) {
    std::string names;
    for (const auto& topic : topics) {
      if (usable(topic)) names += (names.empty() ? "" : ", ") + topic.name;
    }
    if (names.empty()) throw CommandError("the bag has no topic with poses");
    throw CommandError(fmt::format("no topic {} with poses (there are: {})", wanted, names));
  }
  const auto truth = std::find_if(found.begin(), found.end(), [](const auto* topic) {
    return topic->name.find("truth") != std::string::npos;
  });
  return truth != found.end() ? **truth : *found.front();
}

template <typename Pose>
geometry::SE3 to_se3(const Pose& pose) {
  const auto& p = pose.position();
  const auto& q = pose.orientation();
  return {geometry::SO3(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z())), {p.x(), p.y(), p.z()}};
}

trajectory::Trajectory read_topic(const storage::BagReader& bag, const storage::BagTopic& topic) {
  trajectory::Trajectory poses;
  std::vector<trajectory::GnssFix> fixes;
  storage::MessageFilter filter;
  filter.topics = {topic.name};
  auto cursor = bag.messages(filter);
  while (const auto* raw = cursor.next()) {
    if (topic.type == kTypes[0]) {
      const auto message = decode<nav_msgs::msg::Odometry>(*raw, topic.name);
      poses.push_back({interfaces::stamp_of(message.header()), to_se3(message.pose().pose())});
    } else if (topic.type == kTypes[1]) {
      const auto message = decode<geometry_msgs::msg::PoseStamped>(*raw, topic.name);
      poses.push_back({interfaces::stamp_of(message.header()), to_se3(message.pose())});
    } else {
      const auto fix = decode<sensor_msgs::msg::NavSatFix>(*raw, topic.name);
      fixes.push_back(
          {interfaces::stamp_of(fix.header()), fix.latitude(), fix.longitude(), fix.altitude()});
    }
  }
  if (!cursor.status().ok()) throw CommandError(cursor.status().message());
  std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  return fixes.empty() ? poses : trajectory::to_enu(fixes);
}

}  // namespace

trajectory::Trajectory load_trajectory(const std::filesystem::path& path,
                                       const std::string& topic) {
  const bool is_bag = std::filesystem::is_directory(path) || path.extension() == ".mcap";
  if (!is_bag) return unwrap(trajectory::read_trajectory(path));
  const auto bag = unwrap(storage::BagReader::open(path));
  return read_topic(*bag, choose_topic(*bag, topic));
}

}  // namespace camvox::command
