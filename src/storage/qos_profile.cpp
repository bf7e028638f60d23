#include "camvox/storage/qos_profile.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>

namespace camvox::storage {
namespace {

/// Words of each enum, at the place of their number.
using Words = std::vector<std::string>;

const Words& history_words() {
  static const Words words = {"system_default", "keep_last", "keep_all", "unknown"};
  return words;
}
const Words& reliability_words() {
  static const Words words = {
      "system_default", "reliable", "best_effort", "unknown", "best_available"};
  return words;
}
const Words& durability_words() {
  static const Words words = {
      "system_default", "transient_local", "volatile", "unknown", "best_available"};
  return words;
}
const Words& liveliness_words() {
  static const Words words = {"system_default",
                              "automatic",
                              "manual_by_node",
                              "manual_by_topic",
                              "unknown",
                              "best_available"};
  return words;
}

template <typename Enum>
void read_enum(const YAML::Node& node, const Words& words, Enum& value) {
  if (!node) return;
  const auto word = std::find(words.begin(), words.end(), node.as<std::string>());
  const std::size_t number =
      word != words.end() ? static_cast<std::size_t>(word - words.begin()) : node.as<std::size_t>();
  if (number >= words.size()) throw YAML::Exception(node.Mark(), "no such QoS policy");
  value = static_cast<Enum>(number);
}

void read_duration(const YAML::Node& node, QosDuration& value) {
  if (!node) return;
  value.sec = node["sec"].as<std::uint64_t>();
  value.nsec = node["nsec"].as<std::uint64_t>();
}

QosProfile read_profile(const YAML::Node& node) {
  QosProfile profile;
  read_enum(node["history"], history_words(), profile.history);
  if (node["depth"]) profile.depth = node["depth"].as<std::uint64_t>();
  read_enum(node["reliability"], reliability_words(), profile.reliability);
  read_enum(node["durability"], durability_words(), profile.durability);
  read_duration(node["deadline"], profile.deadline);
  read_duration(node["lifespan"], profile.lifespan);
  read_enum(node["liveliness"], liveliness_words(), profile.liveliness);
  read_duration(node["liveliness_lease_duration"], profile.liveliness_lease_duration);
  if (const auto avoid = node["avoid_ros_namespace_conventions"]) {
    profile.avoid_ros_namespace_conventions = avoid.as<bool>();
  }
  return profile;
}

std::string duration_text(const char* key, const QosDuration& value) {
  return std::string("  ") + key + ":\n    sec: " + std::to_string(value.sec) +
         "\n    nsec: " + std::to_string(value.nsec) + "\n";
}

std::string number_text(const char* key, std::uint64_t value) {
  return std::string("  ") + key + ": " + std::to_string(value) + "\n";
}

std::string profile_text(const QosProfile& p) {
  const auto number = [](auto value) { return static_cast<std::uint64_t>(value); };
  std::string text = number_text("history", number(p.history)) + number_text("depth", p.depth) +
                     number_text("reliability", number(p.reliability)) +
                     number_text("durability", number(p.durability)) +
                     duration_text("deadline", p.deadline) + duration_text("lifespan", p.lifespan) +
                     number_text("liveliness", number(p.liveliness)) +
                     duration_text("liveliness_lease_duration", p.liveliness_lease_duration) +
                     "  avoid_ros_namespace_conventions: " +
                     (p.avoid_ros_namespace_conventions ? "true" : "false");
  text[0] = '-';
  return text;
}

}  // namespace

std::string to_yaml(const std::vector<QosProfile>& profiles) {
  std::string text;
  for (const auto& profile : profiles) text += (text.empty() ? "" : "\n") + profile_text(profile);
  return text;
}

Result<std::vector<QosProfile>> parse_qos_profiles(const std::string& yaml) {
  std::vector<QosProfile> profiles;
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (!root.IsNull() && !root.IsSequence()) {
      return Status(StatusCode::kCorrupt, "offered_qos_profiles is not a list");
    }
    for (const auto& node : root) profiles.push_back(read_profile(node));
  } catch (const YAML::Exception& error) {
    return Status(StatusCode::kCorrupt,
                  std::string("offered_qos_profiles cannot be read: ") + error.what());
  }
  return profiles;
}

Result<std::map<std::string, QosProfile>> parse_qos_overrides(const std::string& yaml,
                                                              const std::string& origin) {
  static const Words kKeys = {"history",
                              "depth",
                              "reliability",
                              "durability",
                              "deadline",
                              "lifespan",
                              "liveliness",
                              "liveliness_lease_duration",
                              "avoid_ros_namespace_conventions"};
  std::map<std::string, QosProfile> overrides;
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (!root.IsMap()) throw YAML::Exception(root.Mark(), "expected topics with their policies");
    for (const auto& topic : root) {
      if (!topic.second.IsMap()) throw YAML::Exception(topic.second.Mark(), "expected policies");
      for (const auto& policy : topic.second) {
        const auto key = policy.first.as<std::string>();
        if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
          throw YAML::Exception(policy.first.Mark(), "no such QoS policy: " + key);
        }
      }
      overrides[topic.first.as<std::string>()] = read_profile(topic.second);
    }
  } catch (const YAML::Exception& error) {
    const auto line = error.mark.is_null() ? std::string() : std::to_string(error.mark.line + 1);
    return Status(StatusCode::kInvalid, origin + ":" + line + ": " + error.msg);
  }
  return overrides;
}

}  // namespace camvox::storage
