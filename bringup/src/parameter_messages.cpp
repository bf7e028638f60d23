#include "camvox/bringup/parameter_messages.hpp"

namespace camvox::bringup {
namespace {

using rcl_interfaces::msg::ParameterValue;

// rcl_interfaces/ParameterType
constexpr std::uint8_t kBool = 1;
constexpr std::uint8_t kInteger = 2;
constexpr std::uint8_t kDouble = 3;
constexpr std::uint8_t kString = 4;
constexpr std::uint8_t kBoolArray = 6;
constexpr std::uint8_t kIntegerArray = 7;
constexpr std::uint8_t kDoubleArray = 8;
constexpr std::uint8_t kStringArray = 9;

struct Writer {
  ParameterValue& message;

  void operator()(bool value) const { set(kBool, message.bool_value(), value); }
  void operator()(std::int64_t value) const { set(kInteger, message.integer_value(), value); }
  void operator()(double value) const { set(kDouble, message.double_value(), value); }
  void operator()(const std::string& value) const { set(kString, message.string_value(), value); }
  void operator()(const std::vector<bool>& value) const {
    set(kBoolArray, message.bool_array_value(), value);
  }
  void operator()(const std::vector<std::int64_t>& value) const {
    set(kIntegerArray, message.integer_array_value(), value);
  }
  void operator()(const std::vector<double>& value) const {
    set(kDoubleArray, message.double_array_value(), value);
  }
  void operator()(const std::vector<std::string>& value) const {
    set(kStringArray, message.string_array_value(), value);
  }

  template <typename T>
  void set(std::uint8_t type, T& field, const T& value) const {
    message.type(type);
    field = value;
  }
};

}  // namespace

ParameterValue to_message(const config::Value& value) {
  ParameterValue message;
  std::visit(Writer{message}, value);
  return message;
}

std::optional<config::Value> from_message(const ParameterValue& message) {
  switch (message.type()) {
    case kBool:
      return message.bool_value();
    case kInteger:
      return message.integer_value();
    case kDouble:
      return message.double_value();
    case kString:
      return message.string_value();
    case kBoolArray:
      return message.bool_array_value();
    case kIntegerArray:
      return message.integer_array_value();
    case kDoubleArray:
      return message.double_array_value();
    case kStringArray:
      return message.string_array_value();
    default:
      return std::nullopt;
  }
}

}  // namespace camvox::bringup
