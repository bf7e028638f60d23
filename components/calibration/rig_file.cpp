#include "camvox/calibration_component/rig_file.hpp"

#include <fstream>
#include <sstream>
#include <system_error>

#include "camvox/config/parameters.hpp"

namespace camvox::calibration_component {
namespace {

/// Appends the fields of a config as a YAML mapping under `name`.
template <typename Config>
void append(const std::string& name, const Config& config, std::string& text) {
  text += name + ":\n";
  std::string open;  // the nested config whose fields are being written
  for (const auto& [key, parameter] : config::dump(config)) {
    const std::size_t dot = key.find('.');
    const std::string group = dot == std::string::npos ? "" : key.substr(0, dot);
    if (group != open && !group.empty()) text += "  " + group + ":\n";
    open = group;
    text += (group.empty() ? "  " + key : "    " + key.substr(dot + 1)) + ": " +
            config::to_yaml(parameter.value) + "\n";
  }
}

}  // namespace

std::string rig_file_text(const sensors::CameraIntrinsics& camera, const sensors::RigConfig& rig) {
  std::string text = "# Written by calibration.\n";
  append("camera", camera, text);
  append("rig", rig, text);
  return text;
}

std::string as_comment(const std::string& text) {
  std::istringstream lines(text);
  std::string comment;
  for (std::string line; std::getline(lines, line);) comment += "# " + line + "\n";
  return comment;
}

std::string write_rig_file(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::path fresh = path;
  fresh += ".new";
  std::ofstream file(fresh);
  file << text;
  file.close();
  if (!file) return "cannot write " + fresh.string();
  std::error_code error;
  std::filesystem::rename(fresh, path, error);
  return error ? "cannot replace " + path.string() + ": " + error.message() : "";
}

}  // namespace camvox::calibration_component
