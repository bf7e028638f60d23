#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace camvox::config {

/// A parameter value, with the types that ROS 2 parameters have.
using Value = std::variant<bool,
                           std::int64_t,
                           double,
                           std::string,
                           std::vector<bool>,
                           std::vector<std::int64_t>,
                           std::vector<double>,
                           std::vector<std::string>>;

/// Where a value was written, for error messages. Line 0 means "not from a file".
struct Location {
  std::string file;
  int line = 0;

  /// "file:line", or just the origin when there is no line.
  [[nodiscard]] std::string to_string() const;
};

/// A value and where it came from.
struct Parameter {
  Value value;
  Location location;
};

/// Flat parameters of one component; nested keys are joined with a dot ("ransac.iterations").
using ParameterMap = std::map<std::string, Parameter, std::less<>>;

/// The type's name as users know it: "bool", "integer", "double", "string", "double array", ...
[[nodiscard]] std::string_view type_name(const Value& value);

/// The value as YAML flow text that reads back as the same type (a double keeps its point).
[[nodiscard]] std::string to_yaml(const Value& value);

/// Parameters as YAML text of nested maps, a line each, sorted by key: what a config file holds.
[[nodiscard]] std::string to_yaml(const ParameterMap& parameters);

template <typename T>
inline constexpr bool kIsVector = false;
template <typename T>
inline constexpr bool kIsVector<std::vector<T>> = true;

/// The alternative of Value that stores a C++ field of type T (any integer is stored as int64).
template <typename T>
struct Storage {
  using type = std::conditional_t<
      std::is_same_v<T, bool>,
      bool,
      std::conditional_t<std::is_integral_v<T>,
                         std::int64_t,
                         std::conditional_t<std::is_floating_point_v<T>, double, T>>>;
};
template <typename T>
struct Storage<std::vector<T>> {
  using type = std::vector<typename Storage<T>::type>;
};

/// Wraps a C++ field as a Value.
template <typename T>
[[nodiscard]] Value to_value(const T& field) {
  using Stored = typename Storage<T>::type;
  if constexpr (kIsVector<T>) {
    return Value(Stored(field.begin(), field.end()));
  } else {
    return Value(Stored(field));
  }
}

}  // namespace camvox::config
