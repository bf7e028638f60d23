#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"

namespace camvox::bringup {

/// Reads a YAML file that holds nothing but parameters (a rig.yaml, the options of a simulation):
/// nested maps become dotted keys. What is wrong with the file is appended to `problems`.
[[nodiscard]] config::ParameterMap read_parameter_file(const std::filesystem::path& file,
                                                       std::vector<config::Problem>& problems);

/// The parameters of "key=value" words, values as in YAML; `origin` names the option that took
/// them in messages ("--set").
[[nodiscard]] config::ParameterMap parse_assignments(const std::vector<std::string>& words,
                                                     const std::string& origin,
                                                     std::vector<config::Problem>& problems);

}  // namespace camvox::bringup
