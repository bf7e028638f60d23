#include <fmt/format.h>

#include <algorithm>

#include "camvox/bringup/parameter_file.hpp"
#include "camvox/bringup/system_config.hpp"
#include "camvox/interfaces/topics.hpp"
#include "yaml_reader.hpp"

namespace camvox::bringup {
namespace {

const std::vector<std::string> kSections = {
    "container", "topics", "parameters", "parameter_files", "components"};

/// Reads one config; its members run through the file from top to bottom.
class ConfigFileReader {
 public:
  ConfigFileReader(const std::string& origin, ConfigReadout& readout)
      : origin_(origin),
        config_(readout.config),
        problems_(readout.problems),
        yaml_(origin, readout.problems) {}

  void read(const YAML::Node& root) {
    if (!root.IsMap()) {
      problems_.push_back(
          {{origin_, 1}, "", "expected the sections container, topics, components"});
      return;
    }
    YAML::Node components;
    yaml_.for_each_entry(root, "", [&](const std::string& key, const YAML::Node& node, int line) {
      if (key == "container") {
        container_ = yaml_.parameters(node, key);
      } else if (key == "topics") {
        read_topics(node);
      } else if (key == "parameters") {
        add_shared(yaml_.parameters(node, key));
      } else if (key == "parameter_files") {
        read_parameter_files(node);
      } else if (key == "components") {
        components.reset(node);
      } else {
        report_unknown(key, line, kSections, "section");
      }
    });
    if (components.IsDefined() && !components.IsNull()) read_components(components);
  }

  /// Files of shared parameters from the command line: they win over the config.
  void add_parameter_files(const std::vector<std::filesystem::path>& files) {
    for (const auto& file : files) {
      for (auto& [key, parameter] : read_parameter_file(file, problems_)) {
        config_.shared_parameters.insert_or_assign(key, parameter);
        config_.file_parameters.insert(key);
      }
    }
  }

  /// Overrides go on top of what the file says, before types and ranges are checked.
  void override_with(const std::vector<std::string>& overrides) {
    for (const auto& text : overrides) {
      const Location origin{"--set " + text, 0};
      const auto equals = text.find('=');
      const auto dot = text.find('.');
      if (equals == std::string::npos || dot == std::string::npos || dot > equals) {
        problems_.push_back({origin, "", "expected component.parameter=value"});
        continue;
      }
      const auto owner = text.substr(0, dot);
      const auto value = parse_value(text.substr(equals + 1), origin, problems_);
      if (auto* target = parameters_of(owner, origin)) {
        (*target)[text.substr(dot + 1, equals - dot - 1)] = {value, origin};
      }
    }
  }

  void check() {
    check_container();
    check_names();
  }

 private:
  void report_unknown(const std::string& key,
                      int line,
                      const std::vector<std::string>& known,
                      const std::string& kind) {
    const auto nearest = config::nearest_name(key, known);
    const auto hint = nearest.empty() ? fmt::format(" (there are {})", fmt::join(known, ", "))
                                      : fmt::format(" (did you mean '{}'?)", nearest);
    problems_.push_back({{origin_, line}, key, "unknown " + kind + hint});
  }

  /// Loads a struct; problems get the path before their key.
  template <typename Config>
  void load(const ParameterMap& values, Config& config, const std::string& path) {
    for (auto& problem : config::load(values, config)) {
      problem.key = path + "." + problem.key;
      if (problem.message.starts_with("unknown parameter")) problem.message.replace(8, 9, "key");
      problems_.push_back(std::move(problem));
    }
  }

  void read_topics(const YAML::Node& section) {
    yaml_.for_each_entry(
        section, "topics", [&](const std::string& topic, const YAML::Node& node, int line) {
          const auto path = "topics." + topic;
          config_.topic_locations[topic] = {origin_, line};
          load(yaml_.parameters(node, path), config_.topics[topic], path);
          report_bad_topic(topic, {origin_, line}, path);
        });
  }

  /// A config's own shared parameters stand over those of its files, whatever comes first.
  void add_shared(const ParameterMap& parameters) {
    for (const auto& [key, parameter] : parameters) {
      config_.shared_parameters.insert_or_assign(key, parameter);
      config_.file_parameters.erase(key);
    }
  }

  void read_parameter_files(const YAML::Node& list) {
    if (!list.IsSequence())
      return yaml_.report(list, "parameter_files", "expected a list of files");
    const auto folder = std::filesystem::path(origin_).parent_path();
    for (const auto& node : list) {
      if (!node.IsScalar()) {
        yaml_.report(node, "parameter_files", "expected a file name");
        continue;
      }
      for (auto& [key, parameter] : read_parameter_file(folder / node.Scalar(), problems_)) {
        if (config_.shared_parameters.emplace(key, parameter).second) {
          config_.file_parameters.insert(key);
        }
      }
    }
  }

  void report_bad_topic(const std::string& topic,
                        const Location& location,
                        const std::string& key) {
    if (const auto problem = interfaces::topics::name_problem(topic); !problem.empty()) {
      problems_.push_back({location, key, problem});
    }
  }

  void read_components(const YAML::Node& section) {
    if (!section.IsSequence())
      return yaml_.report(section, "components", "expected a list ('- plugin: ...')");
    int index = 0;
    for (const auto& node : section) {
      const auto number = fmt::format("components[{}]", index++);
      if (node.IsMap()) {
        read_component(node, number);
      } else {
        yaml_.report(node, number, "expected 'plugin: ...' and 'name: ...'");
      }
    }
  }

