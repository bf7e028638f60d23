#include "recorded_inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace camvox::command {
namespace {

using bringup::ProbedComponent;
using Names = std::vector<std::string>;

/// Sensor inputs by their ports; an image may come in either way.
const std::vector<Names> kInputs = {{"image", "compressed_image"}, {"lidar"}, {"imu"}, {"depth"}};

/// Of an input, those topics that other processes publish.
Names topics_of(const ProbedComponent& component, const Names& input) {
  Names topics;
  for (const auto& port : component.ports) {
    const bool named = std::find(input.begin(), input.end(), port.name) != input.end();
    if (named && !port.is_output && !port.internal) topics.push_back(port.topic);
  }
  return topics;
}

void warn(const std::vector<ProbedComponent>& components,
          const std::string& bag,
          const std::set<std::string>& published,
          Logger& log) {
  for (const auto& component : components) {
    for (const auto& input : kInputs) {
      const auto topics = topics_of(component, input);
      const bool comes = std::any_of(topics.begin(), topics.end(), [&](const auto& topic) {
        return published.contains(topic);
      });
      if (topics.empty() || comes) continue;
      log.warn("{} holds nothing for input '{}' of {}: no {}; it holds {}",
               bag,
               input.front(),
               component.name,
               fmt::join(topics, " or "),
               fmt::join(published, ", "));
    }
  }
}

}  // namespace

void warn_of_unrecorded_inputs(const bringup::ProbedSystem& system, Logger& log) {
  for (const auto& replay : system.components) {
    const auto* recorded = system.recording_of(replay);
    if (recorded == nullptr) continue;
    const auto only = replay.value<Names>("topics");
    std::set<std::string> published;
    for (const auto& topic : *recorded) {
      if (!only.empty() && std::find(only.begin(), only.end(), topic) == only.end()) continue;
      published.insert(bringup::replayed_as(topic, replay.value<Names>("remap")));
    }
    warn(system.components, replay.value<std::string>("bag"), published, log);
  }
}

}  // namespace camvox::command
