#pragma once

#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "camvox/bringup/plugin_loader.hpp"
#include "camvox/bringup/system_config.hpp"
#include "camvox/component/component.hpp"

namespace camvox::bringup {

/// One input or output that a component asked for.
struct ProbedPort {
  std::string name;       ///< In `remap`.
  std::string topic;      ///< After remapping.
  std::string type_name;  ///< "sensor_msgs/msg/Imu"
  bool is_output = false;
  bool internal = false;  ///< A plain type: stays in the container, no drivers publish it.
  bool required = false;  ///< Inputs only.
};

/// What one component would do, learnt by constructing it once without middleware.
struct ProbedComponent {
  std::string name;
  std::vector<ProbedPort> ports;
  ParameterMap effective_parameters;  ///< Defaults included; origin "default" or from the file.
  std::vector<Problem> problems;      ///< Parameters, unknown ports, a constructor that throws.
  bool constructed = false;           ///< If not, what else it would have asked for is not known.

  /// A parameter as it takes effect; T{} if the component has none of this name and type.
  template <typename T>
  [[nodiscard]] T value(const std::string& key) const {
    const auto found = effective_parameters.find(key);
    if (found == effective_parameters.end()) return {};
    const auto* value = std::get_if<T>(&found->second.value);
    return value != nullptr ? *value : T{};
  }
};

/// Constructs and destroys a component on a recording context.
[[nodiscard]] ProbedComponent probe_component(const ComponentConfig& component,
                                              ComponentFactory& factory);

/// A config with what its components ask for.
struct ProbedSystem {
  std::vector<ProbedComponent> components;  ///< In the order of the config.
  std::vector<Problem> problems;            ///< Sorted by line, each once.
  /// Topics of each bag that is replayed, by the bag; looked at once, as one without an index takes
  /// long.
  std::map<std::string, std::vector<std::string>> recordings;

  /// Topics of what the component replays. Null if that is nothing, or a bag that cannot be read:
  /// replay says why when it starts.
  [[nodiscard]] const std::vector<std::string>* recording_of(const ProbedComponent& replay) const;
};

/// Checks everything that the file alone does not tell: plugins, parameters, ports, wiring. Shared
/// parameters are given to the components that have them.
[[nodiscard]] ProbedSystem probe_system(SystemConfig& config, PluginLoader& plugins);

/// Gives a component, which was probed, those shared parameters that it has and was not given.
/// True if there were any; it must then be probed again.
bool give_shared_parameters(const ParameterMap& shared,
                            const ProbedComponent& probed,
                            ComponentConfig& component);

/// Shared parameters that no component has, unless they come from a parameter file and no
/// component has anything of their block ("camera", "rig").
[[nodiscard]] std::vector<Problem> unused_shared_parameters(
    const SystemConfig& config, const std::vector<ProbedComponent>& components);

/// Whether a required input that nothing publishes is a problem.
enum class MissingWriters { kForbidden, kAllowed };

/// Inputs that nothing feeds, two writers of one internal topic, topics with two types.
[[nodiscard]] std::vector<Problem> check_wiring(
    const SystemConfig& config,
    const std::vector<ProbedComponent>& components,
    MissingWriters missing = MissingWriters::kForbidden);

/// The name that a recorded topic gets from a replay's rules, "from:=to" each.
[[nodiscard]] std::string replayed_as(const std::string& topic,
                                      const std::vector<std::string>& rules);

/// Gives a replay in lockstep what it was not told: whom to wait for (everyone here who reports
/// each frame), and under which name the recording holds the images that somebody here reads. True
/// if there was something; it must then be probed again.
bool give_lockstep_defaults(const ProbedSystem& system,
                            const ProbedComponent& replay,
                            ComponentConfig& config);

/// A recording without the frames that lockstep counts, and components that a replay shall wait for
/// and that do not report each frame.
[[nodiscard]] std::vector<Problem> check_lockstep(const SystemConfig& config,
                                                  const ProbedSystem& system);

/// The config as it takes effect, all defaults filled in, as a config file with the origin of
/// each value as a comment.
[[nodiscard]] std::string effective_config(const SystemConfig& config,
                                           const std::vector<ProbedComponent>& components);

}  // namespace camvox::bringup
