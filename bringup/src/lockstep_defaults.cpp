#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "camvox/bringup/probe.hpp"
#include "camvox/component/progress.hpp"
#include "lockstep.hpp"

namespace camvox::bringup {
namespace {

constexpr auto kTopicKey = "lockstep_topic";
/// Ports at which a component takes the frames that lockstep counts.
constexpr std::array<std::string_view, 2> kFramePorts = {"image", "compressed_image"};

using Names = std::vector<std::string>;

Names frame_reporters(const std::vector<ProbedComponent>& components, const std::string& topic) {
  Names names;
  for (const auto& component : components) {
    const auto* frames = find_port(component, ProgressReporter::kFrames.name);
    if (frames != nullptr && frames->is_output && frames->topic == topic)
      names.push_back(component.name);
  }
  return names;
}

/// Topics that somebody here reads frames from.
Names frame_topics(const std::vector<ProbedComponent>& components) {
  Names topics;
  for (const auto& component : components) {
    for (const auto name : kFramePorts) {
      const auto* port = find_port(component, name);
      if (port != nullptr && !port->is_output) topics.push_back(port->topic);
    }
  }
  return topics;
}

std::optional<std::string> recorded_frames(const Names& recorded,
                                           const Names& rules,
                                           const Names& read) {
  for (const auto& wanted : read) {
    const auto found = std::find_if(recorded.begin(), recorded.end(), [&](const auto& topic) {
      return replayed_as(topic, rules) == wanted;
    });
    if (found != recorded.end()) return *found;
  }
  return std::nullopt;
}

bool holds_frames(const Names& recorded, const std::string& topic) {
  return std::any_of(recorded.begin(), recorded.end(), [&topic](const auto& name) {
    return name == topic || name == topic + "/compressed";
  });
}

config::Parameter derived(config::Value value) { return {std::move(value), {"lockstep", 0}}; }

}  // namespace

std::string replayed_as(const std::string& topic, const std::vector<std::string>& rules) {
  for (const auto& rule : rules) {
    if (rule.starts_with(topic + ":=")) return rule.substr(topic.size() + 2);
  }
  return topic;
}

bool give_lockstep_defaults(const ProbedSystem& system,
                            const ProbedComponent& replay,
                            ComponentConfig& config) {
  const auto* progress = find_port(replay, ProgressReporter::kFrames.name);
  if (progress == nullptr || progress->is_output || !replay.value<bool>("lockstep")) return false;
  bool given = false;
  if (!config.parameters.contains(kLockstepComponents)) {
    config.parameters[kLockstepComponents] =
        derived(frame_reporters(system.components, progress->topic));
    given = true;
  }
  const auto* recorded = system.recording_of(replay);
  if (recorded == nullptr || config.parameters.contains(kTopicKey)) return given;
  const auto frames =
      recorded_frames(*recorded, replay.value<Names>("remap"), frame_topics(system.components));
  if (frames) config.parameters[kTopicKey] = derived(*frames);
  return given || frames.has_value();
}

std::vector<Problem> check_lockstep_topic(const ProbedSystem& system,
                                          const ProbedComponent& replay) {
  const auto* recorded = system.recording_of(replay);
  if (recorded == nullptr || recorded->empty()) return {};
  const auto topic = replay.value<std::string>(kTopicKey);
  if (topic.empty() || holds_frames(*recorded, topic)) return {};
  const auto& parameter = replay.effective_parameters.at(kTopicKey);
  const auto key = replay.name + ".parameters." + kTopicKey;
  const auto holds =
      fmt::format("{} holds {}", replay.value<std::string>("bag"), fmt::join(*recorded, ", "));
  const auto read = frame_topics(system.components);
  if (parameter.location.to_string() != "default" || read.empty())
    return {{parameter.location, key, fmt::format("no frames on {}: {}", topic, holds)}};
  return {{replay.effective_parameters.at("bag").location,
           key,
           fmt::format("nothing recorded comes on {}, where images are read: {}; remap 'image' or "
                       "'compressed_image' of sync",
                       fmt::join(read, " or "),
                       holds)}};
}

}  // namespace camvox::bringup
