#include "camvox/bringup/parameter_file.hpp"

#include "camvox/bringup/system_config.hpp"
#include "yaml_reader.hpp"

namespace camvox::bringup {

config::ParameterMap read_parameter_file(const std::filesystem::path& file,
                                         std::vector<config::Problem>& problems) {
  const auto text = read_text(file, problems);
  if (!text) return {};
  try {
    return YamlReader(file, problems).parameters(YAML::Load(*text), "");
  } catch (const YAML::Exception& error) {
    problems.push_back({{file, error.mark.line + 1}, "", "not valid YAML: " + error.msg});
    return {};
  }
}

config::ParameterMap parse_assignments(const std::vector<std::string>& words,
                                       const std::string& origin,
                                       std::vector<config::Problem>& problems) {
  config::ParameterMap parameters;
  for (const auto& word : words) {
    const config::Location location{origin + " " + word, 0};
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      problems.push_back({location, "", "expected key=value"});
      continue;
    }
    const auto value = parse_value(word.substr(equals + 1), location, problems);
    parameters.insert_or_assign(word.substr(0, equals), config::Parameter{value, location});
  }
  return parameters;
}

}  // namespace camvox::bringup
