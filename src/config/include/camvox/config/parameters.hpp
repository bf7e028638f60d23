#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "camvox/config/constraint.hpp"
#include "camvox/config/value.hpp"

/// Typed parameters. A config struct lists its fields once, in a static `visit`:
///
///     struct DepthProjectorConfig {
///       double min_range_m = 0.5;  ///< Nearer returns are ignored.
///       template <typename Self, typename Visitor>
///       static void visit(Self& self, Visitor&& field) {
///         field("min_range_m", self.min_range_m, config::at_least(0.0));
///       }
///     };
///
/// and gets loading, checking and printing from the functions below. Fields may be bool,
/// integers, floating point, std::string, std::vector of these, and nested config structs
/// ("ransac" + "iterations" = key "ransac.iterations"). Integers are accepted where a double is
/// declared; nothing else is converted.
namespace camvox::config {

/// One thing that is wrong with a configuration, where, and what would be right.
struct Problem {
  Location location;
  std::string key;
  std::string message;

  /// "file:line: key: message".
  [[nodiscard]] std::string to_string() const;
};

/// Thrown with *all* problems of a configuration; `what()` has one per line.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<Problem> problems);
  [[nodiscard]] const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

/// The known name nearest to a misspelt one, or "" if none is near enough to be meant. The same
/// last part in another block ("a.limit_m" for "limit_m") is nearest.
[[nodiscard]] std::string nearest_name(std::string_view misspelt,
                                       const std::vector<std::string>& known);

namespace internal {

template <typename T, typename Ignored = void>
inline constexpr bool kIsConfig = false;
/// Stands in for a visitor so that "has a visit function" can be asked of a type.
struct AnyVisitor {
  template <typename... Arguments>
  void operator()(Arguments&&...) const {}
};
template <typename T>
inline constexpr bool
    kIsConfig<T, std::void_t<decltype(T::visit(std::declval<T&>(), AnyVisitor{}))>> = true;

[[nodiscard]] std::string wrong_type(std::string_view expected, const Value& actual);
void report_unknown_keys(const ParameterMap& parameters,
                         const std::vector<std::string>& known,
                         std::vector<Problem>& problems);

/// Assigns a value to a field; returns what is wrong with it, or "".
template <typename T>
[[nodiscard]] std::string assign(const Value& value, T& field) {
  using Stored = typename Storage<T>::type;
  if constexpr (std::is_same_v<Stored, double>) {
    if (const auto* integer = std::get_if<std::int64_t>(&value)) {
      field = static_cast<T>(*integer);
      return {};
    }
  }
  if constexpr (std::is_same_v<Stored, std::vector<double>>) {
    if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&value)) {
      field.clear();
      for (const auto integer : *integers) field.push_back(static_cast<double>(integer));
      return {};
    }
  }
  const auto* stored = std::get_if<Stored>(&value);
  if (stored == nullptr) return wrong_type(type_name(Value(Stored{})), value);
  if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    if (!std::in_range<T>(*stored)) return "integer out of range";
  }
  if constexpr (kIsVector<T>) {
    field.assign(stored->begin(), stored->end());
  } else {
    field = static_cast<T>(*stored);
  }
  return {};
}

/// Calls `leaf(key, field, constraints...)` for every field, nested structs included.
template <typename Config, typename Leaf>
void for_each_field(Config& config, const std::string& prefix, Leaf& leaf) {
  std::remove_const_t<Config>::visit(
      config, [&](std::string_view name, auto& field, const auto&... constraints) {
        const std::string key = prefix + std::string(name);
        if constexpr (kIsConfig<std::remove_const_t<std::remove_reference_t<decltype(field)>>>) {
          for_each_field(field, key + ".", leaf);
        } else {
          leaf(key, field, constraints...);
        }
      });
}

}  // namespace internal

/// Every constraint that the values in `config` break; locations name `origin`.
template <typename Config>
[[nodiscard]] std::vector<Problem> check(const Config& config,
                                         const std::string& origin = "config") {
  std::vector<Problem> problems;
  auto leaf = [&](const std::string& key, const auto& field, const auto&... constraints) {
    const Value value = to_value(field);
    for (const Constraint& constraint : std::vector<Constraint>{constraints...}) {
      if (const auto broken = constraint.violation(value)) {
        problems.push_back({{origin, 0}, key, to_yaml(value) + " " + *broken});
      }
    }
  };
  internal::for_each_field(config, "", leaf);
  return problems;
}

/// Throws ConfigError with all broken constraints. For constructors of library classes.
template <typename Config>
void require_valid(const Config& config, const std::string& origin = "config") {
  if (auto problems = check(config, origin); !problems.empty()) {
    throw ConfigError(std::move(problems));
  }
}

/// Sets the fields of `config` from `parameters`. Returns every problem: unknown key (with the
/// nearest known one), wrong type, broken constraint. Fields with a problem keep their value.
template <typename Config>
[[nodiscard]] std::vector<Problem> load(const ParameterMap& parameters, Config& config) {
  std::vector<Problem> problems;
  std::vector<std::string> known;
  auto leaf = [&](const std::string& key, auto& field, const auto&... constraints) {
    known.push_back(key);
    const auto found = parameters.find(key);
    if (found == parameters.end()) return;
    const auto& [value, location] = found->second;
    auto candidate = field;
    if (const auto error = internal::assign(value, candidate); !error.empty()) {
      problems.push_back({location, key, error});
      return;
    }
    bool valid = true;
    for (const Constraint& constraint : std::vector<Constraint>{constraints...}) {
      if (const auto broken = constraint.violation(to_value(candidate))) {
        problems.push_back({location, key, to_yaml(value) + " " + *broken});
        valid = false;
      }
    }
    if (valid) field = std::move(candidate);
  };
  internal::for_each_field(config, "", leaf);
  internal::report_unknown_keys(parameters, known, problems);
  return problems;
}

/// All fields with their present values; the inverse of `load`.
template <typename Config>
[[nodiscard]] ParameterMap dump(const Config& config, const std::string& origin = "default") {
  ParameterMap parameters;
  auto leaf = [&](const std::string& key, const auto& field, const auto&...) {
    parameters[key] = {to_value(field), {origin, 0}};
  };
  internal::for_each_field(config, "", leaf);
  return parameters;
}

}  // namespace camvox::config
