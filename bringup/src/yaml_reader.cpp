#include "yaml_reader.hpp"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

namespace camvox::bringup {
namespace {

using config::Value;

std::string joined(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

bool looks_like_integer(std::string_view text) {
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<std::int64_t> to_integer(std::string_view text) {
  int base = 10;
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with("0x")) {
    text.remove_prefix(2);
    base = 16;
  }
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<double> to_double(std::string_view text) {
  static const std::map<std::string_view, double> kSpecial = {
      {".nan", std::numeric_limits<double>::quiet_NaN()},
      {".NaN", std::numeric_limits<double>::quiet_NaN()},
      {".inf", std::numeric_limits<double>::infinity()},
      {"+.inf", std::numeric_limits<double>::infinity()},
      {"-.inf", -std::numeric_limits<double>::infinity()}};
  if (const auto special = kSpecial.find(text); special != kSpecial.end()) return special->second;
  if (text.find_first_not_of("0123456789.eE+-") != std::string_view::npos) return std::nullopt;
  if (text.starts_with('+')) text.remove_prefix(1);
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

bool is_true(std::string_view text) { return text == "true" || text == "True" || text == "TRUE"; }
bool is_false(std::string_view text) {
  return text == "false" || text == "False" || text == "FALSE";
}

/// A list of values that all have the type of the first; nothing if they have not.
template <typename T>
std::optional<Value> homogeneous(const std::vector<Value>& values) {
  std::vector<T> elements;
  for (const auto& value : values) {
    const auto* element = std::get_if<T>(&value);
    if (element == nullptr) return std::nullopt;
    elements.push_back(*element);
  }
  return elements;
}

std::optional<Value> homogeneous(const std::vector<Value>& values) {
  if (values.empty()) return std::vector<std::string>{};
  return std::visit(
      [&values](const auto& first) -> std::optional<Value> {
        using T = std::decay_t<decltype(first)>;
        if constexpr (config::kIsVector<T>) {
          return std::nullopt;
        } else {
          return homogeneous<T>(values);
        }
      },
      values.front());
}

}  // namespace

std::optional<std::string> read_text(const std::filesystem::path& file,
                                     std::vector<config::Problem>& problems) {
  std::error_code ignored;
  std::ifstream stream(file);
  std::ostringstream text;
  if (!std::filesystem::is_directory(file, ignored) && stream && (text << stream.rdbuf())) {
    return text.str();
  }
  const bool exists = std::filesystem::exists(file, ignored);
  problems.push_back(
      {{file, 0}, "", exists ? "cannot be read, or is empty" : "there is no such file"});
  return std::nullopt;
}

config::Location YamlReader::location(const YAML::Node& node) const {
  return {origin_, node.Mark().is_null() ? 1 : node.Mark().line + 1};
}

void YamlReader::report(const YAML::Node& node, const std::string& path, std::string message) {
  problems_.push_back({location(node), path, std::move(message)});
}

void YamlReader::for_each_entry(const YAML::Node& map,
                                const std::string& path,
                                const Entry& entry) {
  if (!map.IsDefined() || map.IsNull()) return;
  if (!map.IsMap()) return report(map, path, "expected 'key: value' pairs");
  std::map<std::string, int> seen;
  for (const auto& item : map) {
    if (!item.first.IsScalar()) {
      report(item.first, path, "a key must be a word");
      continue;
    }
    const auto& key = item.first.Scalar();
    const int line = item.first.Mark().line + 1;
    if (const auto [first, is_new] = seen.emplace(key, line); !is_new) {
      report(item.first,
             joined(path, key),
             fmt::format("given twice (first in line {})", first->second));
      continue;
    }
    entry(key, item.second, line);
  }
}

config::ParameterMap YamlReader::parameters(const YAML::Node& map, const std::string& path) {
  config::ParameterMap found;
  add_parameters(map, path, "", found);
  return found;
}

void YamlReader::add_parameters(const YAML::Node& map,
                                const std::string& path,
                                const std::string& prefix,
                                config::ParameterMap& found) {
  for_each_entry(map,
                 prefix.empty() ? path : joined(path, prefix),
                 [&](const std::string& name, const YAML::Node& node, int line) {
                   const std::string key = joined(prefix, name);
                   if (node.IsMap()) return add_parameters(node, path, key, found);
                   const auto read = value(node, joined(path, key));
                   if (!read) return;
                   const bool is_new =
                       found.try_emplace(key, config::Parameter{*read, {origin_, line}}).second;
                   if (!is_new) report(node, joined(path, key), "given twice");
                 });
}

std::optional<Value> YamlReader::value(const YAML::Node& node, const std::string& path) {
  if (node.IsScalar()) return scalar(node, path);
  if (node.IsSequence()) return list(node, path);
  report(node, path, node.IsMap() ? "expected a value, got a map" : "has no value");
  return std::nullopt;
}

std::optional<Value> YamlReader::scalar(const YAML::Node& node, const std::string& path) {
  const std::string& text = node.Scalar();
  const bool quoted = node.Tag() == "!" || node.Tag() == "tag:yaml.org,2002:str";
  if (quoted) return text;
  if (is_true(text)) return true;
  if (is_false(text)) return false;
  if (looks_like_integer(text) || text.starts_with("0x")) {
    if (const auto number = to_integer(text)) return *number;
    report(node, path, text + " does not fit a 64-bit integer");
    return std::nullopt;
  }
  if (const auto number = to_double(text)) return *number;
  return text;
}

std::optional<Value> YamlReader::list(const YAML::Node& node, const std::string& path) {
  std::vector<Value> values;
  for (const auto& element : node) {
    if (!element.IsScalar()) {
      report(element, path, "a list may hold only plain values");
      return std::nullopt;
    }
    const auto read = scalar(element, path);
    if (!read) return std::nullopt;
    values.push_back(*read);
  }
  auto whole = homogeneous(values);
  if (!whole)
    report(node, path, "all values of a list must have one type (write 1.0, not 1, among doubles)");
  return whole;
}

}  // namespace camvox::bringup