  void read_component(const YAML::Node& node, const std::string& number) {
    ComponentConfig component;
    component.location = yaml_.location(node);
    const auto path = node["name"] && node["name"].IsScalar() ? node["name"].Scalar() : number;
    YAML::Node plain;  // the keys that are fields of ComponentConfig
    ParameterMap fields;
    yaml_.for_each_entry(
        node, path, [&](const std::string& key, const YAML::Node& value, int line) {
          if (key == "remap") {
            read_remap(value, path + ".remap", component);
          } else if (key == "parameters") {
            component.parameters = yaml_.parameters(value, path + ".parameters");
          } else if (value.IsMap()) {
            report_unknown(key, line, {"remap", "parameters"}, "key");
          } else if (const auto read = yaml_.value(value, path + "." + key)) {
            fields[key] = {*read, {origin_, line}};
          }
        });
    component.plugin_location =
        fields.contains("plugin") ? fields["plugin"].location : component.location;
    if (!fields.contains("watchdog_s")) component.watchdog_s = kInherit;
    load(fields, component, path);
    for (const auto* required : {"plugin", "name"}) {
      if (!node[required])
        problems_.push_back({component.location, path, fmt::format("'{}' is missing", required)});
    }
    config_.components.push_back(std::move(component));
  }

  void read_remap(const YAML::Node& node, const std::string& path, ComponentConfig& component) {
    yaml_.for_each_entry(
        node, path, [&](const std::string& port, const YAML::Node& topic, int line) {
          const auto key = path + "." + port;
          if (!topic.IsScalar()) return yaml_.report(topic, key, "expected a topic name");
          report_bad_topic(topic.Scalar(), {origin_, line}, key);
          component.remap[port] = {topic.Scalar(), {origin_, line}};
        });
  }

  ParameterMap* parameters_of(const std::string& owner, const Location& origin) {
    if (owner == "container") return &container_;
    if (owner == "parameters") return &config_.shared_parameters;
    std::vector<std::string> names = {"container", "parameters"};
    for (auto& component : config_.components) {
      if (component.name == owner) return &component.parameters;
      names.push_back(component.name);
    }
    problems_.push_back(
        {origin,
         "",
         fmt::format("there is no component '{}' (there are {})", owner, fmt::join(names, ", "))});
    return nullptr;
  }

  void check_container() {
    load(container_, config_.container, "container");
    const auto location = [this](const char* key) {
      const auto found = container_.find(key);
      return found == container_.end() ? Location{origin_, 1} : found->second.location;
    };
    if (const auto problem = component_name_problem(config_.container.name); !problem.empty()) {
      problems_.push_back({location("name"), "container.name", problem});
    }
    for (const auto& topic : config_.container.external_topics) {
      report_bad_topic(topic, location("external_topics"), "container.external_topics");
    }
    for (auto& component : config_.components) {
      if (component.watchdog_s == kInherit) component.watchdog_s = config_.container.watchdog_s;
    }
  }

  void check_names() {
    std::map<std::string, int> lines;
    for (const auto& component : config_.components) {
      if (component.name.empty()) continue;  // reported where it is missing
      if (const auto problem = component_name_problem(component.name); !problem.empty()) {
        problems_.push_back({component.location, component.name + ".name", problem});
      }
      const auto [first, is_new] = lines.emplace(component.name, component.location.line);
      if (is_new) continue;
      problems_.push_back(
          {component.location,
           component.name + ".name",
           fmt::format("is the name of another component already (line {})", first->second)});
    }
  }

  static constexpr double kInherit = -1.0;

  const std::string& origin_;
  SystemConfig& config_;
  std::vector<Problem>& problems_;
  YamlReader yaml_;
  ParameterMap container_;
};

}  // namespace

ConfigReadout parse_config(const std::string& text,
                           const std::string& origin,
                           const ConfigOverrides& overrides) {
  ConfigReadout readout;
  try {
    ConfigFileReader reader(origin, readout);
    reader.read(YAML::Load(text));
    reader.add_parameter_files(overrides.parameter_files);
    reader.override_with(overrides.values);
    reader.check();
  } catch (const YAML::Exception& error) {
    readout.problems.push_back({{origin, error.mark.line + 1}, "", "not valid YAML: " + error.msg});
  }
  sort_problems(readout.problems);
  return readout;
}

ConfigReadout read_config_file(const std::filesystem::path& file,
                               const ConfigOverrides& overrides) {
  ConfigReadout unread;
  const auto text = read_text(file, unread.problems);
  if (!text) return unread;
  return parse_config(*text, file, overrides);
}

config::Value parse_value(const std::string& yaml,
                          const Location& location,
                          std::vector<Problem>& problems) {
  std::vector<Problem> found;
  config::Value value = std::string{};
  try {
    YamlReader reader(location.file, found);
    if (const auto read = reader.value(YAML::Load(yaml), "")) value = *read;
  } catch (const YAML::Exception& error) {
    found.push_back({location, "", "not valid YAML: " + error.msg});
  }
  for (auto& problem : found) problems.push_back({location, problem.key, problem.message});
  return value;
}

std::string component_name_problem(std::string_view name) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_0123456789";
  if (name == "container" || name == "parameters") return "'" + std::string(name) + "' is reserved";
  if (name.find_first_not_of(kLetters) != std::string_view::npos) {
    return "'" + std::string(name) + "' may hold only letters, digits and '_'";
  }
  if (!name.empty() && name.front() >= '0' && name.front() <= '9') {
    return "'" + std::string(name) + "' must not start with a digit";
  }
  return {};
}

void sort_problems(std::vector<Problem>& problems) {
  std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
    return a.location.line < b.location.line;
  });
  const auto same = [](const Problem& a, const Problem& b) {
    return a.to_string() == b.to_string();
  };
  problems.erase(std::unique(problems.begin(), problems.end(), same), problems.end());
}

}  // namespace camvox::bringup
