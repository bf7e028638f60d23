#include "camvox/config/constraint.hpp"

#include <algorithm>

namespace camvox::config {
namespace {

std::string number_text(double number) {
  std::string text = to_yaml(Value(number));
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

}  // namespace

std::string Constraint::to_string() const {
  switch (kind_) {
    case Kind::kAtLeast:
      return "must be at least " + number_text(bound_);
    case Kind::kGreaterThan:
      return "must be greater than " + number_text(bound_);
    case Kind::kAtMost:
      return "must be at most " + number_text(bound_);
    case Kind::kLessThan:
      return "must be less than " + number_text(bound_);
    case Kind::kNotEmpty:
      return "must not be empty";
    case Kind::kOneOf:
      break;
  }
  std::string text = "must be one of";
  for (const auto& choice : choices_) text += (&choice == &choices_.front() ? " " : ", ") + choice;
  return text;
}

bool Constraint::holds(double number) const {
  switch (kind_) {
    case Kind::kAtLeast:
      return number >= bound_;
    case Kind::kGreaterThan:
      return number > bound_;
    case Kind::kAtMost:
      return number <= bound_;
    case Kind::kLessThan:
      return number < bound_;
    case Kind::kOneOf:
    case Kind::kNotEmpty:
      break;
  }
  return true;
}

bool Constraint::holds(const std::string& text) const {
  if (kind_ == Kind::kNotEmpty) return !text.empty();
  if (kind_ != Kind::kOneOf) return true;
  return std::find(choices_.begin(), choices_.end(), text) != choices_.end();
}

std::optional<std::string> Constraint::violation(const Value& value) const {
  const auto element_holds = [this](const auto& element) {
    using Element = std::decay_t<decltype(element)>;
    if constexpr (std::is_same_v<Element, std::string>) {
      return holds(element);
    } else {
      return holds(static_cast<double>(element));
    }
  };
  const bool kept = std::visit(
      [&](const auto& held) {
        if constexpr (kIsVector<std::decay_t<decltype(held)>>) {
          if (kind_ == Kind::kNotEmpty) return !held.empty();
          return std::all_of(held.begin(), held.end(), element_holds);
        } else {
          return element_holds(held);
        }
      },
      value);
  if (kept) return std::nullopt;
  return to_string();
}

Constraint at_least(double bound) { return {Constraint::Kind::kAtLeast, bound}; }
Constraint greater_than(double bound) { return {Constraint::Kind::kGreaterThan, bound}; }
Constraint at_most(double bound) { return {Constraint::Kind::kAtMost, bound}; }
Constraint less_than(double bound) { return {Constraint::Kind::kLessThan, bound}; }
Constraint one_of(std::vector<std::string> choices) { return Constraint(std::move(choices)); }
Constraint not_empty() { return {Constraint::Kind::kNotEmpty, 0.0}; }

}  // namespace camvox::config
