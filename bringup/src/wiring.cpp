#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "camvox/bringup/probe.hpp"
#include "camvox/storage/bag_reader.hpp"

namespace camvox::bringup {
namespace {

/// Reports of all components meet on this type, so that its topic may have many writers.
constexpr std::string_view kSharedType = "camvox_interfaces/msg/Progress";

class WiringCheck {
 public:
  WiringCheck(const SystemConfig& config, const std::vector<ProbedComponent>& components)
      : config_(config), components_(components) {}

  std::vector<Problem> run(MissingWriters missing) {
    for_each_port([this](std::size_t component, const ProbedPort& port) {
      check_type(component, port);
      if (port.is_output && port.internal) check_single_writer(component, port);
    });
    for_each_port([this, missing](std::size_t component, const ProbedPort& port) {
      const bool needs_writer = !port.is_output && port.internal && port.required;
      if (needs_writer && missing == MissingWriters::kForbidden) check_has_writer(component, port);
    });
    check_topic_settings();
    return std::move(problems_);
  }

 private:
  template <typename Visitor>
  void for_each_port(Visitor visitor) {
    for (std::size_t i = 0; i < components_.size(); ++i) {
      for (const auto& port : components_[i].ports) visitor(i, port);
    }
  }

  void report(std::size_t component, const ProbedPort& port, std::string message) {
    const auto& entry = config_.components[component];
    const auto remap = entry.remap.find(port.name);
    const auto& location = remap == entry.remap.end() ? entry.location : remap->second.location;
    problems_.push_back({location, entry.name + ".remap." + port.name, std::move(message)});
  }

  void check_type(std::size_t component, const ProbedPort& port) {
    const auto [first, is_new] = types_.emplace(port.topic, Use{component, port.type_name});
    if (is_new || first->second.type_name == port.type_name) return;
    report(component,
           port,
           fmt::format("{} carries {} here, but {} in '{}'",
                       port.topic,
                       port.type_name,
                       first->second.type_name,
                       components_[first->second.component].name));
  }

  void check_single_writer(std::size_t component, const ProbedPort& port) {
    const auto [first, is_new] = writers_.emplace(port.topic, component);
    if (port.type_name == kSharedType) return;
    if (!is_new) {
      report(component,
             port,
             fmt::format("{} is published by '{}' already; an internal topic has one publisher",
                         port.topic,
                         components_[first->second].name));
    } else if (is_external(port.topic)) {
      report(component,
             port,
             fmt::format("{} is in container.external_topics, but published here", port.topic));
    }
  }

