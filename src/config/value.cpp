#include "camvox/config/value.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace camvox::config {
namespace {

std::string scalar_to_yaml(bool value) { return value ? "true" : "false"; }

std::string scalar_to_yaml(std::int64_t value) { return std::to_string(value); }

std::string scalar_to_yaml(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  std::string text(buffer.data(), end);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string scalar_to_yaml(const std::string& value) {
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

struct YamlWriter {
  template <typename T>
  std::string operator()(const T& value) const {
    return scalar_to_yaml(value);
  }
  template <typename T>
  std::string operator()(const std::vector<T>& values) const {
    std::string text = "[";
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text += ", ";
      text += scalar_to_yaml(static_cast<T>(values[i]));
    }
    return text + "]";
  }
};

}  // namespace

std::string Location::to_string() const {
  return line > 0 ? file + ":" + std::to_string(line) : file;
}

std::string_view type_name(const Value& value) {
  static constexpr std::array<std::string_view, std::variant_size_v<Value>> kNames = {
      "bool",
      "integer",
      "double",
      "string",
      "bool array",
      "integer array",
      "double array",
      "string array"};
  return kNames[value.index()];
}

std::string to_yaml(const Value& value) { return std::visit(YamlWriter{}, value); }

std::string to_yaml(const ParameterMap& parameters) {
  std::string text;
  std::string open;  ///< Path of the maps that the last line stands in, with a dot at its end.
  for (const auto& [key, parameter] : parameters) {
    // Sorted keys: those of one map follow each other.
    std::size_t begin = 0;
    std::string indent;
    for (auto dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
      const std::string path = key.substr(0, dot + 1);
      if (!open.starts_with(path)) {
        text += indent + key.substr(begin, dot - begin) + ":\n";
        open = path;
      }
      begin = dot + 1;
      indent += "  ";
    }
    open = key.substr(0, begin);
    text += indent + key.substr(begin) + ": " + to_yaml(parameter.value) + "\n";
  }
  return text;
}

}  // namespace camvox::config
