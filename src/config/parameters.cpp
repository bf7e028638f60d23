#include "camvox/config/parameters.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace camvox::config {
namespace {

std::string join(const std::vector<Problem>& problems) {
  std::string text;
  for (const auto& problem : problems) text += (text.empty() ? "" : "\n") + problem.to_string();
  return text;
}

/// Levenshtein distance: single-letter edits from one text to the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
    }
  }
  return row.back();
}

}  // namespace

std::string Problem::to_string() const {
  std::string text = location.to_string();
  if (!key.empty()) text += (text.empty() ? "" : ": ") + key;
  return text + (text.empty() ? "" : ": ") + message;
}

ConfigError::ConfigError(std::vector<Problem> problems)
    : std::runtime_error(join(problems)), problems_(std::move(problems)) {}

std::string nearest_name(std::string_view misspelt, const std::vector<std::string>& known) {
  const auto last_part = [](std::string_view key) { return key.substr(key.rfind('.') + 1); };
  for (const auto& name : known) {  // the right parameter of the wrong block
    if (name != misspelt && last_part(name) == last_part(misspelt)) return name;
  }
  const std::size_t tolerance = std::max<std::size_t>(2, misspelt.size() / 3);
  std::string best;
  std::size_t best_distance = tolerance + 1;
  for (const auto& name : known) {
    if (const auto distance = edit_distance(misspelt, name); distance < best_distance) {
      best = name;
      best_distance = distance;
    }
  }
  return best;
}

namespace internal {

std::string wrong_type(std::string_view expected, const Value& actual) {
  return "expected " + std::string(expected) + ", got " + std::string(type_name(actual)) + " " +
         to_yaml(actual);
}

void report_unknown_keys(const ParameterMap& parameters,
                         const std::vector<std::string>& known,
                         std::vector<Problem>& problems) {
  for (const auto& [key, parameter] : parameters) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string nearest = nearest_name(key, known);
    problems.push_back(
        {parameter.location,
         key,
         "unknown parameter" + (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)")});
  }
}

}  // namespace internal
}  // namespace camvox::config
