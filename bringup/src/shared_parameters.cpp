#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "camvox/bringup/probe.hpp"

namespace camvox::bringup {
namespace {

std::string block_of(const std::string& key) { return key.substr(0, key.find('.')); }

}  // namespace

bool give_shared_parameters(const ParameterMap& shared,
                            const ProbedComponent& probed,
                            ComponentConfig& component) {
  bool given = false;
  for (const auto& [key, parameter] : shared) {
    if (probed.effective_parameters.contains(key)) {
      given = component.parameters.emplace(key, parameter).second || given;
    }
  }
  return given;
}

std::vector<Problem> unused_shared_parameters(const SystemConfig& config,
                                              const std::vector<ProbedComponent>& components) {
  std::set<std::string> known;
  std::set<std::string> blocks;
  for (const auto& component : components) {
    for (const auto& parameter : component.effective_parameters) {
      known.insert(parameter.first);
      blocks.insert(block_of(parameter.first));
    }
  }
  std::vector<Problem> problems;
  for (const auto& [key, parameter] : config.shared_parameters) {
    if (known.contains(key)) continue;
    const bool from_file = config.file_parameters.contains(key);
    if (from_file && !blocks.contains(block_of(key))) continue;  // a rig file serves all configs
    const auto nearest = config::nearest_name(key, {known.begin(), known.end()});
    problems.push_back({parameter.location,
                        "parameters." + key,
                        "no component has this parameter" +
                            (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)")});
  }
  return problems;
}

}  // namespace camvox::bringup
