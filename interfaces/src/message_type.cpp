#include "camvox/interfaces/message_type.hpp"

namespace camvox::interfaces {

std::vector<std::uint8_t> MessageType::to_cdr(const void* message) const {
  if (!counters_valid(message)) return {};
  std::vector<std::uint8_t> data(cdr_size(message));
  data.resize(write_cdr(message, data.data(), data.size()));
  return data;
}

const MessageType* find_message_type(std::string_view name) {
  for (const MessageType* type : all_message_types()) {
    if (type->ros_name == name || type->dds_name == name) return type;
  }
  return nullptr;
}

std::string to_dds_type_name(std::string_view ros_name) {
  std::string name;
  const auto last_slash = ros_name.rfind('/');
  for (std::size_t i = 0; i < ros_name.size(); ++i) {
    if (ros_name[i] != '/') {
      name += ros_name[i];
    } else {
      name += i == last_slash ? "::dds_::" : "::";
    }
  }
  return name + '_';
}

std::string to_ros_type_name(std::string_view dds_name) {
  static constexpr std::string_view kMarker = "::dds_::";
  const auto marker = dds_name.find(kMarker);
  if (marker == std::string_view::npos || !dds_name.ends_with('_')) return std::string(dds_name);
  std::string name(dds_name.substr(0, marker));
  for (auto colons = name.find("::"); colons != std::string::npos; colons = name.find("::")) {
    name.replace(colons, 2, "/");
  }
  const auto type = dds_name.substr(marker + kMarker.size());
  return name + "/" + std::string(type.substr(0, type.size() - 1));
}

MessageType renamed(const MessageType& type, std::string_view ros_name) {
  MessageType other = type;
  other.ros_name = ros_name;
  other.dds_name = to_dds_type_name(ros_name);
  return other;
}

AnyMessage make_message(const MessageType& type) { return {type.create(), type.destroy}; }

}  // namespace camvox::interfaces
