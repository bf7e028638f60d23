#include <fmt/format.h>

#include <algorithm>

#include "camvox/bringup/probe.hpp"
#include "camvox/component/progress.hpp"
#include "lockstep.hpp"

namespace camvox::bringup {
namespace {

constexpr auto kOffsetKey = "rig.camera_time_offset_ns";

/// Why a component cannot be waited for, or "".
std::string problem_with(const ProbedComponent& component, const std::string& progress_topic) {
  const auto* frames = find_port(component, ProgressReporter::kFrames.name);
  if (frames != nullptr && frames->is_output) {
    return frames->topic == progress_topic
               ? ""
               : fmt::format("reports its frames on {}, not on {}", frames->topic, progress_topic);
  }
  if (find_port(component, ProgressReporter::kKeyframes.name) != nullptr) {
    return "reports keyframes only, so that the replay would wait for ever; leave it out "
           "(mapping waits for loop closing with wait_for_loop_closing)";
  }
  return "does not report which frames are done, so that the replay would wait for ever";
}

/// Frames are reported in lidar time; the replay must know what lies between that and the stamps of
/// the images.
void check_offset(const ProbedComponent& replay,
                  const std::vector<ProbedComponent>& components,
                  std::vector<Problem>& problems) {
  const auto own = replay.effective_parameters.find(kOffsetKey);
  if (own == replay.effective_parameters.end()) return;
  const auto offset_ns = replay.value<std::int64_t>(kOffsetKey);
  for (const auto& component : components) {
    if (!component.effective_parameters.contains(kOffsetKey)) continue;
    const auto other_ns = component.value<std::int64_t>(kOffsetKey);
    if (other_ns == offset_ns) continue;
    const auto& other = component.effective_parameters.at(kOffsetKey);
    const bool given = own->second.location.to_string() != "default";
    problems.push_back({(given ? own->second : other).location,
                        replay.name + ".parameters." + kOffsetKey,
                        fmt::format("is {}, but {} in '{}'; give `rig` to all, under `parameters:` "
                                    "of the file",
                                    offset_ns,
                                    other_ns,
                                    component.name)});
  }
}

std::vector<Problem> check_components(const SystemConfig& config,
                                      const std::vector<ProbedComponent>& components,
                                      const ProbedComponent& replay,
                                      const std::string& progress_topic) {
  std::vector<std::string> names;
  for (const auto& component : components) names.push_back(component.name);
  const auto& external = config.container.external_topics;
  std::vector<Problem> problems;
  const auto report = [&](const std::string& message) {
    problems.push_back({replay.effective_parameters.at(kLockstepComponents).location,
                        replay.name + ".parameters." + kLockstepComponents,
                        message});
  };
  const auto waited_for = replay.value<std::vector<std::string>>(kLockstepComponents);
  if (waited_for.empty()) report("lockstep has nobody to wait for: it would drop most frames");
  for (const auto& name : waited_for) {
    const auto found = std::find(names.begin(), names.end(), name) - names.begin();
    if (found < std::ssize(names)) {
      const auto problem = problem_with(components[found], progress_topic);
      if (!problem.empty()) report("'" + name + "' " + problem);
    } else if (std::find(external.begin(), external.end(), progress_topic) == external.end()) {
      const auto nearest = config::nearest_name(name, names);
      report("'" + name + "' is no component here" +
             (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)") + ", and " +
             progress_topic + " is not in container.external_topics");
    }
  }
  return problems;
}

}  // namespace

const ProbedPort* find_port(const ProbedComponent& component, std::string_view name) {
  const auto found = std::find_if(component.ports.begin(),
                                  component.ports.end(),
                                  [name](const auto& port) { return port.name == name; });
  return found == component.ports.end() ? nullptr : &*found;
}

std::vector<Problem> check_lockstep(const SystemConfig& config, const ProbedSystem& system) {
  std::vector<Problem> problems;
  for (const auto& replay : system.components) {
    const auto* progress = find_port(replay, ProgressReporter::kFrames.name);
    if (progress == nullptr || !replay.value<bool>("lockstep")) continue;
    check_offset(replay, system.components, problems);
    if (!replay.effective_parameters.contains(kLockstepComponents)) continue;
    for (auto found : {check_components(config, system.components, replay, progress->topic),
                       check_lockstep_topic(system, replay)}) {
      problems.insert(problems.end(), found.begin(), found.end());
    }
  }
  return problems;
}

}  // namespace camvox::bringup