  void check_has_writer(std::size_t component, const ProbedPort& port) {
    if (writers_.contains(port.topic) || is_external(port.topic)) return;
    std::vector<std::string> published;
    for (const auto& writer : writers_) published.push_back(writer.first);
    const auto nearest = config::nearest_name(port.topic, published);
    report(component,
           port,
           fmt::format("nothing publishes {}{}; add the component that does, remap the port, or "
                       "list the topic in container.external_topics",
                       port.topic,
                       nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
  }

  void check_topic_settings() {
    std::vector<std::string> used;
    for (const auto& use : types_) used.push_back(use.first);
    for (const auto& [topic, location] : config_.topic_locations) {
      if (types_.contains(topic)) continue;
      const auto nearest = config::nearest_name(topic, used);
      problems_.push_back({location,
                           "topics." + topic,
                           "no component uses this topic" +
                               (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)")});
    }
  }

  [[nodiscard]] bool is_external(const std::string& topic) const {
    const auto& external = config_.container.external_topics;
    return std::find(external.begin(), external.end(), topic) != external.end();
  }

  struct Use {
    std::size_t component;
    std::string type_name;
  };

  const SystemConfig& config_;
  const std::vector<ProbedComponent>& components_;
  std::map<std::string, Use> types_;
  std::map<std::string, std::size_t> writers_;
  std::vector<Problem> problems_;
};

/// Components that could not be made leave gaps: what they would publish is then not missing.
bool all_complete(const std::vector<ProbedComponent>& components) {
  return std::all_of(
      components.begin(), components.end(), [](const auto& c) { return c.constructed; });
}

ProbedComponent probe_plugin(const ComponentConfig& component, PluginLoader& plugins) {
  try {
    const auto factory = plugins.factory(component.plugin);
    return probe_component(component, *factory);
  } catch (const PluginError& error) {
    return {component.name,
            {},
            {},
            {{component.plugin_location, component.name + ".plugin", error.what()}},
            false};
  }
}

/// A mistake in a parameter that components share is said once, with all who have it.
std::vector<Problem> problems_of(const std::vector<ProbedComponent>& components) {
  std::vector<Problem> problems;  // at first without the component's name in the key
  std::map<std::string, std::vector<std::string>> concerned;
  for (const auto& component : components) {
    for (auto problem : component.problems) {
      problem.key.erase(0, component.name.size() + 1);
      auto& names = concerned[problem.to_string()];
      if (names.empty()) problems.push_back(problem);
      if (names.empty() || names.back() != component.name) names.push_back(component.name);
    }
  }
  for (auto& problem : problems) {
    const auto& names = concerned.at(problem.to_string());
    if (names.size() == 1) problem.key = names.front() + "." + problem.key;
    if (names.size() > 1) problem.message += fmt::format(" ({})", fmt::join(names, ", "));
  }
  return problems;
}

void read_recordings(ProbedSystem& system) {
  for (const auto& replay : system.components) {
    const auto bag = replay.value<std::string>("bag");
    if (bag.empty() || system.recordings.contains(bag)) continue;
    const auto reader = storage::BagReader::open(bag);
    if (!reader.ok()) continue;
    auto& topics = system.recordings[bag];
    for (const auto& topic : (*reader)->topics()) topics.push_back(topic.name);
  }
}

/// Needs all components, so it comes after each of them was probed.
void complete_lockstep(SystemConfig& config, PluginLoader& plugins, ProbedSystem& system) {
  for (std::size_t i = 0; i < config.components.size(); ++i) {
    auto& probed = system.components[i];
    if (!give_lockstep_defaults(system, probed, config.components[i])) continue;
    probed = probe_plugin(config.components[i], plugins);
  }
}

}  // namespace

const std::vector<std::string>* ProbedSystem::recording_of(const ProbedComponent& replay) const {
  const auto found = recordings.find(replay.value<std::string>("bag"));
  return found == recordings.end() ? nullptr : &found->second;
}

std::vector<Problem> check_wiring(const SystemConfig& config,
                                  const std::vector<ProbedComponent>& components,
                                  MissingWriters missing) {
  return WiringCheck(config, components).run(missing);
}

ProbedSystem probe_system(SystemConfig& config, PluginLoader& plugins) {
  ProbedSystem system;
  for (auto& component : config.components) {
    auto probed = component.plugin.empty() ? ProbedComponent{component.name, {}, {}, {}, false}
                                           : probe_plugin(component, plugins);
    if (give_shared_parameters(config.shared_parameters, probed, component)) {
      probed = probe_plugin(component, plugins);
    }
    system.components.push_back(std::move(probed));
  }
  const bool complete = all_complete(system.components);
  if (complete) {
    read_recordings(system);
    complete_lockstep(config, plugins, system);
  }
  system.problems = problems_of(system.components);
  if (complete) {
    const auto unused = unused_shared_parameters(config, system.components);
    system.problems.insert(system.problems.end(), unused.begin(), unused.end());
    const auto wiring = check_wiring(config, system.components);
    system.problems.insert(system.problems.end(), wiring.begin(), wiring.end());
    const auto lockstep = check_lockstep(config, system);
    system.problems.insert(system.problems.end(), lockstep.begin(), lockstep.end());
  }
  sort_problems(system.problems);
  return system;
}

}  // namespace camvox::bringup
