#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camvox/config/value.hpp"

namespace camvox::config {

/// What a parameter must satisfy beside its type. Made by the functions below; applied to every
/// element of an array.
class Constraint {
 public:
  enum class Kind { kAtLeast, kGreaterThan, kAtMost, kLessThan, kOneOf, kNotEmpty };

  Constraint(Kind kind, double bound) : kind_(kind), bound_(bound) {}
  explicit Constraint(std::vector<std::string> choices)
      : kind_(Kind::kOneOf), choices_(std::move(choices)) {}

  /// The rule in words ("must be at least 0") when the value breaks it, nothing when it is kept.
  /// NaN breaks every numeric rule.
  [[nodiscard]] std::optional<std::string> violation(const Value& value) const;

  [[nodiscard]] std::string to_string() const;

 private:
  [[nodiscard]] bool holds(double number) const;
  [[nodiscard]] bool holds(const std::string& text) const;

  Kind kind_;
  double bound_ = 0.0;
  std::vector<std::string> choices_;
};

[[nodiscard]] Constraint at_least(double bound);
[[nodiscard]] Constraint greater_than(double bound);
[[nodiscard]] Constraint at_most(double bound);
[[nodiscard]] Constraint less_than(double bound);
[[nodiscard]] Constraint one_of(std::vector<std::string> choices);
[[nodiscard]] Constraint not_empty();

}  // namespace camvox::config
